"""What the audit establishes, as sentences with numbers from its results."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from papers.shao.claims.table import NOT_SEARCHED, ordering_counts, weak_gain_shares
from papers.shao.experiments.readings import SEARCH, merged
from papers.shao.experiments.tracking import LOW_FREQUENCY
from papers.shao.method.search import Near, chance, reading_of
from papers.shao.problem import APO, FAST, FREQUENCIES, HELD, LABELS, PMI, READINGS, REPAIRED, SINGLE, SRC, START
from replication.audit.model import Results
from replication.estimation.dualrate.tracking import Points
from replication.verify.subjects import theorems

WHERE = {Points.BETWEEN: "at all times", Points.FAST: "at fast instants", Points.SLOW: "at slow instants"}


def findings(results: Results) -> tuple[str, ...]:
    """Theorem, mechanism, comparison, readings of Table I, in this order."""
    return (*_theory(results), *_mechanism(results), _comparison(results), *_readings(results))


def _theory(results: Results) -> tuple[str, ...]:
    theorem = results["theorem"]
    allowed, motor, bounds = theorem["scalar"]["allowed_period"], theorem["motor"], results["bounds"]
    proved = Fraction(theorems("shao")[0]["counterexample"].parameters["longest"])
    return (
        "The stability theorem is false as printed: for A = B = C = 1, K = −2, L = 2, M = 5 every period that (18) "
        f"allows (T below {allowed:.6f} s) gives an unstable loop, proved in exact arithmetic for all "
        f"T up to {float(proved):g} s. The step that fails is the inequality (15): the error of the virtual "
        f"measurement does not vanish with T. In {bounds['trials']} random loops the sides of (12), "
        f"(13) and (14) came to at most {max(bounds['worst'].values()):.2f} of their bounds.",
        f"The example is not covered by the theorem: the left side of (18) is {motor['condition']:.3g} and should be "
        "below one. The loop is stable all the same.",
    )


def _mechanism(results: Results) -> tuple[str, ...]:
    table = results["table"]
    radius, theorem = table["radius"], results["theorem"]["radius"]
    constants = results["transients"]["time_constants"]
    against_fast = [own / fast - 1 for own, fast in zip(table["ratios"][APO], table["ratios"][FAST], strict=True)]
    upper = max(abs(gap) for gap, sigma in zip(against_fast, FREQUENCIES, strict=True) if sigma >= 1)
    shares = weak_gain_shares(table)
    return (
        "The virtual measurement (6) does not act like a fast sensor in the transient: as T goes to zero the rates of "
        f"the estimation error tend to those of A − LC/M, and on the motor the time constant is {constants[APO]:.1f} s "
        f"against {constants[FAST]:.1f} s (monodromy radius {radius[APO]:.4f} against {radius[FAST]:.4f}). In the "
        f"steady state it nearly does: for σ ≥ 1 rad/s the errors agree within {upper:.1%}, at "
        f"{FREQUENCIES[0]:g} rad/s that of DRC-APO is {against_fast[0]:.0%} larger.",
        "A repaired predictor, which carries on from the last measurement, has the radius "
        f"{radius[REPAIRED]:.4f} on the motor and stabilises the counter-example ({theorem[REPAIRED]:.6f} against "
        f"{theorem[APO]:.6f}).",
        f"Most of the reduction of the error is obtained by DRC-PMI with the gain L/M: {min(shares):.0%} to "
        f"{max(shares):.0%} of the step from DRC-PMI to DRC-APO at the frequencies of Table I. Far below the rates of "
        f"the loops the advantage vanishes: at σ = {LOW_FREQUENCY:g} rad/s {table['slow'][APO]:.2f} % against "
        f"{table['slow'][PMI]:.2f} %.",
    )


def _comparison(results: Results) -> str:
    radius, constants = results["table"]["radius"], results["transients"]["time_constants"]
    wins, pairs = ordering_counts(results["orderings"])
    others = ", ".join(f"{constants[name]:.2f} s ({LABELS[name]})" for name in (PMI, HELD, SINGLE))
    return (
        f"SRC is unstable (radius {radius[SRC]:.3f}), DRC-PMI and DRC-APO are stable. In the literal reading DRC-APO "
        f"has the smaller error at all frequencies of Table I; it has in {wins} of {pairs} pairs of readings. Its "
        f"transient is slower than that of every stable DRC-PMI: time constant {constants[APO]:.2f} s against {others}."
    )


def _readings(results: Results) -> tuple[str, ...]:
    found = merged(results[name] for name in SEARCH)
    table = results["table"]["ratios"]
    literal, held = (
        ", ".join(f"{p:.2f}/{a:.2f}" for p, a in zip(table[name], table[APO], strict=True)) for name in (PMI, HELD)
    )
    share = chance(found.joint_distance, found.joint_decoys)
    return (
        f"Table I does not come out. Literal reading, DRC-PMI/DRC-APO in percent: {literal}; with y held over M T in "
        f"DRC-PMI: {held}. That is the steady state, which is a choice: a maximum over the whole run would be "
        f"{abs(START[0]):.0%} at least, since the error starts at {START[0]:g} rad.",
        f"{sum(found.tried.values()):,} readings of one column over {len(SEARCH)} structures were tried, of which "
        f"{sum(found.distinct.values()):,} differ to print within their structure, since late windows show the steady "
        f"state. All twelve numbers come out in {found.joint_hits} of them, the six of one column in "
        f"{sum(found.hits.values())}. {NOT_SEARCHED}",
        f"The nearest common reading is off by a factor of up to {np.exp(found.joint_distance):.2f}; pairs of random "
        f"smooth columns are met as nearly with a share of {share:.2f}, so no reading is singled out. "
        f"DRC-PMI: {_near(found.joint['pmi'])}. DRC-APO: {_near(found.joint['apo'])}.",
        f"Nearest to one column alone, off by up to {np.exp(found.nearest['pmi'].distance):.2f} and "
        f"{np.exp(found.nearest['apo'].distance):.2f}. DRC-PMI: {_near(found.nearest['pmi'])}. "
        f"DRC-APO: {_near(found.nearest['apo'])}.",
    )


def _near(near: Near) -> str:
    """The choices of a reading, and its numbers in percent."""
    reading = reading_of(READINGS, near)
    window = "steady state"
    if reading.window is not None:
        window = f"slow periods {reading.window[0]} to {reading.window[1]} from ζ(0) = {reading.start}"
    numbers = ", ".join(f"{100 * value:.2f}" for value in near.values)
    choices = "{} feedforward, reference {}, {} gain, {} form".format(*reading.structure.words)
    return f"{LABELS[reading.observer]}, {choices}, error {WHERE[reading.points]}, {window}: {numbers}"
