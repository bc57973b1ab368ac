"""Claims on Table I: its eighteen cells, and the twelve numbers together."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from papers.shao import data
from papers.shao.experiments import SEARCH
from papers.shao.method.search import chance
from papers.shao.problem import APO, HELD, PMI, SRC
from papers.shao.search import merged
from replication.audit.model import Claim, Evidence, Kind, Results, Verdict

NOT_SEARCHED = "Not searched: delays, different discretisations of plant and observer, other parameters or gains."
LITERAL = "steady state by the lifted form, literal reading, supremum over all times"


def unstable(results: Results) -> Evidence:
    """Radius of the single-rate loop above one."""
    radius = results["shao.table"]["radius"][SRC]
    return Evidence(
        method="monodromy radius over one slow period, which does not depend on the reference",
        cross_check="the textbook sampled-data loop at M T, in the tests",
        holds=radius > 1,
        margin=radius - 1,
        quantities={"radius": radius},
    )


def cell(observer: str, index: int, results: Results) -> Evidence:
    """One entry of Table I in percent under the literal reading."""
    table = results["shao.table"]
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


def any_reading(results: Results) -> Evidence:
    """Whether the search hit all twelve numbers, and how near it came."""
    found = merged([results[name] for name in SEARCH])
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


def _src_cell(index: int) -> Claim:
    return Claim(
        id=f"shao.table.src-{index + 1}",
        place=f"Table I, {data.REFERENCES[index]}, SRC",
        kind=Kind.FEASIBLE,
        statement=f"A dash: with the reference {data.REFERENCES[index]} the single-rate loop has no bounded error.",
        expected=Verdict.CONSISTENT,
        answer=unstable,
        uses=("shao.table",),
    )


def _value_cell(observer: str, short: str, printed: Sequence[str], index: int) -> Claim:
    return Claim(
        id=f"shao.table.{short}-{index + 1}",
        place=f"Table I, {data.REFERENCES[index]}, DRC-{short.upper()}",
        kind=Kind.VALUE,
        statement=f"Largest tracking error of DRC-{short.upper()} over the amplitude of the reference, percent.",
        expected=Verdict.DIFFERS,
        answer=partial(cell, observer, index),
        uses=("shao.table",),
        printed=printed[index],
    )


ROWS = range(len(data.FREQUENCIES))
TABLE_CELLS = (
    *(_src_cell(index) for index in ROWS),
    *(_value_cell(PMI, "pmi", data.TABLE_PMI, index) for index in ROWS),
    *(_value_cell(APO, "apo", data.TABLE_APO, index) for index in ROWS),
)
ANY_READING = Claim(
    id="shao.table.any-reading",
    place="Table I",
    kind=Kind.FEASIBLE,
    statement="The twelve numbers of DRC-PMI and DRC-APO come out together, to print, under one of the readings.",
    expected=Verdict.DIFFERS,
    answer=any_reading,
    uses=SEARCH,
)
