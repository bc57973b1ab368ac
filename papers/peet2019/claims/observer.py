"""Sec. IX and closed loops: the observer that the gains yield, discretised and against its guaranteed level."""

from __future__ import annotations

from functools import partial

from papers.peet2019.claims.gains import optimum_of
from papers.peet2019.claims.theory import CORRECTED, SIGNS, unmet
from papers.peet2019.experiments.declared import ABOVE, NEAR
from papers.peet2019.printed import DATA, EXAMPLES
from papers.peet2019.readings import ACCURATE, HOUSE
from replication.audit.declare import Part, below
from replication.audit.judge.numerals import at_most
from replication.audit.model import Evidence, Outcome, Results, SolverRecord
from replication.verify.predicate import Predicate, Term, term

IMPLEMENTATION = Part("Sec. IX-B")
CLOSED_LOOPS = Part("Secs. I and X: closed loops", figures="gains", reading=HOUSE)
REMARKS = Part(
    "Sec. IX-A, and characteristics 1, 3, 5 and 6 of Sec. I",
    reason="That the conditions are LMIs and certified by a Lyapunov functional is how the method is built, through "
    "the "
    "cone of Part 1. The text gives no number for reliable or efficient computation, and its code is no part of it.",
)
LUMPED = tuple(f"lumped.ex{name}" for name in EXAMPLES)


def lumped_error(example: str, results: Results) -> float:
    """Relative error of the H∞ norm of an example's closed loop with the printed number of lumped states."""
    found = results[f"lumped.ex{example}"]
    return float(dict(zip(found["states"], found["relative"], strict=True))[DATA["lumped-states"]])


def _over_the_unseen(example: str, results: Results) -> float:
    """How far the norm of a closed loop lies above the gain from w₁, which no observer changes, relative to it."""
    return float(results[f"lumped.ex{example}"]["collocation"] / optimum_of(example, results) - 1.0)


@IMPLEMENTATION.order(
    "observer.lumped-states",
    place="Sec. IX-B",
    pinned="undetermined",
    uses=(*LUMPED, "reference.ex2", "reference.ex3", "fig1"),
    reading="lumps-1-percent",
)
def lumped_states(results: Results) -> Evidence:
    """Twenty lumped states are typically more than enough for accurate results."""
    errors = {example: lumped_error(example, results) for example in EXAMPLES}
    worst = max(map(abs, errors.values()))
    unseen = {name: _over_the_unseen(name, results) for name in ("2", "3")}
    sinc = results["fig1"]["lumped"] / results["fig1"]["gain"] - 1.0
    return below(
        worst,
        ACCURATE["lumps-1-percent"],
        "The paper calls the results accurate and gives no number: one part in a hundred.",
        method=(
            "H∞ norms of the closed loops of Examples 1-3, the histories of plant and observer by forward difference, "
            f"{DATA['lumped-states']} states per delay, and by Chebyshev collocation."
        ),
        quantities={
            **{f"relative error, Example {example}": error for example, error in errors.items()},
            **{
                f"relative error, Example 2, {count} states": relative
                for count, relative in zip(
                    results["lumped.ex2"]["states"], results["lumped.ex2"]["relative"], strict=True
                )
            },
            **{f"norm over the gain from w₁, relative excess, Example {name}": gap for name, gap in unseen.items()},
            "relative error of the simulated gain, Example 2, sinc(t - τ)": sinc,
        },
        outcomes=tuple(
            Outcome(reading=name, holds=worst < allowed, margin=allowed - worst) for name, allowed in ACCURATE.items()
        ),
        note=(
            "The text does not say how accurate is accurate, nor for which systems, nor whether N is the number per "
            "delay. In Examples 2 and 3 the gain from w₁ to x₁ is that of the plant, whatever the observer; the norm "
            f"of the loops here is that gain to a relative {at_most(max(map(abs, unseen.values())), 1)}, so that its "
            "error is that of the lumped plant."
        ),
    )


NOT_SEEN = (
    "Here the gain from the first disturbance is the same for every observer, since y does not see x₁; that from the "
    "second, and stability, depend on it."
)
OF_ITS_OWN = "The theorem is about the observer of its own storage, not the one {}."


def closed_loop(name: str, results: Results) -> Evidence:
    """H∞ norm of the closed loop of returned gains against the level of the certificate."""
    found = results[f"loop.{name}"]
    norm = found["norms"][-1]
    return Evidence(
        method=(
            "H∞ norm of plant and observer, gains of Lemma 5 as corrected, collocated at "
            f"{found['orders'][-1]} points per history, by the Hamiltonian test."
        ),
        cross_check=(
            f"At {found['orders'][0]} points: {found['norms'][0]:.8f}. The norm is {norm / found['optimum']:.8f} times "
            "the optimum by the Riccati equation."
        ),
        holds=norm <= found["level"] and found["abscissa"] < 0.0,
        margin=found["level"] - norm if found["abscissa"] < 0.0 else -found["abscissa"],
        quantities={
            "norm": norm,
            "level of the certificate": found["level"],
            "optimum": found["optimum"],
            "spectral abscissa [1/s]": found["abscissa"],
            "least eigenvalue of 𝒫": found["storage"],
            "largest eigenvalue of the dissipation form": found["dissipation"],
        },
        solvers=(SolverRecord(**found["solver"]),),
        note=OF_ITS_OWN.format("collocated here") + (f" {NOT_SEEN}" if name == "ex2" else ""),
        as_printed=unmet(results),
    )


def over_the_least(plant: str, degree: int) -> Term:
    """The gain of an observer by Theorem 3 at a degree over the least of any observer."""
    return term("gain over the least", plant, "observers by Theorem 3", degree=degree)


for _name, _what, _factor, _degree in (
    ("ex1", "Example 1", ABOVE, 3),
    ("ex2", "Example 2", NEAR, 2),
):
    CLOSED_LOOPS.feasible(
        f"loop.{_name}",
        place="Secs. I and X",
        statement=(
            f"{_what}: some observer by Theorem 3, degree {_degree}, rejects disturbances as its bound predicts, with "
            f"a gain at most {_factor} times the least."
        ),
        pinned=CORRECTED,
        erratum=SIGNS,
        uses=(f"loop.{_name}", "printed-signs"),
        says=Predicate(of=over_the_least(_name, _degree), relation="at most", to=str(_factor)),
    )(partial(closed_loop, _name))
