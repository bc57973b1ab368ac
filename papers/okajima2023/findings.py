"""What a reader of the paper must know, in sentences made from the numbers of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from papers.okajima2023.cases import all_periods, pair
from papers.okajima2023.claims.levels import counterexamples
from papers.okajima2023.claims.unstable import RECOVERED
from papers.okajima2023.experiments.simulations import READINGS
from papers.okajima2023.printed import TABLE_1, bracketed
from replication.audit.model import Results


def findings(results: Results) -> tuple[str, ...]:
    """The findings, most important first."""
    return (
        *_table_1(results),
        f"Of {len(READINGS)} readings of eq. (34) only one makes the four simulated ratios possible: a denominator "
        "over d and both sensor noises. With d alone, as printed, each of them lies below every draw. An inference, "
        "from one draw each, and from our own gains where none are printed.",
        _recovered_plant(results[RECOVERED]),
        *_periods(results),
        _detectability(results["observable-not-detectable"]),
    )


def _table_1(results: Results) -> Iterator[str]:
    columns = {periods: results[pair(periods)] for periods in TABLE_1}
    wrong = {periods: printed for periods, printed in TABLE_1.items() if _rounded(columns[periods]) != printed}
    for periods, printed in wrong.items():
        yield (
            f"Table 1 prints {printed} for the periods {periods}; the optimum is {columns[periods]['optimum']:.6f} and "
            f"rounds to {_rounded(columns[periods])}. The least level that rounds to the print is "
            f"{_excess(columns[periods], printed):.3f} % above the optimum, where a solver that stops a little early "
            "would end (an inference)."
        )
    touching = sum(result["limited_by"] == "noncausal" for result in columns.values())
    yield (
        f"The other {len(columns) - len(wrong)} columns of Table 1 are reproduced. In {touching} of the "
        f"{len(columns)} columns not even a smoother, which knows all measurements, would do better; the optimal gains "
        "are then not unique."
    )


def _recovered_plant(recovery: Mapping[str, Any]) -> str:
    outputs, inputs = recovery["outputs"], recovery["inputs"]
    return (
        "Section IV-C repeats the stable plant's matrix. Its stated poles and gains fit one plant with small integers "
        f"in C, found by search: A with the diagonal {tuple(recovery['state']['fits'][0])}, C = "
        f"{bracketed(outputs['C'])}, B_d = {bracketed(inputs['B_d'])}, D = {bracketed(inputs['D'])} (an "
        "inference; only the ratio of B_d to D is identifiable)."
    )


def _periods(results: Results) -> Iterator[str]:
    found = counterexamples(all_periods(results), "synchronous")
    if found:
        excess, shorter, longer = found[0]
        yield (
            "A shorter period is not always better: with all sensors starting at instant 0, the periods "
            f"{tuple(shorter)} have an optimum {excess:.2g} above that of {tuple(longer)}."
        )


def _detectability(sampled: Mapping[str, Any]) -> str:
    return (
        "The standing assumption, (C, A) observable, does not ensure that stabilising gains exist. Two growing states "
        "that change places each instant, one of them measured every second instant, have an observability matrix of "
        f"rank {sampled['rank_every_instant']}; the sampled pair has one of rank {sampled['rank_sampled']}, and never "
        f"sees a mode that grows by {sampled['unseen_mode']:.3g} per period."
    )


def _rounded(result: Mapping[str, float]) -> str:
    """The optimum with the digits of Table 1."""
    return f"{result['optimum']:.2f}"


def _excess(result: Mapping[str, float], printed: str) -> float:
    """How far, in percent, the least value that rounds to the print lies above the optimum."""
    return 100 * ((float(printed) - 0.005) / result["optimum"] - 1)
