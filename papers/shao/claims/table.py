"""Claims of Sec. V on Table I: its eighteen cells, the twelve numbers together, and what is concluded from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise, product
from typing import Any

from papers.shao.claims.comparison import unstable
from papers.shao.experiments.readings import SEARCH, merged
from papers.shao.method.search import chance
from papers.shao.printed import DATA
from papers.shao.problem import APO, APO_READINGS, COLUMNS, HELD, PMI, PMI_READINGS
from replication.audit.declare import Part, positive
from replication.audit.model import Evidence, Results

NOT_SEARCHED = "Not searched: delays, different discretisations of plant and observer, other parameters or gains."
LITERAL = "steady state by the lifted form, literal reading, supremum over all times"
TABLE = Part("Table I and what is concluded from it", figures="readings")


def cell(observer: str, index: int, results: Results) -> Evidence:
    """One entry of Table I in percent under the literal reading."""
    table = results["table"]
    return Evidence(
        method=LITERAL,
        cross_check=(
            "responses at this frequency against a brute-force simulation of the printed algorithm, transients "
            "included; the steady-state maximum against long simulations, in the tests"
        ),
        value=table["ratios"][observer][index],
        quantities={
            "corrected feedforward": table["corrected"][observer][index],
            "lifted against simulated, rad": table["agreement"][observer][index],
            **({"y held over M T": table["ratios"][HELD][index]} if observer == PMI else {}),
        },
        note="The manuscript leaves the simulation open, the time window too: see the map of readings.",
    )


for number, (reference, row) in enumerate(DATA["table-1"].items(), 1):
    TABLE.feasible(
        f"table.src-{number}",
        place=row["SRC"].place,
        statement=f"A dash: with the reference {reference} the single-rate loop has no bounded error.",
        uses="table",
    )(unstable)
    for column, observer in COLUMNS.items():
        TABLE.value(
            f"table.{column}-{number}",
            row[f"DRC-{column.upper()}"],
            statement=f"Largest tracking error of DRC-{column.upper()} over the amplitude of the reference, percent.",
            uses="table",
            pinned="differs",
        )(partial(cell, observer, number - 1))


@TABLE.feasible("table.any-reading", place="Table I", uses=SEARCH, pinned="differs")
def any_reading(results: Results) -> Evidence:
    """The twelve numbers of DRC-PMI and DRC-APO come out together, to print, under one of the readings."""
    found = merged(results[name] for name in SEARCH)
    return Evidence(
        method="search of all readings: distance is the largest |ln(computed/printed)| of the twelve numbers",
        cross_check="null test: the same search for smooth random columns; planted columns are found, in the tests",
        holds=found.joint_hits > 0,
        margin=None if found.joint_hits > 0 else -found.joint_distance,
        quantities={
            "readings of DRC-PMI": found.tried["pmi"],
            "readings of DRC-APO": found.tried["apo"],
            "different to print within a structure, DRC-PMI": found.distinct["pmi"],
            "different to print within a structure, DRC-APO": found.distinct["apo"],
            "nearest common reading": found.joint_distance,
            "nearest for DRC-PMI alone": found.nearest["pmi"].distance,
            "nearest for DRC-APO alone": found.nearest["apo"].distance,
            "share of columns as near, common": chance(found.joint_distance, found.joint_decoys),
            "share of columns as near, DRC-PMI": chance(found.nearest["pmi"].distance, found.decoys["pmi"]),
            "share of columns as near, DRC-APO": chance(found.nearest["apo"].distance, found.decoys["apo"]),
            "hits of one column": sum(found.hits.values()),
        },
        note=f"They come out under {found.joint_hits} of the readings searched. {NOT_SEARCHED}",
    )


@TABLE.order("order.apo-below-pmi", place="Table I", uses=("table", "orderings"))
def smaller_error(results: Results) -> Evidence:
    """DRC-APO has a smaller error than DRC-PMI at every frequency."""
    table = results["table"]
    ratios, shares = table["ratios"], weak_gain_shares(table)
    wins, pairs = ordering_counts(results["orderings"])
    return positive(
        min(1 - a / p for a, p in zip(ratios[APO], ratios[PMI], strict=True)),
        method=LITERAL,
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
    readings = stable_columns(results["orderings"], PMI_READINGS if observer == PMI else APO_READINGS)
    return positive(
        min(later / earlier - 1 for earlier, later in pairwise(results["table"]["ratios"][observer])),
        method=LITERAL,
        quantities={
            "readings": len(readings),
            "readings in which it holds": sum(all(a < b for a, b in pairwise(column)) for column in readings),
        },
    )


for column, observer in COLUMNS.items():
    TABLE.order(
        f"order.growth-{column}",
        place="Table I",
        statement=f"The error of DRC-{column.upper()} grows with the frequency.",
        uses=("table", "orderings"),
    )(partial(growing, observer))


def stable_columns(structures: Sequence[Mapping[str, Any]], observers: Sequence[str]) -> list[list[float]]:
    """The columns that the stable loops of these observers give, in percent."""
    found = (entry["ratios"][name] for entry in structures for name in observers)
    return [column for column in found if column is not None]


def ordering_counts(structures: Sequence[Mapping[str, Any]]) -> tuple[int, int]:
    """(pairs in which APO is below PMI in every row, pairs of stable readings)."""
    pairs = [
        pair
        for entry in structures
        for pair in product(stable_columns([entry], PMI_READINGS), stable_columns([entry], APO_READINGS))
    ]
    return sum(all(y < x for x, y in zip(pmi, apo, strict=True)) for pmi, apo in pairs), len(pairs)


def weak_gain_shares(table: Mapping[str, Any]) -> list[float]:
    """Per row, the part of the step from DRC-PMI to DRC-APO that DRC-PMI takes with L/M in place of L."""
    columns = table["ratios"][PMI], table["weak_gain"][PMI], table["ratios"][APO]
    return [(own - weak) / (own - apo) for own, weak, apo in zip(*columns, strict=True)]
