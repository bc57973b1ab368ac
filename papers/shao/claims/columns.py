"""Claims of Sec. V on Table I as a whole: its twelve numbers together under one reading, or each over a window."""

from __future__ import annotations

from collections.abc import Mapping

from papers.shao.experiments.readings import SEARCH, merged
from papers.shao.method.search import Near, chance, reading_of
from papers.shao.printed import DATA
from papers.shao.problem import COLUMNS, LABELS, READINGS
from replication.audit.declare import Part
from replication.audit.model import Evidence, Results
from replication.estimation.dualrate.response import Points

NOT_SEARCHED = "Not searched: delays, different discretisations of plant and observer, other parameters or gains."
WHOLE = Part("Table I as a whole, under one reading or over one window", figures=("readings", "decoys"))
PRINTED = "[{}]".format("; ".join(f"{row['DRC-PMI']} {row['DRC-APO']}" for row in DATA["table-1"].values()))
"""Both columns of numbers of Table I as one matrix."""
WHERE = {Points.BETWEEN: "at all times", Points.FAST: "at fast instants", Points.SLOW: "at slow instants"}


@WHOLE.matrix("table.any-reading", PRINTED, place="Table I", uses=SEARCH, reading="searched", pinned="differs")
def any_reading(results: Results) -> Evidence:
    """The two columns of numbers of Table I, DRC-PMI and DRC-APO, percent, together under one reading."""
    found = merged(results[name] for name in SEARCH)
    columns = (found.joint[name].values for name in COLUMNS)
    return Evidence(
        method=(
            "the nearest of the readings searched; distance is the largest |ln(computed/printed)| of the twelve numbers"
        ),
        cross_check="null test: the same search for smooth random columns; planted columns are found, in the tests",
        value=tuple(tuple(100 * value for value in row) for row in zip(*columns, strict=True)),
        quantities={
            "readings that give all twelve numbers": found.joint_hits,
            "readings that give a whole column": sum(found.hits.values()),
            "readings of DRC-PMI": found.tried["pmi"],
            "readings of DRC-APO": found.tried["apo"],
            "different to print within a structure, DRC-PMI": found.distinct["pmi"],
            "different to print within a structure, DRC-APO": found.distinct["apo"],
            "nearest common reading": found.joint_distance,
            "nearest for DRC-PMI alone": found.nearest["pmi"].distance,
            "nearest for DRC-APO alone": found.nearest["apo"].distance,
            "share as near among random columns and the printed, common": chance(
                found.joint_distance, found.joint_decoys
            ),
            "share as near among random columns and the printed, DRC-PMI": chance(
                found.nearest["pmi"].distance, found.decoys["pmi"]
            ),
            "share as near among random columns and the printed, DRC-APO": chance(
                found.nearest["apo"].distance, found.decoys["apo"]
            ),
        },
        note=(
            f"Nearest common reading, {nearness(found.joint)}. Nearest to one column alone, {nearness(found.nearest)}. "
            f"{NOT_SEARCHED}"
        ),
    )


@WHOLE.matrix("table.any-window", PRINTED, place="Table I", uses="windows", reading="window", pinned="differs")
def any_window(results: Results) -> Evidence:
    """The numbers of Table I, DRC-PMI and DRC-APO, percent, each by itself over a window of time that suits it."""
    found = results["windows"]
    cells = [cell for column in COLUMNS for cell in found[column]]
    hit = {length: sum(cell["hits"][length] > 0 for cell in cells) for length in ("long", "short")}
    return Evidence(
        method=(
            "largest errors in the lifted form over all windows of whole slow periods, from the printed x(0); of each "
            "cell the one nearest to its print"
        ),
        cross_check=(
            "the responses of the cells against a brute-force simulation of the printed algorithm, transients included"
        ),
        value=tuple(zip(*([cell["nearest"] for cell in found[column]] for column in COLUMNS), strict=True)),
        quantities={
            "windows of half a period or more tried, over all readings and starts": float(
                sum(cell["long"] for cell in cells)
            ),
            "printed numbers met over a window of half a period or more": float(hit["long"]),
            "printed numbers met over a shorter window": float(hit["short"]),
        },
        note=("Half a period of the reference holds the largest modulus of a sinusoid; a shorter window may miss it."),
    )


def nearness(near: Mapping[str, Near]) -> str:
    """For each column the choices of a reading, and its numbers in percent."""
    return "; ".join(f"DRC-{column.upper()}: {described(near[column])}" for column in COLUMNS)


def described(near: Near) -> str:
    """The choices of a reading, and its numbers in percent."""
    reading = reading_of(READINGS, near)
    window = "steady state"
    if reading.window is not None:
        window = f"slow periods {reading.window[0]} to {reading.window[1]} from ζ(0) = {reading.start}"
    numbers = ", ".join(f"{100 * value:.2f}" for value in near.values)
    choices = "{} feedforward, reference {}, {} gain, {} form".format(*reading.structure.words)
    return f"{LABELS[reading.observer]}, {choices}, error {WHERE[reading.points]}, {window}: {numbers}"
