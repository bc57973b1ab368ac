"""Claims of Sec. V on the three controllers: which loops are stable, and what Figs. 2 and 3 show."""

from __future__ import annotations

from functools import partial

from papers.shao.printed import DATA
from papers.shao.problem import APO, COLUMNS, FREQUENCIES, HELD, PMI, SINGLE, SRC
from replication.audit.declare import Part, positive
from replication.audit.model import Evidence, Results

STABILITY = Part("Sec. V: stability of the three controllers", figures="stable-sets")
RESPONSES = Part("Figs. 2 and 3", figures=("fig2", "fig3", "robustness"))


@STABILITY.feasible("stability.src", place="Sec. V", uses="table")
def unstable(results: Results) -> Evidence:
    """The loop under SRC is unstable."""
    radius = results["table"]["radius"][SRC]
    return positive(
        radius - 1,
        method="monodromy radius over one slow period, which does not depend on the reference",
        cross_check="the textbook sampled-data loop at M T, in the tests",
        quantities={"radius": radius},
    )


def stable(observer: str, results: Results) -> Evidence:
    """Radius of a dual-rate loop below one."""
    radius = results["table"]["radius"][observer]
    return positive(
        1 - radius,
        method="monodromy radius over one slow period, literal reading",
        cross_check="simulated responses obey the characteristic polynomial of the monodromy matrix, in the tests",
        quantities={"radius": radius},
    )


for column, observer in COLUMNS.items():
    STABILITY.feasible(
        f"stability.{column}",
        place="Sec. V, Figs. 2 and 3",
        statement=f"The loop under DRC-{column.upper()} is stable.",
        uses="table",
    )(partial(stable, observer))


def better_estimate(sigma: float, results: Results) -> Evidence:
    """Estimation errors of the two observers at the frequency of a figure."""
    found = results["table"]["estimation"]
    error = {name: found[name][FREQUENCIES.index(sigma)] for name in (APO, PMI, HELD, SINGLE)}
    return positive(
        1 - error[APO] / error[PMI],
        method="largest |θ − θ̂| at the fast instants in the steady state, literal reading",
        quantities={
            "DRC-APO, percent": error[APO],
            "DRC-PMI, percent": error[PMI],
            "DRC-PMI with y held, percent": error[HELD],
            "one correction and model, percent": error[SINGLE],
        },
        note="It depends on the reading of DRC-PMI: see the observer with one correction per slow instant.",
    )


for figure, sigma in DATA["frequency"].items():
    RESPONSES.order(
        f"order.estimate-{figure}",
        place=f"Fig. {figure} and Sec. V",
        statement=f"At σ = {sigma} rad/s DRC-APO estimates the position better than DRC-PMI.",
        uses="table",
    )(partial(better_estimate, float(sigma)))


@RESPONSES.order("order.transient", place="Sec. V", uses="transients", pinned="differs")
def better_transient(results: Results) -> Evidence:
    """DRC-APO has a much better transient than DRC-PMI."""
    constants = results["transients"]["time_constants"]
    return positive(
        constants[PMI] / constants[APO] - 1,
        method="time constant −M T/ln(monodromy radius) of the slowest mode, literal reading",
        quantities={f"{name}, s": value for name, value in constants.items()},
        note=(
            "The transient of DRC-APO dies out more slowly than that of every stable reading of DRC-PMI, because (6) "
            "uses L once in M periods."
        ),
    )
