"""Each check of the nonuniform-sampling paper can fail: with one of its inputs perturbed its verdict is another one."""

import copy
import re

import pytest
from computed import result
from faults import Fault, Read, Results, all_of, put, verdict

from papers.mustafa import PAPER
from papers.mustafa.claims.algorithm import BOUND_9, CORRECTED_GRID
from papers.mustafa.experiments.declared import EXPERIMENTS
from papers.mustafa.experiments.draws import LAWS
from papers.mustafa.method import AS_PRINTED, CORRECT, Step4
from papers.mustafa.printed import DATA, EXAMPLES
from replication.audit.data import PrintedValue
from replication.audit.judge.verdict import AGREES
from replication.audit.model import Kind, Verdict

pytestmark = pytest.mark.slow
"""All read what several experiments give, which takes seconds even where they are cheap."""

KEY = PAPER.key
CLAIMS = {claim.id.removeprefix(f"{KEY}."): claim for claim in PAPER.claims}
UNUSED = ("common", "sensitivity", "against-range")


def no_filter(results: Results) -> None:
    for law in LAWS:
        results["laws"][law]["filter"] = results["laws"][law]["none"]


BROKEN: dict[str, Fault] = {
    **{f"robust-level.{e}": put(f"bracket.{e}/filter_radius", 1.001) for e in EXAMPLES},
    "step-3": put("bracket.2/nominal", 0.0953),
    "finite-grid": put("curve.1/floor", 0.05),
    "grid-for-6": all_of(*(put(f"curve.{e}/floor", 0.05) for e in EXAMPLES)),
    **{f"valid.{e}": put(f"bracket.{e}/filter_radius", 1.001) for e in EXAMPLES},
    **{f"valid-own.{e}": all_of(put(f"own-grid.{e}/lower", 0.10), put(f"own-grid.{e}/upper", 0.11)) for e in EXAMPLES},
    "lemma-1": put("bracket.1/common", 0.0),
    **dict.fromkeys(("theorem-1", "theorem-2", "theorem-3.stability"), put("bracket.1/filter_radius", 1.001)),
    "theorem-3.level": put("identities/recovery", 1e-6),
    "small-gain": put("bracket.1/filter_radius", 1.001),
    "lemma-2": put("identities/lemma 2", 1e-6),
    "lemma-3": put("identities/lemma 3", 1e-6),
    "map": put("identities/map reordered", 1e-6),
    "map-12": put("identities/map reordered", 1e-6),
    "l3": put("condition.1/ends/lower/bound", 1.01),
    "u3": put("condition.2/ends/upper, corrected/bound", 1.01),
    "conservative": put("grids.2/intervals/corrected, alpha", {"lower": 0.0, "upper": 1.0, "covers": True}),
    **{f"stable.{e}": put(f"bracket.{e}/filter_radius", 1.001) for e in EXAMPLES},
    "recovery": put("identities/recovery", 1e-6),
    "congruence": put("identities/congruence", 1e-6),
    **{f"algorithm.{e}": put(f"grids.{e}/algorithm/{CORRECT.name}/end", "STALLED") for e in EXAMPLES},
    "grid-size.example-1": put(f"grids.1/algorithm/{CORRECT.name}/size", int(DATA["grid-size-1"])),
    "grid-size.example-2": all_of(*(put(f"condition.2/{name}", 2) for name in ("elements", "modal_elements"))),
    "condition-8.1": all_of(
        *(put(f"condition.1/{name}", 0.9) for name in ("constant", "constant_bound", "modal", "modal_bound"))
    ),
    "condition-8.2": all_of(put("condition.2/modal", 1.1), put("condition.2/modal_bound", 1.11)),
    "same-level": put("robust.1/lmi13", 10.0),
    "filter.norm": put("bracket.2/nominal", 0.0953),
    "filter.output-matrix": put("output-matrix/upper", [0.7, 1.1]),
    "filter.second-column": put("nominal.2/Phi/0/1", 0.0375),
    "filter.first-column": put("nominal.2/Phi/0/0", 0.607),
    "figure.attenuated": no_filter,
}
"""An alteration of a result that the answer of a claim reads, under which the verdict must be another one."""
BY_PRINT = {"theorem-3.sizes": ("B_f", "[0.6505 0.0000; 1.0666 0.0000]")}
"""Claims that read the print alone: the entry of the printed filter that is altered, and how."""


@pytest.fixture(scope="module")
def results() -> Results:
    """Results of all experiments that claims use."""
    names = (one.name for one in EXPERIMENTS if one.name.partition(".")[0] not in UNUSED)
    return {name: result(f"{KEY}.{name}") for name in names}


def verdict_on(name: str, results: Results) -> Verdict:
    return verdict(PAPER, CLAIMS[name], results)


def test_every_check_has_its_perturbed_input(results: Results) -> None:
    """None is left out but what cannot be checked from the text."""
    checked = {name for name, claim in CLAIMS.items() if not claim.answer(results).not_checkable}
    assert {
        *BROKEN,
        *BY_PRINT,
        *(name for name, verdict, _ in ALTERED if verdict is not CLAIMS[name].expected),
    } == checked
    assert all(CLAIMS[name].kind is not Kind.CITED for name in checked)


@pytest.mark.parametrize("name", sorted(BROKEN))
def test_a_perturbed_result_changes_the_verdict(name: str, results: Results) -> None:
    assert verdict_on(name, results) is CLAIMS[name].expected
    altered = copy.deepcopy(results)
    BROKEN[name](altered)
    assert verdict_on(name, altered) is not CLAIMS[name].expected


@pytest.mark.parametrize("name", sorted(BY_PRINT))
def test_a_perturbed_print_changes_the_verdict(name: str, results: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    assert verdict_on(name, results) is CLAIMS[name].expected
    matrix, other = BY_PRINT[name]
    monkeypatch.setitem(DATA["filter"], matrix, PrintedValue(other, "Sec. VI-B"))
    assert verdict_on(name, results) is not CLAIMS[name].expected


OPEN = Verdict.UNDETERMINED
ALTERED: list[tuple[str, Verdict, Fault]] = [
    # Some level, whichever, and that of the grid keep the claim on the abstract from being refuted.
    *((f"robust-level.{e}", OPEN, put(f"bracket.{e}/nominal", 0.2)) for e in EXAMPLES),
    *(
        (
            f"robust-level.{e}",
            Verdict.REFUTED,
            all_of(put(f"bracket.{e}/nominal", 0.2), put(f"bracket.{e}/filter_radius", 1.001)),
        )
        for e in EXAMPLES
    ),
    # A bracket that does not decide gives no verdict.
    *((f"robust-level.{e}", OPEN, put(f"bracket.{e}/lower", 0.01)) for e in EXAMPLES),
    *((f"valid-own.{e}", OPEN, put(f"own-grid.{e}/lower", 0.01)) for e in EXAMPLES),
    # A level is the least one, or where a solver may stop, in both examples alike.
    *(
        (f"gamma.{e}", expected, put(f"nominal.{e}/formula", share * float(DATA[f"gamma-{e}"])))
        for e in EXAMPLES
        for share, expected in (
            (1.0, Verdict.REPRODUCED), (0.998, Verdict.COMPATIBLE), (0.99, Verdict.DIFFERS), (1.002, Verdict.DIFFERS),
        )
    ),
    # The filter that is printed has a level of its own.
    ("filter.norm", Verdict.REPRODUCED, put("nominal.2/formula", 0.99 * float(DATA["gamma-2"]))),
    # What ends as printed needs no correction.
    *(
        (
            f"algorithm.{e}",
            Verdict.CONSISTENT,
            all_of(*(put(f"grids.{e}/algorithm/{one[0].name}/end", "COVERED") for one in AS_PRINTED.values())),
        )
        for e in EXAMPLES
    ),
    *(
        (
            f"grid-size.example-{e}",
            Verdict.REPRODUCED,
            put(f"grids.{e}/algorithm/{AS_PRINTED[Step4.CUT][0].name}/end", "COVERED"),
        )
        for e in EXAMPLES
    ),
    # Where neither way of reading "required" fails, it holds; read as a gain over sequences, (12) always does.
    ("small-gain.required", Verdict.REFUTED, put("bracket.2/filter_radius", 1.001)),
    ("performance-12", Verdict.REPRODUCED_AFTER_ERRATUM, put("bracket.2/lower", 0.01)),
]  # fmt: skip
"""Claims with an alteration and the verdict that it brings."""


@pytest.mark.parametrize(("name", "expected", "alter"), ALTERED)
def test_an_altered_result_brings_this_verdict(name: str, expected: Verdict, alter: Fault, results: Results) -> None:
    altered = copy.deepcopy(results)
    alter(altered)
    assert verdict_on(name, altered) is expected


@pytest.mark.parametrize("name", ["recovery", "congruence", "theorem-3.level", "grid-size.example-1", "valid-own.2"])
def test_the_text_as_printed_alone_gives_none_of_these(name: str, results: Results) -> None:
    printed = CLAIMS[name].answer(results).as_printed
    assert printed is not None
    assert printed.holds is not True
    assert printed.value is None


def test_what_rests_on_the_motor_constant_needs_its_proof(results: Results) -> None:
    """It is not charged to the authors, and not taken for granted either."""
    altered = copy.deepcopy(results)
    altered["nominal.2"]["Phi"][0][1] *= 2
    for name, claim in CLAIMS.items():
        if claim.erratum == f"{KEY}.motor-constant" and claim.expected in AGREES:
            assert verdict_on(name, altered) not in AGREES, name


CORRECTED = {
    "u3": (CORRECTED_GRID, BOUND_9),
    "algorithm": (CORRECTED_GRID, BOUND_9),
    "size-of-F": ("least nominal level",),
    "row": ("least nominal level",),
}
"""By erratum the readings that rest on it."""
OF_SECOND = ("draws", "laws", "output-matrix")
"""Experiments on Example 2 whose names do not say so."""


def test_each_correction_that_a_claim_rests_on_is_named(results: Results) -> None:
    """In its erratum or, beside that, in its note: one rule for all claims. An inference stands in the erratum."""
    for name, claim in CLAIMS.items():
        wanted = {erratum for erratum, readings in CORRECTED.items() if claim.reading in readings}
        note = claim.answer(read := Read(results)).note
        if any(use.endswith(".2") or use.startswith(OF_SECOND) for use in read):
            wanted.add("motor-constant")
        field = (claim.erratum or "").removeprefix(f"{KEY}.")
        noted = re.findall(r"[\w-]+", " ".join(re.findall(r"\(errat(?:um|a) ([^)]*)\)", note)))
        assert wanted <= {field, *noted}, name
        assert "algorithm" not in wanted or field == "algorithm", name


def test_the_bounds_between_nodes_are_bounds(results: Results) -> None:
    for e in EXAMPLES:
        found = results[f"condition.{e}"]
        assert found["constant"] < found["constant_bound"] < 1.01 * found["constant"]
        assert found["modal"] < found["modal_bound"] < 1.01 * found["modal"]
        # No coordinates give less than modal ones for a constant change.
        assert found["modal"] <= found["constant"]
