"""Claims of Sec. V on the three controllers: which loops are stable, and what Figs. 2 and 3 show."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import partial

from papers.shao.claims.outcomes import by_margin
from papers.shao.printed import DATA
from papers.shao.problem import APO, FAST, FREQUENCIES, HELD, LABELS, PMI, PMI_READINGS, RESTARTED, SINGLE, SRC
from papers.shao.readings import ESTIMATES, INTERPOLATIONS, LITERAL, SLOWEST, STARTS
from replication.audit.declare import Part, positive
from replication.audit.model import NO_READING, Evidence, Results
from replication.verify.predicate import Predicate, Term, term

STABILITY = Part("Sec. V: stability of the three controllers", reading=NO_READING, figures="stable-sets")
RESPONSES = Part("Figs. 2 and 3", reading=LITERAL, figures=("fig2", "fig3", "robustness"))


def radius_of(observer: str) -> Term:
    """The spectral radius of a loop over a slow period."""
    return term("spectral radius over a slow period", "motor", observer=observer)


def stable(observer: str) -> Predicate:
    """That a loop is stable."""
    return Predicate(of=radius_of(observer), relation="less than", to="1")


@STABILITY.feasible(
    "stability.src",
    place="Sec. V",
    uses="table",
    says=Predicate(of=radius_of(SRC), relation="more than", to="1"),
)
def unstable(results: Results) -> Evidence:
    """The loop under SRC is unstable."""
    radius = results["table"]["radius"][SRC]
    return positive(
        radius - 1,
        method="monodromy radius over one slow period, which does not depend on the reference",
        cross_check="the textbook sampled-data loop at M T, in the tests",
        quantities={"radius": radius},
    )


RADIUS = "monodromy radius over one slow period, which depends neither on the reference nor on ζ(0)"
POLYNOMIAL = "simulated responses obey the characteristic polynomial of the monodromy matrix, in the tests"


@STABILITY.feasible(
    "stability.pmi",
    place="Sec. V, Figs. 2 and 3",
    uses="table",
    reading=LITERAL,
    pinned="undetermined",
    says=[replace(stable(observer), reading=reading) for reading, observer in INTERPOLATIONS.items()],
)
def stable_interpolation(results: Results) -> Evidence:
    """The loop under DRC-PMI is stable."""
    radius = results["table"]["radius"]
    return by_margin(
        {reading: 1 - radius[observer] for reading, observer in INTERPOLATIONS.items()},
        method=RADIUS,
        cross_check=POLYNOMIAL,
        quantities={f"radius, {LABELS[observer]}": radius[observer] for observer in INTERPOLATIONS.values()},
        note=(
            "That Table I has errors for DRC-PMI, and that the text calls SRC alone unstable, speaks against the "
            "reading under which it is unstable."
        ),
    )


@STABILITY.feasible("stability.apo", place="Sec. V, Figs. 2 and 3", uses="table", says=stable(APO))
def stable_virtual(results: Results) -> Evidence:
    """The loop under DRC-APO is stable."""
    radius = results["table"]["radius"][APO]
    return positive(1 - radius, method=RADIUS, cross_check=POLYNOMIAL, quantities={"radius": radius})


def better_estimate(sigma: float, results: Results) -> Evidence:
    """Estimation errors of the two observers at the frequency of a figure."""
    errors = results["table"]["estimation"]
    at = FREQUENCIES.index(sigma)
    return by_margin(
        {reading: 1 - errors[APO][at] / errors[observer][at] for reading, observer in ESTIMATES.items()},
        method="largest |θ − θ̂| at the fast instants in the steady state, over the amplitude of the reference",
        quantities={f"{LABELS[name]}, percent": errors[name][at] for name in (APO, *ESTIMATES.values())},
        note=(
            "Judged in the steady state, and of the state the position alone, as in the caption of Fig. 2; how much "
            "better is not judged. With one correction per slow instant DRC-PMI estimates better; with the slow input "
            "it is unstable and has no steady state."
        ),
    )


for figure, sigma in DATA["frequency"].items():
    RESPONSES.order(
        f"order.estimate-{figure}",
        place=f"Fig. {figure} and Sec. V",
        pinned="undetermined",
        statement=f"At σ = {sigma} rad/s DRC-APO estimates the position better than DRC-PMI.",
        uses="table",
        reading=next(iter(ESTIMATES)),
        says=[
            Predicate(
                of=term("better estimate", "motor", observer=APO, than=observer, frequency=str(Fraction(str(sigma)))),
                reading=reading,
            )
            for reading, observer in ESTIMATES.items()
        ],
    )(partial(better_estimate, float(sigma)))


@RESPONSES.order(
    "order.transient",
    place="Sec. V",
    uses=("transients", "orderings"),
    reading=SLOWEST,
    pinned="undetermined",
    says=Predicate(of=radius_of(APO), relation="less than", to=radius_of(PMI)),
)
def better_transient(results: Results) -> Evidence:
    """DRC-APO has a better transient than DRC-PMI at the two frequencies of the figures."""
    constants, energy = results["transients"]["time_constants"], results["transients"]["energy"]
    gains = {
        choice: [1 - own / other for own, other in zip(*(energy[choice][n].values() for n in (APO, PMI)), strict=True)]
        for choice in STARTS
    }
    slower, compared = slower_readings(results)
    return by_margin(
        {SLOWEST: constants[PMI] / constants[APO] - 1, **{choice: min(gain) for choice, gain in gains.items()}},
        method=(
            "slowest mode: time constant −M T/ln(monodromy radius). From a start: integral of the square of what the "
            "tracking error is apart from its steady state; the smaller gain of the two frequencies counts"
        ),
        cross_check="the integral against time responses less their steady state, in the tests",
        quantities={
            **{
                f"time constant, {LABELS[name]}, s": constants[name]
                for name in (APO, PMI, HELD, SINGLE, RESTARTED, FAST)
            },
            **{
                f"{LABELS[name]}, {choice}, σ = {sigma} rad/s, rad² s": value
                for choice in STARTS
                for name in (APO, PMI, HELD, SINGLE)
                for sigma, value in energy[choice][name].items()
            },
            "DRC-PMI over kinds of gain and forms of the observer, stable loops": compared,
            "DRC-PMI over kinds of gain and forms of the observer, loops faster than DRC-APO as printed": slower,
        },
        note=(
            "ζ(0) is not printed, and from a start the outcome hangs on it. By the slowest mode DRC-APO as printed has "
            f"a time constant of {constants[APO]:.1f} s, the literal DRC-PMI one of {constants[PMI]:.1f} s. With the "
            f"restarted predictor it is {constants[RESTARTED]:.1f} s, with a true fast sensor {constants[FAST]:.1f} s: "
            "what is beyond comes from (6), with which L acts once in M periods. Some loops counted have L as a "
            "discrete gain, or the current form, which the text excludes. How much better is not judged."
        ),
    )


def slower_readings(results: Results) -> tuple[int, int]:
    """(stable readings of DRC-PMI that settle faster than the literal DRC-APO, all stable ones).

    Over the kinds of gain and the forms of the observer; command and timing of the reference change no rate.
    """
    own = results["transients"]["time_constants"][APO]
    rates = {
        (*entry["structure"][2:], name): entry["time_constants"][name]
        for entry in results["orderings"]
        for name in PMI_READINGS
    }
    stable = [constant for constant in rates.values() if constant is not None]
    return sum(constant < own for constant in stable), len(stable)
