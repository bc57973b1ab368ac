"""Each claim, and each proof of an erratum, of each paper can fail: with other numbers in what was computed it does.

All numbers are altered at once, then by the name under which they lie in the results, one name after another.
"""

import copy
import tomllib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from faults import Fault, Results, put, verdict

import papers
from papers._common import Read
from papers.mustafa.method import CORRECT
from papers.mustafa.printed import DATA as MUSTAFA
from papers.peet2019.printed import DATA as PEET
from papers.shao import printed as shao
from replication.audit.model import AGREES, Claim, Erratum, Kind, Verdict
from replication.audit.parts import Paper
from replication.audit.run.runner import Outcome

pytestmark = pytest.mark.slow

CHANGES: tuple[Callable[[float], float], ...] = (
    lambda x: 1e3 * x + 1, lambda x: -x - 1e-3, lambda x: 0.99 * x, lambda x: 0,
)  # fmt: skip
ALL = "every number"
READS = tomllib.loads(Path(__file__).with_name("reads.toml").read_text(encoding="utf-8"))


def windows_as_printed(results: Results) -> None:
    """Each number of the table comes out over some window."""
    for column, cells in results["windows"].items():
        for cell, text in zip(cells, shao.table_1(f"DRC-{column.upper()}"), strict=True):
            cell["nearest"] = float(text)


BY_HAND: dict[str, Fault] = {
    **{f"mustafa.algorithm.{e}": put(f"grids.{e}/algorithm/{CORRECT.name}/end", "STALLED") for e in (1, 2)},
    "mustafa.grid-size.example-1": put(f"grids.1/algorithm/{CORRECT.name}/size", int(MUSTAFA["grid-size-1"])),
    "shao.theory.prediction-bound": put("theorem/scalar_gap", (0.5, 1.0)),
    **dict.fromkeys(
        (f"shao.table.apo-{row}" for row in (1, 2, 3)),
        put("table/readings/apo", dict.fromkeys(shao.READ["apo"], tuple(map(float, shao.table_1("DRC-APO"))))),
    ),
    "shao.table.any-window": windows_as_printed,
}
"""What turns the verdict where one factor for all numbers of a name does not: words, or numbers that must agree."""
PROOFS_BY_HAND: dict[tuple[str, str], Fault] = {
    **{("mustafa.algorithm", f"grids.{e}"): BY_HAND[f"mustafa.algorithm.{e}"] for e in (1, 2)},
    ("okajima2023.sensor-index", "schedule.sec-4a"): put("schedule.sec-4a/diagonals/0", [1.0, 1.0, 1.0]),
    ("peet2019.figure-1-caption", "sos.ex3.d3"): put("sos.ex3.d3/tensor/gamma", float(PEET["figure-level"])),
}
"""The same of the proofs of errata, with the experiment."""
BESIDE = {
    ("mustafa.size-of-F", "nominal.2"),
    *(("okajima2023.diagonal-of-a", name) for name in ("unstable.as-printed", "unstable.recovered")),
}
"""Experiments whose numbers stand beside a proof that does not hang on them."""
ELSEWHERE = {
    "mustafa.theorem-3.sizes", "okajima2023.gains.unmeasured", "peet2019.ex4.unstable",
    "peet2019.table1.function-of-product", "shao.table.any-reading",
    *(f"okajima2023.unstable.{name}" for name in ("poles", "is-unstable", "gains-optimal", "error-poles")),
}  # fmt: skip
"""Claims that follow the print, and claims that no verdict but that of their outcomes shows to follow the results."""
DECISIVE = {
    "mustafa.theorem-3.level": ("recovery", "congruence", "at_elements"),
    "okajima2023.theory.sufficient-1": ("dissipation", "largest_ratio", "spectral_radius"),
    "okajima2023.theory.sufficient-2": ("schur", "norm"),
    "okajima2023.theory.summation": ("epsilon", "excess_26", "excess_27", "largest_ratio", "sum_residual"),
    "okajima2023.unstable.designable": ("norm", "poles"),
    "okajima2023.unstable.one-plant": ("error_poles", "poles_recovered"),
    "peet2019.theory.lmi-3": ("largest", "storage"),
    "peet2019.theory.theorem-1": ("lmi-3", "norms"),
    "peet2019.theory.theorem-3": ("theorem_3", "norms"),
    "peet2019.theory.theorem-3-feasible": ("storage", "dissipation"),
    "peet2019.theory.present-only": ("corrected", "l0"),
    "peet2019.fig1.below-level": ("scan", "gamma"),
    "peet2019.scaling.desktop": ("peak", "cpu_seconds"),
    **{f"peet2019.loop.ex{e}": ("norms", "abscissa") for e in (1, 2, 3)},
    "shao.theory.output-bounds": ("12", "13"),
}
"""Claims that follow several numbers, each of which turns the verdict alone."""


def names(value: Any) -> Iterator[str]:
    """All names in some results; of a list those in its first entry."""
    if isinstance(value, dict):
        for name, entry in value.items():
            yield from (name, *names(entry))
    elif isinstance(value, list):
        yield from names(value[:1] and value[0])


def altered(value: Any, name: str, change: Callable[[float], float], inside: bool = False) -> Any:
    """The same with all numbers changed that have a name or lie below it."""
    if isinstance(value, dict):
        return {key: altered(entry, name, change, inside or name in (key, ALL)) for key, entry in value.items()}
    if isinstance(value, list):
        return [altered(entry, name, change, inside) for entry in value]
    return change(value) if inside and isinstance(value, int | float) else value


def turns(judge: Callable[[Results], Any], results: Results, tried: Iterable[str]) -> str:
    """The first of some names of which other numbers bring another judgement, and no error; else none."""
    before = judge(results)
    for name in dict.fromkeys(tried):
        for change in CHANGES:
            try:
                after = judge(altered(results, name, change))
            except (ArithmeticError, LookupError, TypeError, ValueError):
                continue  # no such results could be: another number of this name is tried
            if after not in (before, Verdict.ERROR):
                return name
    return ""


def results_of(paper: Paper, function: Callable[[Results], Any], fresh_run: Outcome) -> Results:
    """The results that a function of a paper reads, by their short names."""
    computed = {name.removeprefix(f"{paper.key}."): value for name, value in fresh_run.results_by_experiment.items()}
    read = Read(computed)
    function(read)
    return dict(read)


@pytest.mark.parametrize("key", papers.KEYS)
def test_each_claim_and_each_proof_reads_all_that_it_rests_on(key: str, fresh_run: Outcome) -> None:
    (paper,) = papers.load([key])
    functions = {claim.id: claim.answer for claim in paper.claims}
    proofs = {erratum.id: erratum.prove for erratum in paper.errata}
    for entries, wanted in ((functions, READS[key]), (proofs, READS["errata"][key])):
        read = {paper.short(name): sorted(results_of(paper, entry, fresh_run)) for name, entry in entries.items()}
        assert read == wanted


def judged(paper: Paper, claim: Claim) -> Callable[[Results], Verdict]:
    return lambda results: verdict(paper, claim, results, proof=True)


@pytest.mark.parametrize("key", papers.KEYS)
def test_a_correction_counts_only_with_its_proof(key: str, fresh_run: Outcome) -> None:
    (paper,) = papers.load([key])
    for claim in (claim for claim in paper.claims if claim.erratum and claim.expected in AGREES):
        results = results_of(paper, claim.answer, fresh_run)
        assert verdict(paper, claim, results, proof=False) not in (*AGREES, Verdict.ERROR), claim.id


def proved(erratum: Erratum, results: Results) -> Callable[[Results], bool]:
    return lambda others: erratum.prove({**results, **others}).holds


@pytest.mark.parametrize("key", papers.KEYS)
def test_other_numbers_turn_each_verdict(key: str, fresh_run: Outcome) -> None:
    (paper,) = papers.load([key])
    kept = []
    for claim in (claim for claim in paper.claims if claim.kind is not Kind.CITED):
        results = results_of(paper, claim.answer, fresh_run)
        for tried in ([name] for name in DECISIVE[claim.id]) if claim.id in DECISIVE else [[ALL, *names(results)]]:
            if not turns(judged(paper, claim), results, tried):
                kept.append(claim.id)
    assert set(kept) == {name for name in (*BY_HAND, *ELSEWHERE) if name.startswith(f"{key}.")}, kept


@pytest.mark.parametrize("name", BY_HAND)
def test_what_agrees_or_is_told_in_words_turns_the_verdict(name: str, fresh_run: Outcome) -> None:
    (paper,) = papers.load([name.partition(".")[0]])
    (claim,) = (claim for claim in paper.claims if claim.id == name)
    results = copy.deepcopy(results_of(paper, claim.answer, fresh_run))
    assert judged(paper, claim)(results) is claim.expected
    BY_HAND[name](results)
    assert judged(paper, claim)(results) not in (claim.expected, Verdict.ERROR)


@pytest.mark.parametrize("key", papers.KEYS)
def test_other_results_of_each_experiment_refute_the_proof_of_an_erratum(key: str, fresh_run: Outcome) -> None:
    (paper,) = papers.load([key])
    for erratum in paper.errata:
        results = results_of(paper, erratum.prove, fresh_run)
        holds = proved(erratum, results)
        assert holds({})
        for use, result in results.items():
            if fault := PROOFS_BY_HAND.get((erratum.id, use)):
                faulty = copy.deepcopy(results)
                fault(faulty)
                assert not holds(faulty)
            elif (erratum.id, use) not in BESIDE:
                assert turns(holds, {use: result}, names(result)), (erratum.id, use)
