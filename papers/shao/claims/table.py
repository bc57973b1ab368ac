"""Claims of Sec. V on Table I: its eighteen cells."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from typing import Any

from papers.shao.claims.outcomes import by_value, unstable
from papers.shao.printed import DATA
from papers.shao.problem import COLUMNS, FREQUENCIES, SRC
from papers.shao.readings import INTERPOLATIONS, LITERAL, MEASURES, STARTS
from replication.audit.declare import Part, positive
from replication.audit.model import NO_READING, Evidence, Results
from replication.estimation.dualrate.response import Points
from replication.verify.predicate import Predicate, Term, term

STEADY = "steady state by the lifted form"
SIMULATED = (
    "literal responses at each frequency against a brute-force simulation of the printed algorithm, transients "
    "included; the steady-state maximum against long simulations, in the tests"
)
TABLE = Part("Table I", reading=LITERAL)


def unbounded(index: int, results: Results) -> Evidence:
    """The radius of SRC, and how much of its unstable mode each start excites."""
    radius, excited = results["table"]["radius"][SRC], results["transients"]["excited"]
    return positive(
        min(radius - 1, *(excited[choice][index] for choice in STARTS)),
        method=(
            "monodromy radius less one, and the share of the unstable mode in the offset from the periodic solution at "
            "t = 0 from three starts: the smallest of the four"
        ),
        cross_check="the growth of the response in the lifted form, in the tests",
        quantities={
            "radius": radius,
            **{f"share of the unstable mode, {choice}": excited[choice][index] for choice in STARTS},
        },
        note=(
            "The dash is not explained; the text says that the loop is unstable and for that reason not plotted. The "
            "same "
            "fact as in Sec. V. That the error of SRC is unbounded from each of three starts certificates prove."
        ),
    )


def family(column: str, table: Mapping[str, Any]) -> dict[str, list[float]]:
    """The columns that the readings of the command, of the maximum and, for DRC-PMI, of the observer give, percent."""
    found = {choice: table["readings"][choice][COLUMNS[column]] for choice in MEASURES}
    if column == "pmi":
        found |= {
            choice: table["ratios"][observer]
            for choice, observer in INTERPOLATIONS.items()
            if observer in table["ratios"]
        }
    return found


def cell(column: str, index: int, results: Results) -> Evidence:
    """One entry of Table I in percent under the literal reading."""
    table, observer, searched = results["table"], COLUMNS[column], results["windows"][column][index]
    return by_value(
        {choice: ratios[index] for choice, ratios in family(column, table).items()},
        method=STEADY,
        cross_check=SIMULATED,
        quantities={"lifted against simulated, rad": table["agreement"][observer][index]},
        note=(
            "The manuscript leaves the simulation open, the time window too. The number by itself is met under "
            f"{searched['hits']['long']} of {searched['long']:,} settings searched with a window of half a period or "
            f"more, and under {searched['hits']['short']} with a shorter one, which is no evidence. The readings "
            "listed are not all that were searched: whether a number by itself is met over some window of time, and "
            "whether all twelve are met under one reading, are claims of their own."
        ),
    )


MEASURED = {Points.BETWEEN: "all", Points.FAST: "fast"}


def error_under(column: str, reading: str, index: int) -> Term:
    """The largest tracking error of a cell under a reading of the command, of the maximum, or of the observer."""
    structure, points = MEASURES.get(reading, MEASURES[LITERAL])
    observer = INTERPOLATIONS.get(reading, COLUMNS[column]) if column == "pmi" else COLUMNS[column]
    return term(
        "largest tracking error",
        "motor",
        observer=observer,
        feedforward=structure.feedforward,
        instants=MEASURED[points],
        frequency=str(Fraction(FREQUENCIES[index])),
    )


READ: Mapping[str, tuple[str, ...]] = {"apo": tuple(MEASURES), "pmi": (*MEASURES, *list(INTERPOLATIONS)[1:-1])}
"""By column its readings; with u frozen over M T DRC-PMI is unstable and has no steady state."""


for number, (reference, row) in enumerate(DATA["table-1"].items(), 1):
    TABLE.feasible(
        f"table.src-{number}",
        place=row["SRC"].place,
        statement=f"A dash: with the reference {reference} SRC diverges.",
        uses=("table", "transients"),
        reading=NO_READING,
        says=unstable(SRC),
    )(partial(unbounded, number - 1))
    for column in COLUMNS:
        TABLE.value(
            f"table.{column}-{number}",
            row[f"DRC-{column.upper()}"],
            statement=f"Largest tracking error of DRC-{column.upper()} over the amplitude of the reference, percent.",
            uses=("table", "windows"),
            pinned="differs",
            says=[
                Predicate(
                    of=error_under(column, one, number - 1),
                    relation="is",
                    to=str(row[f"DRC-{column.upper()}"]),
                    reading=one,
                )
                for one in READ[column]
            ],
        )(partial(cell, column, number - 1))
