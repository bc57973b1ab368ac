"""Claims that compare loops: which are stable, what Figs. 2 and 3 show; Sec. I on fast sensors and bandwidth."""

from dataclasses import replace
from fractions import Fraction
from functools import partial

from papers._common import by_margin
from papers.shao import printed
from papers.shao.claims.table import TIED, UNSTABLE_SRC, none_gives_the_table, printed_forms, radius_of, stable
from papers.shao.printed import APO, ESTIMATES, FAST, INTERPOLATIONS, LABELS, LITERAL, PMI, RESTARTED, SINGLE, SLOWEST
from replication.audit.declare import Part, positive
from replication.audit.model import NO_READING, Evidence, Kind, Results
from replication.verify.predicate import Predicate, term

STABILITY = Part("Sec. V: stability of the three controllers", reading=NO_READING, figures="motor-eigenvalues")
RESPONSES = Part("Figs. 2 and 3", reading=LITERAL, figures=("fig2", "fig3", "robustness"))


RADIUS = "monodromy radius over one slow period, which depends neither on the reference nor on ζ(0)"
POLYNOMIAL = "simulated responses obey the characteristic polynomial of the monodromy matrix, in the tests"


@STABILITY.feasible("stability.src", place="Sec. V", says=UNSTABLE_SRC)
def unstable_single_rate(results: Results) -> Evidence:
    """The loop under SRC is unstable."""
    table = results["table"]
    radius = table["radius"]
    return by_margin(
        {reading: radius[observer] - 1 for reading, observer in printed.SINGLE_RATES.items()},
        method=RADIUS,
        cross_check=POLYNOMIAL,
        quantities={
            **{f"radius, {LABELS[observer]}": radius[observer] for observer in printed.SINGLE_RATES.values()},
            "radius, the state itself fed back at the slow instants": table["slow_feedback"],
        },
    )


@STABILITY.feasible(
    "stability.pmi",
    place="Sec. V, Figs. 2 and 3",
    reading=LITERAL,
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
        note="With u frozen over M T DRC-PMI is unstable; below (2) the text says that u is updated at each instant k "
        "T.",
    )


@STABILITY.feasible("stability.apo", place="Sec. V, Figs. 2 and 3", says=stable(APO))
def stable_predictive(results: Results) -> Evidence:
    """The loop under DRC-APO is stable."""
    radius = results["table"]["radius"][APO]
    return positive(1 - radius, method=RADIUS, cross_check=POLYNOMIAL, quantities={"radius": radius})


def better_estimate(sigma: float, results: Results) -> Evidence:
    """Estimation errors of the two observers at the frequency of a figure."""
    errors = results["table"]["estimation"]
    at = printed.FREQUENCIES.index(sigma)
    return by_margin(
        {reading: 1 - errors[APO][at] / errors[observer][at] for reading, observer in ESTIMATES.items()},
        method="largest |θ − θ̂| at the fast instants in the steady state, over the amplitude of the reference",
        quantities={f"{LABELS[name]}, percent": errors[name][at] for name in (APO, *ESTIMATES.values())},
        note="Judged in the steady state, and of the state the position alone, as in the caption of Fig. 2; how much "
        "better is not judged. With one correction per slow instant DRC-PMI estimates better. "
        f"{none_gives_the_table(results)}",
    )


for figure, sigma in printed.DATA["frequency"].items():
    RESPONSES.order(
        f"order.estimate-{figure}",
        place=f"Fig. {figure} and Sec. V",
        pinned="undetermined",
        statement=f"At σ = {sigma} rad/s DRC-APO estimates the position better than DRC-PMI.",
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
    reading=SLOWEST,
    pinned="undetermined",
    says=Predicate(of=radius_of(APO), relation="less than", to=radius_of(PMI)),
)
def better_transient(results: Results) -> Evidence:
    """DRC-APO has a better transient than DRC-PMI at the two frequencies of the figures."""
    constants, energy = results["transients"]["time_constants"], results["transients"]["energy"]
    gains = {
        choice: [1 - a / p for a, p in zip(*(energy[choice][n].values() for n in (APO, PMI)), strict=True)]
        for choice in printed.STARTS
    }
    apo, rivals = settling(results)
    return by_margin(
        {SLOWEST: constants[PMI] / constants[APO] - 1, **{choice: min(gain) for choice, gain in gains.items()}},
        method="slowest mode: time constant −M T/ln(monodromy radius). From a start: integral of the square of what "
        "the tracking error is apart from its steady state; the smaller gain of the two frequencies counts",
        cross_check="the integral against time responses less their steady state, in the tests",
        settled_by="the authors, if they state the start and the observer of DRC-PMI",
        quantities={
            **{
                f"time constant, {LABELS[name]}, s": constants[name]
                for name in (APO, PMI, printed.HELD, SINGLE, RESTARTED, FAST)
            },
            **{
                f"{LABELS[name]}, {choice}, σ = {sigma} rad/s, rad² s": value
                for choice in printed.STARTS
                for name in (APO, PMI, printed.HELD, SINGLE)
                for sigma, value in energy[choice][name].items()
            },
            "observers that DRC-PMI may be, stable loops": len(rivals),
            "observers that DRC-PMI may be, loops that settle faster than DRC-APO as printed": sum(
                rival < apo for rival in rivals
            ),
        },
        note="ζ(0) is not printed, and from a start the outcome hangs on it. The verdict compares with the slow "
        "observer of DRC-PMI; one correction per slow instant, which the text allows too, and y held, which it "
        "rules out, are told beside it, and the loops counted have the first two. By the slowest mode DRC-APO as "
        f"printed has a time constant of {constants[APO]:.1f} s, slow-observer DRC-PMI one of "
        f"{constants[PMI]:.1f} s. With the restarted predictor it is {constants[RESTARTED]:.1f} s, with a true "
        f"fast sensor {constants[FAST]:.1f} s: what is beyond comes from (6), with which L acts once in M periods. "
        "How much better is not judged.",
    )


def settling(results: Results) -> tuple[float, list[float]]:
    """Time constants in s of the literal DRC-APO and, from the fastest, of each stable DRC-PMI that the text allows.

    Over the observers that DRC-PMI may be, with L in continuous time; command and timing change no rate.
    """
    constants = {
        name: entry["time_constants"][name]
        for entry in printed_forms(results["orderings"])
        for name in printed.PMI_OPEN
    }
    return results["transients"]["time_constants"][APO], sorted(c for c in constants.values() if c is not None)


ABSTRACT = Part("Abstract", also=("order.bandwidth", "theory.stability", "order.apo-below-pmi", "order.estimate-2"))
INTRODUCTION = Part(
    "Sec. I: works like a loop with a fast sensor, higher bandwidth, mild conditions", figures="error-frequency"
)
ALIKE = 0.05
"""How far apart two loops may be that work alike; the text gives no measure."""


@INTRODUCTION.order(
    "theory.fast-sensor",
    place="Sec. I",
    reading=NO_READING,
    pinned="undetermined",
    says=Predicate(of=radius_of(APO), relation="at most", to=radius_of(FAST), reading=SLOWEST),
)
def like_a_fast_sensor(results: Results) -> Evidence:
    """With the virtual measurement the loop works like one with a sensor as fast as the actuator."""
    radius, ratios = results["table"]["radius"], results["table"]["ratios"]
    constants = results["transients"]["time_constants"]
    gaps, noise = results["theorem"]["rate_gap"], results["frequencies"]["noise"]
    bandwidth = results["frequencies"]["bandwidth"]
    predictors = {APO: "virtual measurement (6)", FAST: "true fast sensor", RESTARTED: "restarted predictor"}
    errors, widths = (
        [apo / fast for apo, fast in zip(measure[APO], measure[FAST], strict=True)] for measure in (ratios, bandwidth)
    )
    return by_margin(
        {
            SLOWEST: constants[FAST] / constants[APO] - 1 + TIED,
            "steady-errors": ALIKE - max(abs(ratio - 1) for ratio in errors),
            "bandwidths": ALIKE - max(abs(ratio - 1) for ratio in widths),
        },
        method="printed loop with (6) against that with a true measurement at every fast instant: time constant of the "
        "slowest mode, no larger; steady-state errors and bandwidths, apart by at most five per cent",
        cross_check="limit T → 0: distance of the rates to eig(A − LC/M) and to eig(A − LC)",
        quantities={
            **{f"radius, {words}": radius[name] for name, words in predictors.items()},
            **{f"time constant, {words}, s": constants[name] for name, words in predictors.items()},
            **{
                f"error against that of a fast sensor, {reference}": ratio
                for reference, ratio in zip(printed.REFERENCES, errors, strict=True)
            },
            **{
                f"bandwidth against that of a fast sensor, error {level:.1%}": ratio
                for level, ratio in zip(results["frequencies"]["levels"], widths, strict=True)
            },
            "rates to eig(A − LC/M), 1/s": gaps["printed"][-1],
            "rates to eig(A − LC), 1/s": gaps["printed_full_gain"][-1],
            **{f"noise gain, {words}": noise[name] for name, words in predictors.items()},
        },
        note="The text does not say in what the two loops are alike. In their bandwidths they are; the slowest mode "
        "is much slower, and the steady-state error differs by more than five per cent at the lowest frequency. "
        "The five per cent are ours; errors and bandwidths are with the command as printed, held over T.",
    )


@INTRODUCTION.order(
    "order.bandwidth",
    place="Abstract and Sec. V",
    reading=LITERAL,
    pinned="undetermined",
)
def higher_bandwidth(results: Results) -> Evidence:
    """DRC-APO has a higher bandwidth than DRC-PMI; how much higher, which the text calls much, is not judged."""
    levels, bandwidth = results["frequencies"]["levels"], results["frequencies"]["bandwidth"]
    family = {reading: observer for reading, observer in INTERPOLATIONS.items() if observer in bandwidth}
    return by_margin(
        {
            reading: min(a / p - 1 for a, p in zip(bandwidth[APO], bandwidth[observer], strict=True))
            for reading, observer in family.items()
        },
        method="first σ at which the steady-state error reaches 10 %, 29.3 % and 50 % of the amplitude, by root "
        "finding; the smallest of the three gains counts",
        quantities={
            f"{LABELS[name]}, error {level:.1%}, rad/s": sigma
            for name in (*family.values(), APO, RESTARTED, printed.STATE)
            for level, sigma in zip(levels, bandwidth[name], strict=True)
            if sigma is not None
        },
        note="The text defines no bandwidth; the three levels are ours. The outcome depends on the reading of DRC-PMI: "
        "with one correction per slow instant and then the model alone DRC-PMI has the higher bandwidth at "
        f"{sum(p > a for a, p in zip(bandwidth[APO], bandwidth[SINGLE], strict=True))} of them. "
        f"{none_gives_the_table(results)} Other timings of the reference are not compared.",
    )


@INTRODUCTION.claim(Kind.CITED, "theory.condition", place="Sec. I", reading=NO_READING)
def mild_conditions(results: Results) -> Evidence:
    """Under some mild conditions the state can converge to a bounded region."""
    motor = results["theorem"]["motor"]
    return Evidence(
        method="α₄ λ_max(P) T with spectral norms and P from its Lyapunov equation, for the printed example",
        quantities={"left side of (18), printed example": motor["condition"], "α₄, printed example": motor["alpha4"]},
        not_checkable="Sec. I does not name the conditions, and mild is no quantity. Those of Sec. IV are a claim of "
        "their own, and do not suffice. Nor is (18) necessary: the printed example does not meet it, which the "
        "manuscript does not claim, and its loop is stable.",
        settled_by="the authors, if they name the conditions",
    )
