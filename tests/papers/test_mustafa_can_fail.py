"""What turns a verdict on the nonuniform-sampling paper, and to which: results, prints, and proofs of errata."""

import copy
import re

import pytest
from computed import result
from faults import Fault, Results, all_of, put, verdict

from papers._common import Read
from papers.mustafa import PAPER
from papers.mustafa.claims.algorithm import BOUND_9, CORRECTED_GRID
from papers.mustafa.experiments.declared import EXPERIMENTS
from papers.mustafa.method import AS_PRINTED, Step4
from papers.mustafa.printed import DATA, EXAMPLES
from replication.audit.data import PrintedValue
from replication.audit.model import Verdict

pytestmark = pytest.mark.slow
"""All read what several experiments give, which takes seconds even where they are cheap."""

KEY = PAPER.key
CLAIMS = {claim.id.removeprefix(f"{KEY}."): claim for claim in PAPER.claims}
UNUSED = ("common", "sensitivity", "against-range")


@pytest.fixture(scope="module")
def results() -> Results:
    """Results of all experiments that claims use."""
    names = (one.name for one in EXPERIMENTS if one.name.partition(".")[0] not in UNUSED)
    return {name: result(f"{KEY}.{name}") for name in names}


def verdict_on(name: str, results: Results) -> Verdict:
    return verdict(PAPER, CLAIMS[name], results)


def test_the_size_of_f_follows_the_printed_filter(monkeypatch: pytest.MonkeyPatch) -> None:
    claim = CLAIMS["theorem-3.sizes"]
    assert verdict(PAPER, claim, {}, proof=True) is claim.expected
    monkeypatch.setitem(DATA["filter"], "B_f", PrintedValue("[0.6505 0.0000; 1.0666 0.0000]", "Sec. VI-B"))
    assert verdict(PAPER, claim, {}, proof=True) is not claim.expected


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
