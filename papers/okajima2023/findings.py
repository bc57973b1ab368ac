"""What a reader of the paper must know, in sentences made from the numbers of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from papers.okajima2023.claims.levels import counterexamples
from papers.okajima2023.claims.simulation import AS_PRINTED, G_SIM, all_draws
from papers.okajima2023.experiments.declared import all_periods, pair
from papers.okajima2023.printed import TABLE_1
from replication.audit.model import Results


def findings(results: Results) -> tuple[str, ...]:
    """The findings, most important first."""
    return (
        *_table_1(results),
        _simulated(all_draws(results)),
        _unstable(results["unstable.diagonals"]["found"]),
        *_periods(results),
        _timing(results["timing-draws"]),
    )


def _table_1(results: Results) -> Iterator[str]:
    columns = {periods: results[pair(periods)] for periods in TABLE_1}
    wrong = {periods: printed for periods, printed in TABLE_1.items() if _rounded(columns[periods]) != printed}
    for periods, printed in wrong.items():
        yield (
            f"One entry of Table 1, periods {periods}, is not the rounded optimum, which is "
            f"{_below(columns[periods], printed):.2f} % below the printed {printed}."
        )
    touching = sum(result["limited_by"] == "noncausal" for result in columns.values())
    yield (
        f"The other {len(columns) - len(wrong)} columns of Table 1 are reproduced; in "
        f"{'all' if touching == len(columns) else touching} columns no estimator goes below the optimum, not even a "
        "smoother."
    )


def _simulated(found: Mapping[str, Any]) -> str:
    below = all(
        case["readings"][AS_PRINTED]["percentiles"]["0.0"] > G_SIM[name] for name, case in found["cases"].items()
    )
    place = f"lies below all {found['seeds']} draws" if below else f"lies not below {found['seeds']} draws"
    return (
        f"With eq. (34) as printed, each published ratio {place} (Cases A-C: our gains); adding both sensor noises "
        "makes each possible (inference)."
    )


def _unstable(diagonals: list[Mapping[str, Any]]) -> str:
    return (
        f"With Sec. IV-A's C, gains (42) fail for each of {len(diagonals)} diagonals of A with the stated poles, "
        "but not for every such A."
    )


def _periods(results: Results) -> Iterator[str]:
    found = counterexamples(all_periods(results), "synchronous")
    if found:
        _, shorter, longer = found[0]
        yield (
            f"Read as a rule, the sentence on shorter periods fails: {tuple(shorter)} has a larger optimum than "
            f"{tuple(longer)}, both sensors from instant 0."
        )


def _timing(found: Mapping[str, Any]) -> str:
    best = max(found["least"], key=found["least"].__getitem__)
    return (
        f"Simulations like Figs. 6-8 favour {best.replace('timing-', 'Case ')}: with the printed gains it has the "
        f"least error energy in {100 * found['least'][best]:.0f} % of {found['seeds']} draws."
    )


def _rounded(result: Mapping[str, float]) -> str:
    """The optimum with the digits of Table 1."""
    return f"{result['optimum']:.2f}"


def _below(result: Mapping[str, float], printed: str) -> float:
    """How far, in percent, the optimum lies below the print."""
    return 100 * (1 - result["optimum"] / float(printed))
