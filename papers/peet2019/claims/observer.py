"""Sec. IX and closed loops: the observer that the gains yield, discretised and against its guaranteed level."""

from __future__ import annotations

from functools import partial

from papers.peet2019.printed import DATA
from replication.audit.declare import Part, below
from replication.audit.model import Evidence, Results, SolverRecord

ACCURATE = 0.01
"""A discretisation is taken as sufficient if the H∞ norm is within one part in a hundred."""

IMPLEMENTATION = Part("Sec. IX, implementation")
CLOSED_LOOPS = Part("Closed loops", figures="gains")


def lumped_error(results: Results) -> float:
    """Relative error of the H∞ norm of Example 2's closed loop with the printed number of lumped states."""
    found = results["lumped"]
    return float(dict(zip(found["states"], found["relative"], strict=True))[DATA["lumped-states"]])


@IMPLEMENTATION.order("observer.lumped-states", place="Sec. IX-B", pinned="differs", uses="lumped")
def lumped_states(results: Results) -> Evidence:
    """Twenty lumped states are enough for accurate results."""
    found = results["lumped"]
    return below(
        abs(lumped_error(results)),
        ACCURATE,
        "The paper calls the discretisation sufficient and gives no number: one part in a hundred.",
        method="H∞ norm of one closed loop (Example 2) by forward difference and by Chebyshev collocation.",
        quantities={
            f"relative error, {count} states": relative
            for count, relative in zip(found["states"], found["relative"], strict=True)
        },
        note="The text does not say how accurate is accurate; one part in a hundred is asked for here.",
    )


def closed_loop(name: str, results: Results) -> Evidence:
    """H∞ norm of the closed loop of returned gains against the level of the certificate."""
    found = results[f"loop.{name}"]
    norm = found["norms"][-1]
    return Evidence(
        method=(
            "H∞ norm of plant and observer of Lemma 5, collocated at "
            f"{found['orders'][-1]} points per history, by the Hamiltonian test."
        ),
        cross_check=f"At {found['orders'][0]} points: {found['norms'][0]:.8f}; no observer is below the optimum.",
        holds=norm <= found["level"],
        margin=found["level"] - norm,
        quantities={
            "norm": norm,
            "level of the certificate": found["level"],
            "optimum": found["optimum"],
            "spectral abscissa [1/s]": found["abscissa"],
            "least eigenvalue of 𝒫": found["storage"],
            "largest eigenvalue of the dissipation form": found["dissipation"],
        },
        solvers=(SolverRecord(**found["solver"]),),
    )


for _name, _what in (
    ("ex1", "Example 1"),
    ("ex2", "Example 2 at the level of Fig. 1"),
    ("own-1", "a system of ours with one delay, where the observer matters"),
    ("own-2", "a system of ours with two delays, where the observer matters"),
    ("own-3", "a system of ours with three delays, where the observer matters"),
):
    CLOSED_LOOPS.feasible(
        f"loop.{_name}",
        place="Sec. I and X",
        statement=f"The gains reject disturbances as the bound predicts: {_what}.",
        uses=f"loop.{_name}",
    )(partial(closed_loop, _name))
