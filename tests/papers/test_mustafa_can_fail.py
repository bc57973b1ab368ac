"""Each check of the nonuniform-sampling paper can fail: with one of its inputs perturbed its verdict is another one."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from typing import Any

import pytest

from papers.mustafa import PAPER
from papers.mustafa.claims.algorithm import BOUND_9, CORRECTED_GRID
from papers.mustafa.claims.preliminaries import MOTOR_CONSTANT
from papers.mustafa.experiments.declared import EXPERIMENTS
from papers.mustafa.experiments.draws import LAWS, laws
from papers.mustafa.experiments.levels import output_matrix
from papers.mustafa.method import AS_PRINTED, CORRECT, WITH_SET_MINUS
from papers.mustafa.printed import DATA, EXAMPLES
from replication.audit.data import PrintedValue
from replication.audit.judge.numerals import require_short
from replication.audit.judge.verdict import AGREES, make_record
from replication.audit.model import NO_READING, Kind, Policy, Verdict
from replication.audit.store.records import ErratumRecord

pytestmark = pytest.mark.slow
"""All read what several experiments give, which takes seconds even where they are cheap."""

KEY = PAPER.key
CLAIMS = {claim.id.removeprefix(f"{KEY}."): claim for claim in PAPER.claims}
CHEAPER: dict[str, dict[str, Any]] = {
    "bracket": {"horizon": 100, "final_horizon": 200, "leaves": 4, "cuts": None},
    "bracket-duration": {"horizon": 100, "final_horizon": 200, "leaves": 4, "cuts": None},
    "own-grid": {"nodes": 11, "horizon": 100, "final_horizon": 200, "leaves": 4},
    "curve": {"nodes": 11},
    "loosest": {"horizon": 50, "final_horizon": 100},
    "output-matrix": {"angles": 201},
    "laws": {"seeds": 4},
    **{f"draws-{part}": {"seeds": 8} for part in range(4)},
}
"""Inputs with which the experiments that cost most are cheap: coarser brackets, fewer draws."""
UNUSED = ("common", "sensitivity", "against-range")
Alteration = Callable[[dict[str, Any]], None]


def to(value: Any, *path: Any) -> Alteration:
    """The alteration that puts a value at the end of a path of keys."""

    def alter(results: dict[str, Any]) -> None:
        *way, last = path
        for key in way:
            results = results[key]
        assert results[last] != value
        results[last] = value

    return alter


def both(*alterations: Alteration) -> Alteration:
    def alter(results: dict[str, Any]) -> None:
        for one in alterations:
            one(results)

    return alter


def no_filter(results: dict[str, Any]) -> None:
    for law in LAWS:
        results["laws"][law]["filter"] = results["laws"][law]["none"]


BROKEN: dict[str, Alteration] = {
    **{f"robust-level.{e}": to(1.001, f"bracket.{e}", "filter_radius") for e in EXAMPLES},
    "step-3": to(0.0953, "bracket.2", "nominal"),
    "finite-grid": to(0.05, "curve.1", "floor"),
    "grid-for-6": both(*(to(0.05, f"curve.{e}", "floor") for e in EXAMPLES)),
    **{f"valid.{e}": to(1.001, f"bracket.{e}", "filter_radius") for e in EXAMPLES},
    **{
        f"valid-own.{e}": both(to(0.10, f"own-grid.{e}", "lower"), to(0.11, f"own-grid.{e}", "upper")) for e in EXAMPLES
    },
    "lemma-1": to(0.0, "bracket.1", "common"),
    **dict.fromkeys(("theorem-1", "theorem-2", "theorem-3.stability"), to(1.001, "bracket.1", "filter_radius")),
    "theorem-3.level": to(1e-6, "identities", "recovery"),
    "performance-12": to(0.01, "bracket.2", "lower"),
    "small-gain": to(1.001, "bracket.1", "filter_radius"),
    "small-gain.required": to(0.9, "condition.1", "modal"),
    "lemma-2": to(1e-6, "identities", "lemma 2"),
    "lemma-3": to(1e-6, "identities", "lemma 3"),
    "map": to(1e-6, "identities", "map reordered"),
    "map-12": to(1e-6, "identities", "map reordered"),
    "l3": to(1.01, "condition.1", "ends", "lower", "bound"),
    "u3": to(1.01, "condition.2", "ends", "upper, corrected", "bound"),
    "conservative": to({"lower": 0.0, "upper": 1.0, "covers": True}, "grids.2", "intervals", "corrected, alpha"),
    **{f"stable.{e}": to(1.001, f"bracket.{e}", "filter_radius") for e in EXAMPLES},
    "recovery": to(1e-6, "identities", "recovery"),
    "congruence": to(1e-6, "identities", "congruence"),
    **{f"algorithm.{e}": to("STALLED", f"grids.{e}", "algorithm", CORRECT.name, "end") for e in EXAMPLES},
    "grid.1": to(int(DATA["grid-size-1"]), "grids.1", "algorithm", CORRECT.name, "size"),
    "grid.2": both(*(to(2, "condition.2", name) for name in ("elements", "modal_elements"))),
    "condition-8.1": both(
        *(to(0.9, "condition.1", name) for name in ("constant", "constant_bound", "modal", "modal_bound"))
    ),
    "condition-8.2": both(to(1.1, "condition.2", "modal"), to(1.11, "condition.2", "modal_bound")),
    "same-level": to(10.0, "robust.1", "lmi13"),
    "gamma.1": to(0.1018, "nominal.1", "formula"),
    "gamma.2": to(0.0953, "nominal.2", "formula"),
    "filter.norm": to(0.0953, "bracket.2", "nominal"),
    "filter.output-matrix": to([0.7, 1.1], "output-matrix", "upper"),
    "filter.second-column": to(0.0375, "nominal.2", "Phi", 0, 1),
    "filter.first-column": to(0.607, "nominal.2", "Phi", 0, 0),
    "figure.attenuated": no_filter,
}
"""For each claim an alteration of a result that its answer reads, under which the verdict must be another one."""
BY_PRINT = {"theorem-3.sizes": ("B_f", "[0.6505 1.0666]")}
"""Claims that read the print alone: the entry of the printed filter that is altered, and how."""


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    """Results of all experiments that claims use, by their short names, with inputs that cost little."""
    found = {}
    for experiment in EXPERIMENTS:
        stem = experiment.name.partition(".")[0]
        if stem not in UNUSED:
            found[experiment.name] = experiment.function(**{**experiment.inputs, **CHEAPER.get(stem, {})})
    return found


def verdict(name: str, results: dict[str, Any]) -> Verdict:
    claim, full = CLAIMS[name], {f"{KEY}.{key}": value for key, value in results.items()}
    erratum = next((erratum for erratum in PAPER.errata if erratum.id == claim.erratum), None)
    proof = None if erratum is None else ErratumRecord.of(KEY, erratum, erratum.prove(full))
    return make_record(claim, claim.answer(full), proof, readings=PAPER.readings).verdict


def test_every_check_has_its_perturbed_input(results: dict[str, Any]) -> None:
    """None is left out but what cannot be checked from the text."""
    full = {f"{KEY}.{key}": value for key, value in results.items()}
    checked = {name for name, claim in CLAIMS.items() if not claim.answer(full).not_checkable}
    assert set(BROKEN) | set(BY_PRINT) == checked
    assert all(CLAIMS[name].kind is not Kind.CITED for name in checked)


@pytest.mark.parametrize("name", sorted(BROKEN))
def test_a_perturbed_result_changes_the_verdict(name: str, results: dict[str, Any]) -> None:
    assert verdict(name, results) is CLAIMS[name].expected
    altered = copy.deepcopy(results)
    BROKEN[name](altered)
    assert verdict(name, altered) is not CLAIMS[name].expected


@pytest.mark.parametrize("name", sorted(BY_PRINT))
def test_a_perturbed_print_changes_the_verdict(
    name: str, results: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert verdict(name, results) is CLAIMS[name].expected
    matrix, other = BY_PRINT[name]
    monkeypatch.setitem(DATA["filter"], matrix, PrintedValue(other, "Sec. VI-B"))
    assert verdict(name, results) is not CLAIMS[name].expected


OPEN = Verdict.UNDETERMINED
ALTERED: list[tuple[str, Verdict, Alteration]] = [
    # Some level, whichever, and that of the grid keep the claim on the abstract from being refuted.
    *((f"robust-level.{e}", OPEN, to(0.2, f"bracket.{e}", "nominal")) for e in EXAMPLES),
    *(
        (
            f"robust-level.{e}",
            Verdict.REFUTED,
            both(to(0.2, f"bracket.{e}", "nominal"), to(1.001, f"bracket.{e}", "filter_radius")),
        )
        for e in EXAMPLES
    ),
    # A bracket that does not decide gives no verdict.
    *((f"robust-level.{e}", OPEN, to(0.01, f"bracket.{e}", "lower")) for e in EXAMPLES),
    *((f"valid-own.{e}", OPEN, to(0.01, f"own-grid.{e}", "lower")) for e in EXAMPLES),
    # A level is the least one, or where a solver may stop, in both examples alike.
    *(
        (f"gamma.{e}", expected, to(share * float(DATA[f"gamma-{e}"]), f"nominal.{e}", "formula"))
        for e in EXAMPLES
        for share, expected in (
            (1.0, Verdict.REPRODUCED), (0.998, Verdict.COMPATIBLE), (0.99, Verdict.DIFFERS), (1.002, Verdict.DIFFERS),
        )
    ),
    # The filter that is printed has a level of its own.
    ("filter.norm", Verdict.REPRODUCED, to(0.99 * float(DATA["gamma-2"]), "nominal.2", "formula")),
    # What ends as printed needs no correction.
    *(
        (
            f"algorithm.{e}",
            Verdict.CONSISTENT,
            both(*(to("COVERED", f"grids.{e}", "algorithm", one.name, "end") for one in (AS_PRINTED, WITH_SET_MINUS))),
        )
        for e in EXAMPLES
    ),
    *(
        (f"grid.{e}", Verdict.REPRODUCED, to("COVERED", f"grids.{e}", "algorithm", AS_PRINTED.name, "end"))
        for e in EXAMPLES
    ),
    # Where neither way of reading "required" fails, it holds; where both do, it does not.
    ("small-gain.required", Verdict.CONSISTENT, to(0.9, "condition.1", "modal")),
    ("small-gain.required", Verdict.REFUTED, to(1.001, "bracket.2", "filter_radius")),
    ("performance-12", Verdict.REPRODUCED_AFTER_ERRATUM, to(0.01, "bracket.2", "lower")),
    ("performance-12", Verdict.REFUTED, to(0.01, "bracket.1", "upper")),
]  # fmt: skip
"""Claims with an alteration and the verdict that it brings."""


@pytest.mark.parametrize(("name", "expected", "alter"), ALTERED)
def test_an_altered_result_brings_this_verdict(
    name: str, expected: Verdict, alter: Alteration, results: dict[str, Any]
) -> None:
    altered = copy.deepcopy(results)
    alter(altered)
    assert verdict(name, altered) is expected


@pytest.mark.parametrize("name", ["recovery", "congruence", "theorem-3.level", "grid.1", "valid-own.2"])
def test_the_text_as_printed_alone_gives_none_of_these(name: str, results: dict[str, Any]) -> None:
    full = {f"{KEY}.{key}": value for key, value in results.items()}
    printed = CLAIMS[name].answer(full).as_printed
    assert printed is not None
    assert printed.holds is not True
    assert printed.value is None


def test_what_rests_on_the_motor_constant_needs_its_proof(results: dict[str, Any]) -> None:
    """It is not charged to the authors, and not taken for granted either."""
    altered = copy.deepcopy(results)
    altered["nominal.2"]["Phi"][0][1] *= 2
    for name, claim in CLAIMS.items():
        if claim.erratum == f"{KEY}.motor-constant" and claim.expected in AGREES:
            assert verdict(name, altered) not in AGREES, name


CORRECTED = {
    "u3": (CORRECTED_GRID, BOUND_9),
    "algorithm": (CORRECTED_GRID, BOUND_9),
    "size-of-F": ("least nominal level",),
    "row": ("least nominal level",),
}
"""By erratum the readings that rest on it."""
OF_SECOND = ("draws", "laws", "output-matrix")
"""Experiments on Example 2 whose names do not say so."""


def test_each_correction_that_a_claim_rests_on_is_named(results: dict[str, Any]) -> None:
    """In its erratum or, beside that, in its note: one rule for all claims. An inference stands in the erratum."""
    full = {f"{KEY}.{key}": value for key, value in results.items()}
    for name, claim in CLAIMS.items():
        wanted = {erratum for erratum, readings in CORRECTED.items() if claim.reading in readings}
        short = [use.removeprefix(f"{KEY}.") for use in claim.uses]
        if any(use.endswith(".2") or use.startswith(OF_SECOND) for use in short):
            wanted.add("motor-constant")
        field = (claim.erratum or "").removeprefix(f"{KEY}.")
        noted = re.findall(r"[\w-]+", " ".join(re.findall(r"\(errat(?:um|a) ([^)]*)\)", claim.answer(full).note)))
        assert wanted <= {field, *noted}, name
        assert "algorithm" not in wanted or field == "algorithm", name


@pytest.mark.parametrize("e", EXAMPLES)
def test_what_rests_on_the_motor_constant_says_so(e: int, results: dict[str, Any]) -> None:
    full = {f"{KEY}.{key}": value for key, value in results.items()}
    names = ("gamma", "robust-level", "valid", "valid-own", "grid", "condition-8", "algorithm", "stable")
    for name in names:
        assert (MOTOR_CONSTANT in CLAIMS[f"{name}.{e}"].answer(full).note) == (e == 2), name


def inputs(name: str) -> dict[str, Any]:
    (experiment,) = (experiment for experiment in EXPERIMENTS if experiment.name == name)
    return dict(experiment.inputs)


def test_attenuation_fails_for_an_estimate_of_zero(results: dict[str, Any]) -> None:
    given = inputs("laws")
    given["printed"] = {**given["printed"], "C": [[0.0, 0.0]]}
    altered = {**results, "laws": laws(**{**given, "seeds": 4})}
    assert verdict("figure.attenuated", altered) is not CLAIMS["figure.attenuated"].expected


def test_another_printed_input_matrix_leaves_c_f_undecided_or_wrong(results: dict[str, Any]) -> None:
    """The box around C_f is for the printed A_f and B_f: at a hundred times the level it does not decide."""
    given = inputs("output-matrix")
    altered = {**results, "output-matrix": output_matrix(**{**given, "level": 100 * given["level"], "angles": 201})}
    assert verdict("filter.output-matrix", altered) is not CLAIMS["filter.output-matrix"].expected


def test_the_bounds_between_nodes_are_bounds(results: dict[str, Any]) -> None:
    for e in EXAMPLES:
        found = results[f"condition.{e}"]
        assert found["constant"] < found["constant_bound"] < 1.01 * found["constant"]
        assert found["modal"] < found["modal_bound"] < 1.01 * found["modal"]
        # No coordinates give less than modal ones for a constant change.
        assert found["modal"] <= found["constant"]


def test_every_claim_and_outcome_has_a_reading_of_the_paper(results: dict[str, Any]) -> None:
    # Where a solver stopped is read into each level that a text minimises, by the policy on it.
    known = {reading.name for reading in PAPER.readings if reading.policy is not Policy.SOLVER} | {NO_READING}
    full, used = {f"{KEY}.{key}": value for key, value in results.items()}, set()
    for claim in PAPER.claims:
        evidence = claim.answer(full)
        answers = [evidence] if evidence.as_printed is None else [evidence, evidence.as_printed]
        found = {claim.reading, *(outcome.reading for answer in answers for outcome in answer.outcomes)}
        assert found <= known, claim.id
        used |= found
    assert used == known


def test_findings_are_short(results: dict[str, Any]) -> None:
    findings = PAPER.findings({f"{KEY}.{key}": value for key, value in results.items()})
    assert [require_short(finding) for finding in findings] == list(findings)
    assert len(findings) == len(set(findings)) >= 10
