"""Claims of the abstract and of Sec. I: a loop like one with a fast sensor, higher bandwidth, mild conditions."""

from __future__ import annotations

from papers.shao.claims.outcomes import TIED, against_one_correction, by_margin, radius_of
from papers.shao.printed import REFERENCES
from papers.shao.problem import APO, FAST, LABELS, RESTARTED, SINGLE, STATE
from papers.shao.readings import INTERPOLATIONS, LITERAL, SLOWEST
from replication.audit.declare import Part
from replication.audit.model import NO_READING, Evidence, Kind, Results
from replication.verify.predicate import Predicate

ABSTRACT = Part("Abstract", also=("order.bandwidth", "theory.stability", "order.apo-below-pmi", "order.estimate-2"))
INTRODUCTION = Part(
    "Sec. I: works like a loop with a fast sensor, higher bandwidth, mild conditions", figures="error-frequency"
)
ALIKE = 0.05
"""How far apart two loops may be that work alike; the text gives no measure."""


@INTRODUCTION.order(
    "theory.fast-sensor",
    place="Sec. I",
    uses=("table", "theorem", "frequencies", "transients"),
    reading=SLOWEST,
    pinned="undetermined",
    says=Predicate(of=radius_of(APO), relation="at most", to=radius_of(FAST)),
)
def like_a_fast_sensor(results: Results) -> Evidence:
    """With the virtual measurement the loop works like one with a sensor as fast as the actuator."""
    radius, ratios = results["table"]["radius"], results["table"]["ratios"]
    constants = results["transients"]["time_constants"]
    gaps, noise = results["theorem"]["rate_gap"], results["frequencies"]["noise"]
    bandwidth = results["frequencies"]["bandwidth"]
    errors, widths = (
        [own / fast for own, fast in zip(found[APO], found[FAST], strict=True)] for found in (ratios, bandwidth)
    )
    return by_margin(
        {
            SLOWEST: constants[FAST] / constants[APO] - 1 + TIED,
            "steady-errors": ALIKE - max(abs(ratio - 1) for ratio in errors),
            "bandwidths": ALIKE - max(abs(ratio - 1) for ratio in widths),
        },
        method=(
            "printed loop with (6) against that with a true measurement at every fast instant: time constant of the "
            "slowest mode, no larger; steady-state errors and bandwidths, apart by at most five per cent"
        ),
        cross_check="limit T → 0: distance of the rates to eig(A − LC/M) and to eig(A − LC)",
        quantities={
            "radius, virtual measurement (6)": radius[APO],
            "radius, true fast sensor": radius[FAST],
            "radius, restarted predictor": radius[RESTARTED],
            "time constant, virtual measurement (6), s": constants[APO],
            "time constant, true fast sensor, s": constants[FAST],
            **{
                f"error against that of a fast sensor, {reference}": ratio
                for reference, ratio in zip(REFERENCES, errors, strict=True)
            },
            **{
                f"bandwidth against that of a fast sensor, error {level:.1%}": ratio
                for level, ratio in zip(results["frequencies"]["levels"], widths, strict=True)
            },
            "rates to eig(A − LC/M), 1/s": gaps["printed"][-1],
            "rates to eig(A − LC), 1/s": gaps["printed_full_gain"][-1],
            "noise gain, virtual measurement (6)": noise[APO],
            "noise gain, true fast sensor": noise[FAST],
            "noise gain, restarted predictor": noise[RESTARTED],
        },
        note=(
            "The text does not say in what the two loops are alike. In their bandwidths they are; the slowest mode "
            "is much slower, and the steady-state error differs by more than five per cent at the lowest frequency. "
            "The five per cent are ours; errors and bandwidths are with the reference held, as in the literal reading."
        ),
    )


@INTRODUCTION.order(
    "order.bandwidth",
    place="Abstract and Sec. V",
    uses=("frequencies", "table"),
    reading=LITERAL,
    pinned="undetermined",
)
def higher_bandwidth(results: Results) -> Evidence:
    """DRC-APO has a higher bandwidth than DRC-PMI."""
    levels, bandwidth = results["frequencies"]["levels"], results["frequencies"]["bandwidth"]
    family = {reading: observer for reading, observer in INTERPOLATIONS.items() if observer in bandwidth}
    return by_margin(
        {
            reading: min(a / p - 1 for a, p in zip(bandwidth[APO], bandwidth[observer], strict=True))
            for reading, observer in family.items()
        },
        method=(
            "first σ at which the steady-state error reaches 10 %, 29.3 % and 50 % of the amplitude, by root finding; "
            "the smallest of the three gains counts"
        ),
        quantities={
            f"{LABELS[name]}, error {level:.1%}, rad/s": sigma
            for name in (*family.values(), APO, RESTARTED, STATE)
            for level, sigma in zip(levels, bandwidth[name], strict=True)
            if sigma is not None
        },
        note=(
            "The text defines no bandwidth; the three levels are ours. The outcome depends on the reading of DRC-PMI: "
            "with one correction per slow instant and then the model alone DRC-PMI has the higher bandwidth at "
            f"{sum(p > a for a, p in zip(bandwidth[APO], bandwidth[SINGLE], strict=True))} of them, the rest literal. "
            f"{against_one_correction(results)} Other timings of the reference are not compared. How much higher is "
            "not judged."
        ),
    )


@INTRODUCTION.claim(Kind.CITED, "theory.condition", place="Sec. I", uses="theorem", reading=NO_READING)
def mild_conditions(results: Results) -> Evidence:
    """Under some mild conditions the state converges to a bounded region."""
    motor = results["theorem"]["motor"]
    return Evidence(
        method="α₄ λ_max(P) T with spectral norms and P from its Lyapunov equation, for the printed example",
        quantities={"left side of (18), printed example": motor["condition"], "α₄, printed example": motor["alpha4"]},
        not_checkable=(
            "Sec. I does not name the conditions, and mild is no quantity. Those of Sec. IV are a claim of their own, "
            "and do not suffice. Nor is (18) necessary: the printed example does not meet it, which the manuscript "
            "does not claim, and its loop is stable."
        ),
    )
