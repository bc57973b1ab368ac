"""Claims on the comparison of the three controllers: stability, order, growth, transient, bandwidth."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import Any

from papers.shao import data
from papers.shao.claims_table import LITERAL, unstable
from papers.shao.problem import APO, APO_READINGS, HELD, PMI, PMI_READINGS, REPAIRED, SINGLE, STATE
from replication.audit.model import Claim, Evidence, Kind, Results, Verdict


def stable(observer: str, results: Results) -> Evidence:
    """Radius of a dual-rate loop below one."""
    radius = results["shao.table"]["radius"][observer]
    return Evidence(
        method="monodromy radius over one slow period, literal reading",
        cross_check="simulated responses obey the characteristic polynomial of the monodromy matrix, in the tests",
        holds=radius < 1,
        margin=1 - radius,
        quantities={"radius": radius},
    )


def smaller_error(results: Results) -> Evidence:
    """APO below PMI in every row; how often over all pairs of readings is told beside it."""
    table = results["shao.table"]
    ratios = table["ratios"]
    margins = [1 - a / p for a, p in zip(ratios[APO], ratios[PMI], strict=True)]
    wins, pairs = ordering_counts(results["shao.orderings"])
    shares = weak_gain_shares(table)
    return Evidence(
        method=LITERAL,
        holds=min(margins) > 0,
        margin=min(margins),
        quantities={
            "pairs of readings": pairs,
            "pairs in which it holds": wins,
            "share of the reduction that DRC-PMI with L/M obtains, least": min(shares),
            "share of the reduction that DRC-PMI with L/M obtains, largest": max(shares),
            "DRC-PMI far below the loop's rates, percent": table["slow"][PMI],
            "DRC-APO far below the loop's rates, percent": table["slow"][APO],
        },
        note=(
            "It depends on the reading of DRC-PMI: one correction per slow instant and then the model alone has a "
            "smaller error than DRC-APO. The steady state is our choice of window: from the printed start a maximum "
            "over the whole time is half the amplitude at least. This is also the better static tracking of Sec. V."
        ),
    )


def growing(observer: str, results: Results) -> Evidence:
    """Whether each row of a column exceeds the one before it."""
    ratios = results["shao.table"]["ratios"][observer]
    steps = [later / earlier - 1 for earlier, later in pairwise(ratios)]
    columns = PMI_READINGS if observer == PMI else APO_READINGS
    found = [entry["ratios"][name] for entry in results["shao.orderings"] for name in columns]
    readings = [column for column in found if column is not None]
    return Evidence(
        method=LITERAL,
        holds=min(steps) > 0,
        margin=min(steps),
        quantities={
            "readings": len(readings),
            "readings in which it holds": sum(all(a < b for a, b in pairwise(column)) for column in readings),
        },
    )


def better_estimate(index: int, results: Results) -> Evidence:
    """Estimation errors of the two observers at the frequency of a figure."""
    errors = results["shao.table"]["estimation"]
    apo, pmi = errors[APO][index], errors[PMI][index]
    return Evidence(
        method="largest |θ − θ̂| at the fast instants in the steady state, literal reading",
        holds=apo < pmi,
        margin=1 - apo / pmi,
        quantities={
            "DRC-APO, percent": apo,
            "DRC-PMI, percent": pmi,
            "DRC-PMI with y held, percent": errors[HELD][index],
            "one correction and model, percent": errors[SINGLE][index],
        },
        note="It depends on the reading of DRC-PMI: see the observer with one correction per slow instant.",
    )


def better_transient(results: Results) -> Evidence:
    """Time constants of the two loops."""
    constants = results["shao.transients"]["time_constants"]
    return Evidence(
        method="time constant −M T/ln(monodromy radius) of the slowest mode, literal reading",
        holds=constants[APO] < constants[PMI],
        margin=constants[PMI] / constants[APO] - 1,
        quantities={f"{name}, s": value for name, value in constants.items()},
        note=(
            "The transient of DRC-APO dies out more slowly than that of every stable reading of DRC-PMI, because (6) "
            "uses L once in M periods."
        ),
    )


def higher_bandwidth(results: Results) -> Evidence:
    """First σ at which the error reaches 10 %, 29.3 % and 50 %."""
    found = results["shao.frequencies"]
    ratios = [a / p - 1 for a, p in zip(found["bandwidth"][APO], found["bandwidth"][PMI], strict=True)]
    quantities = {
        f"{name}, error {level:.1%}, rad/s": sigma
        for name in (PMI, APO, REPAIRED, STATE, HELD, SINGLE)
        for level, sigma in zip(found["levels"], found["bandwidth"][name], strict=True)
        if sigma is not None
    }
    return Evidence(
        method="first σ at which the steady-state error ratio reaches a level, refined by root finding",
        holds=min(ratios) > 0,
        margin=min(ratios),
        quantities=quantities,
        note="Holds for the literal DRC-PMI; one correction per slow instant and then the model reaches about as far.",
    )


def ordering_counts(structures: Sequence[dict[str, dict[str, list[float] | None]]]) -> tuple[int, int]:
    """(pairs in which APO is below PMI in every row, pairs of stable readings)."""
    pairs = [
        (entry["ratios"][p], entry["ratios"][a])
        for entry in structures
        for p in PMI_READINGS
        for a in APO_READINGS
        if entry["ratios"][p] is not None and entry["ratios"][a] is not None
    ]
    wins = sum(all(y < x for x, y in zip(pmi or (), apo or (), strict=True)) for pmi, apo in pairs)
    return wins, len(pairs)


def weak_gain_shares(table: dict[str, Any]) -> list[float]:
    """Per row, the part of the step from DRC-PMI to DRC-APO that DRC-PMI takes with L/M in place of L."""
    columns = table["ratios"][PMI], table["weak_gain"][PMI], table["ratios"][APO]
    return [(own - weak) / (own - apo) for own, weak, apo in zip(*columns, strict=True)]


COMPARISONS = (
    Claim(
        id="shao.stability.src",
        place="Sec. V",
        kind=Kind.FEASIBLE,
        statement="The loop under SRC is unstable.",
        expected=Verdict.CONSISTENT,
        answer=unstable,
        uses=("shao.table",),
    ),
    *(
        Claim(
            id=f"shao.stability.{short}",
            place="Sec. V, Figs. 2 and 3",
            kind=Kind.FEASIBLE,
            statement=f"The loop under DRC-{short.upper()} is stable.",
            expected=Verdict.CONSISTENT,
            answer=partial(stable, observer),
            uses=("shao.table",),
        )
        for short, observer in (("pmi", PMI), ("apo", APO))
    ),
    Claim(
        id="shao.order.apo-below-pmi",
        place="Table I",
        kind=Kind.ORDER,
        statement="DRC-APO has a smaller error than DRC-PMI at every frequency.",
        expected=Verdict.CONSISTENT,
        answer=smaller_error,
        uses=("shao.table", "shao.orderings"),
    ),
    *(
        Claim(
            id=f"shao.order.growth-{short}",
            place="Table I",
            kind=Kind.ORDER,
            statement=f"The error of DRC-{short.upper()} grows with the frequency.",
            expected=Verdict.CONSISTENT,
            answer=partial(growing, observer),
            uses=("shao.table", "shao.orderings"),
        )
        for short, observer in (("pmi", PMI), ("apo", APO))
    ),
    *(
        Claim(
            id=f"shao.order.estimate-{figure}",
            place=f"Fig. {figure} and Sec. V",
            kind=Kind.ORDER,
            statement=f"At σ = {data.FREQUENCIES[index]} rad/s DRC-APO estimates the position better than DRC-PMI.",
            expected=Verdict.CONSISTENT,
            answer=partial(better_estimate, index),
            uses=("shao.table",),
        )
        for figure, index in ((2, 0), (3, 2))
    ),
    Claim(
        id="shao.order.transient",
        place="Sec. V",
        kind=Kind.ORDER,
        statement="DRC-APO has a much better transient than DRC-PMI.",
        expected=Verdict.DIFFERS,
        answer=better_transient,
        uses=("shao.transients",),
    ),
    Claim(
        id="shao.order.bandwidth",
        place="Abstract and Sec. V",
        kind=Kind.ORDER,
        statement="DRC-APO has a higher bandwidth than DRC-PMI.",
        expected=Verdict.CONSISTENT,
        answer=higher_bandwidth,
        uses=("shao.frequencies",),
    ),
)
