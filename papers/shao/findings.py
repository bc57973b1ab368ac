"""What the audit establishes, as short sentences with numbers from its results; the report ranks by their order."""

from __future__ import annotations

from math import floor

from papers.shao.claims.columns import NOT_SEARCHED
from papers.shao.claims.comparison import slower_readings
from papers.shao.claims.orders import ordering_counts, printed_forms, weak_gain_shares
from papers.shao.experiments.readings import SEARCH, merged
from papers.shao.experiments.tracking import LOW_FREQUENCY
from papers.shao.printed import table_1
from papers.shao.problem import APO, COLUMNS, FAST, FREQUENCIES, PMI, RESTARTED, SRC, START
from replication.audit.judge.numerals import at_least, at_most, short
from replication.audit.model import Results


def findings(results: Results) -> tuple[str, ...]:
    """Theorem and its repair, Table I, comparisons that hang on what is open, mechanism, what was searched."""
    theorem, table, bounds = results["theorem"], results["table"], results["bounds"]
    constants, radius = results["transients"]["time_constants"], table["radius"]
    found, shares = merged(results[name] for name in SEARCH), weak_gain_shares(table)
    return (
        "The stability theorem is false: a scalar loop satisfies (18) for every T below "
        f"{_down(theorem['scalar']['allowed_period'])} s, and is unstable for each.",
        f"Table I does not come out: at its lowest frequency the literal reading gives {table['ratios'][APO][0]:.2f} % "
        f"under DRC-APO, printed {table_1('DRC-APO')[0]} %.",
        "Whether DRC-APO tracks better hangs on DRC-PMI and timing left open: with one correction per slow instant, "
        "reference held, DRC-PMI errs less throughout Table I.",
        f"Which transient is better hangs on the unprinted start of the observer: DRC-APO {_starts(results)}, against "
        "the literal DRC-PMI.",
        "The proof breaks at (15): the error of the virtual measurement is an estimation error, which does not vanish "
        "with T.",
        f"A predictor that carries on from the last measurement stabilises the counter-example: at T = "
        f"{theorem['scalar']['period']:g} s its monodromy radius is {theorem['radius'][RESTARTED]:.6f}.",
        f"As printed, the radius of the counter-example at T = {theorem['scalar']['period']:g} s is "
        f"{theorem['radius'][APO]:.6f}.",
        "In (14) the prediction error lacks modulus and factor t − t_k: where it is negative the printed bound can be "
        "negative just after t_k.",
        f"In {bounds['trials']} random loops the left sides of (12), (13) and the corrected (14) reach at most "
        f"{at_most(max(bounds['worst'][name] for name in ('12', '13', '14')))} of their bounds.",
        "The printed example does not meet (18), which the manuscript does not claim, and is stable: the left side of "
        f"(18) is {short(theorem['motor']['condition'], 2)}.",
        "The corrected feedforward, the error at fast instants alone, or both, give no number of Table I: literal "
        f"numbers move by at most {at_most(100 * _largest_move(results))}%.",
        f"{sum(found.hits.values()) or 'None'} of {sum(found.tried.values()):,} readings searched gives a whole column "
        "of numbers of Table I.",
        f"Only {sum(found.distinct.values()):,} of the readings searched differ to print within their structure: "
        "late windows, for one, show the steady state.",
        "The nearest reading of both columns is no evidence: "
        f"{sum(decoy <= found.joint_distance for decoy in found.joint_decoys)} of {len(found.joint_decoys)} smooth "
        "random pairs of columns have a reading as near.",
        NOT_SEARCHED,
        f"The time window is open too: over a whole run the largest error is at least {abs(START[0]):.0%} of the "
        "amplitude, its initial size.",
        _pairs(results),
        "By the slowest mode the literal DRC-APO settles slower than the literal DRC-PMI: time constants of "
        f"{constants[APO]:.1f} s and {constants[PMI]:.1f} s.",
        "The literal DRC-APO settles slower than {} of {} stable loops with DRC-PMI over kinds of gain and forms, "
        "also such as the text excludes.".format(*slower_readings(results)),
        "As T → 0 the estimation error follows A − LC/M, not A − LC: with (6) the gain acts once in M periods.",
        f"By the slowest mode DRC-APO does not act like a fast sensor: time constants of {constants[APO]:.1f} s and "
        f"{constants[FAST]:.1f} s.",
        *_against_a_fast_sensor(results),
        f"On the motor the restarted predictor has nearly the radius of a fast sensor: {radius[RESTARTED]:.5f} and "
        f"{radius[FAST]:.5f}.",
        f"DRC-PMI with the gain L/M obtains {at_least(100 * min(shares))}% to {at_most(100 * max(shares))}% of the "
        "error reduction from the literal DRC-PMI to DRC-APO at the frequencies of Table I.",
        f"At {LOW_FREQUENCY:g} rad/s, below the frequencies of Table I, the steady-state error of DRC-APO is "
        f"{1 - table['slow'][APO] / table['slow'][PMI]:.0%} smaller than that of the literal DRC-PMI.",
        f"SRC is unstable, as the manuscript says: the monodromy radius is {radius[SRC]:.3f}.",
    )


def _down(number: float) -> str:
    """To six decimals, rounded down."""
    return f"{floor(number * 1e6) / 1e6:.6f}"


def _starts(results: Results) -> str:
    """Which loop has the smaller integral of the squared transient at both frequencies of the figures, by start."""
    words = {"start-output": "the measured position", "start-zero": "zero"}
    energy = results["transients"]["energy"]
    told = []
    for choice, start in words.items():
        wins = {own < other for own, other in zip(*(energy[choice][n].values() for n in (APO, PMI)), strict=True)}
        outcome = "is mixed" if len(wins) > 1 else "wins" if wins == {True} else "loses"
        told.append(f"{outcome} from {start}")
    return ", ".join(told)


def _largest_move(results: Results) -> float:
    """How far a number of the literal reading moves under the other readings of the command and of the maximum."""
    table = results["table"]
    moves = (
        abs(value / literal - 1)
        for readings in table["readings"].values()
        for observer in COLUMNS.values()
        for value, literal in zip(readings[observer], table["ratios"][observer], strict=True)
    )
    return float(max(moves))


def _pairs(results: Results) -> str:
    counts = ordering_counts(printed_forms(results["orderings"]))
    return (
        "In the steady state, over the feedforwards, timings and DRC-PMIs left open, DRC-APO errs less throughout "
        f"Table I in {counts['holds']} of {sum(counts.values())} stable pairs."
    )


def _against_a_fast_sensor(results: Results) -> tuple[str, str]:
    ratios = results["table"]["ratios"]
    gaps = [own / fast - 1 for own, fast in zip(ratios[APO], ratios[FAST], strict=True)]
    upper = max(abs(gap) for gap, sigma in zip(gaps, FREQUENCIES, strict=True) if sigma >= FREQUENCIES[1])
    return (
        f"In the steady state the literal DRC-APO tracks nearly like a fast sensor: at Table I's frequencies "
        f"from {FREQUENCIES[1]:g} rad/s errors agree within {at_most(100 * upper)}%.",
        f"At {FREQUENCIES[0]:g} rad/s, the reference held, the steady-state error of DRC-APO is {abs(gaps[0]):.0%} "
        f"{'larger' if gaps[0] > 0 else 'smaller'} than with a fast sensor.",
    )
