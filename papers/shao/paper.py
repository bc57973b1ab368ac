"""The audit of Shao, Yang, Li and Yi: what it covers, in the order of the manuscript, and what it shows."""

from __future__ import annotations

import math
from itertools import groupby
from math import floor

from papers._common import Told, curve, dots, label, signal, ticks
from papers.shao import common
from papers.shao.claims.comparison import ABSTRACT, INTRODUCTION, RESPONSES, STABILITY, settling
from papers.shao.claims.orders import CONCLUDED, ordering_counts, weak_gain_shares
from papers.shao.claims.table import NOT_SEARCHED, TABLE, WHOLE, printed_forms
from papers.shao.claims.theory import MOTOR, OBSERVER, THEOREM
from papers.shao.errata import PROOFS
from papers.shao.experiments.declared import EXPERIMENTS
from papers.shao.experiments.tracking import SEARCH, merged
from papers.shao.figures import stability, tracking
from papers.shao.printed import (
    APO,
    COLUMNS,
    COUNTEREXAMPLE,
    DATA,
    DESIGN,
    FAST,
    FREQUENCIES,
    PMI,
    SRC,
    SRC_SINGLE,
    START,
    table_1,
)
from replication.audit.brief import Curve, Draws, Sketch, Traces
from replication.audit.declare import paper
from replication.audit.judge.numerals import at_most, short
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Results
from replication.audit.project import about

TOLD = Told.read(__file__, **{f"sigma_{figure}": sigma for figure, sigma in DATA["frequency"].items()})
STEP_MS = 1000 * COUNTEREXAMPLE.period
STEP = 14
PERIOD = STEP * DESIGN.ratio
_SLOW = range(14, 303, PERIOD)
_FAST = [x for x in range(14, 303, STEP) if x not in _SLOW]


def _virtual(x: float) -> float:
    """The model drifts away from the signal until the sensor measures again."""
    since = (x - 14) % PERIOD
    return signal(x) - 0.3 * since * math.cos(x / 40)


BRIEF = TOLD.brief(
    card="Virtual measurements correct nothing, only real samples do: in the loop below the observer's gain acts on "
    f"average like {short(COUNTEREXAMPLE.injection[0, 0])}/{COUNTEREXAMPLE.ratio}, too little for its plant. "
    "[Condition (18)](-theory.stability) puts no limit on M, the ratio of the sensor's period to the controller's. We "
    "tried over a million simulation settings: [none](-table.any-reading) reproduces even one whole column of "
    "tracking errors in Table I.",
    picture=Traces(
        figure="shao-counter-example",
        last=4.0,
        across="time_s",
        x="time (s); the output starts at 1",
        y="output of the loop",
        text=f"Our loop: ẋ = x + u with feedback {short(COUNTEREXAMPLE.feedback[0, 0])} and observer gain "
        f"{short(COUNTEREXAMPLE.injection[0, 0])}. Control acts each {STEP_MS:g} ms; a measurement arrives each "
        f"{COUNTEREXAMPLE.ratio * STEP_MS:g} ms. This loop meets every condition of Sec. IV.",
        curves=(
            Curve(label="with the paper's virtual measurement", columns=("alternating_predictive",)),
            Curve(label=f"with a real measurement every {STEP_MS:g} ms", columns=("fast_sensor",), quiet=True),
        ),
    ),
    sketch=Sketch(
        alt=f"A slow sensor measures at every {DESIGN.ratio}th fast instant; a model fills in virtual measurements "
        "between, which drift away from the output.",
        strokes=(
            curve(Draws.TRUTH),
            dots(Draws.VIRTUAL, _FAST, _virtual),
            dots(Draws.MEASURED, _SLOW),
            ticks(Draws.TICK, _FAST, 142),
            ticks(Draws.TICK_OURS, _SLOW, 142),
            label("measured", 8, 14, Draws.LABEL_OURS),
            label("virtual, from a model", 172, 14),
        ),
    ),
)


def findings(results: Results) -> tuple[str, ...]:
    """The stability result, Table I, comparisons that depend on what is open, what the loop does, what was searched."""
    theorem, table = results["theorem"], results["table"]
    constants, ratios = results["transients"]["time_constants"], results["table"]["ratios"]
    search, shares = merged(results[name] for name in SEARCH), weak_gain_shares(table)
    exact = table["innovation"]["1.0"]
    pairs = ordering_counts(printed_forms(results["orderings"]))
    unstable = [int(M) for M, radius in theorem["scalar"]["radii"].items() if radius > 1.0]
    return (
        "The stability result of Sec. IV is false: a scalar loop is unstable at every T that (18) admits, up to "
        f"{floor(theorem['scalar']['allowed_period'] * 1e5) / 1e5:.5f} s.",
        f"The same loop is unstable at each M tried from {min(unstable)} to {max(unstable)}: (18), which does not "
        "contain M, cannot suffice.",
        "Nor does (18) suffice with our restarted predictor: the loop is stable at "
        f"M = {results['longer']['ratio'] - 1} and unstable at M = {results['longer']['ratio']}.",
        f"We do not obtain Table I: at its lowest frequency DRC-APO errs by {ratios[APO][0]:.2f} % in the steady "
        f"state, and the table prints {table_1('DRC-APO')[0]} %.",
        "Whether DRC-APO tracks better depends on which DRC-PMI is meant: with one correction per slow instant DRC-PMI "
        "errs less throughout Table I.",
        "By integrated squared error against slow-observer DRC-PMI, the better transient depends on the unprinted "
        f"start: DRC-APO {_starts(results)}.",
        "The proof breaks at (15): the error of the virtual measurement is an estimation error, which does not vanish "
        "with T.",
        "In (14) the factor t − t_k is missing, and perhaps the bars of |e_p|, which our copy may have lost; with both "
        "(14) holds.",
        "The printed motor does not meet (18), nor does the text say so: the left side is "
        f"{short(theorem['motor']['condition'], 2)}.",
        f"If DRC-PMI knew the state at each measurement, its error would rise from {exact[0]:.2f} to {exact[-1]:.2f} % "
        "over Table I; the rest is the observer's.",
        "Neither the corrected feedforward nor errors at fast instants explain Table I: they move our numbers by at "
        f"most {at_most(100 * _largest_move(results))} %.",
        f"{sum(search.hits.values()) or 'No'} simulation setting searched gives a whole column of tracking errors in "
        f"Table I; at most {sum(search.distinct.values()):,} results differ from one another in print.",
        NOT_SEARCHED,
        "A maximum over the whole run is no explanation of Table I: the initial error alone is "
        f"{abs(START[0]):.0%} of the amplitude.",
        f"Of {sum(pairs.values())} stable combinations of feedforward and DRC-PMI that we count as open, DRC-APO has "
        f"the smaller error at every frequency in {pairs['holds']}.",
        _slowest(*settling(results)),
        f"A true fast sensor settles faster than DRC-APO: time constants of {constants[FAST]:.1f} s and "
        f"{constants[APO]:.1f} s.",
        *_against_a_fast_sensor(results),
        "At short periods the gain acts once in M of them: the estimation error follows A − LC/M, not A − LC.",
        f"Slow-observer DRC-PMI with the gain L/M gets {100 * min(shares):.0f} to {100 * max(shares):.0f} % of the "
        "reduction in error that DRC-APO brings.",
        "Sampling folds the fast mode of the motor: DRC-APO is stable for T in at least "
        f"{sum(stable for stable, _ in groupby(row[0] < 1.0 for row in results['eigenvalues']['moduli'][APO]))} "
        "separate ranges.",
        f"SRC is unstable, as the text says: in a slow period its dominant mode grows {table['radius'][SRC]:.2f}-fold "
        f"with observer (2), {table['radius'][SRC_SINGLE]:.2f}-fold with one correction.",
    )


def _slowest(own: float, others: list[float]) -> str:
    """How the slowest mode of DRC-APO compares with that of the DRC-PMI that decays slowest."""
    slower = "each" if others[-1] < own else "not each" if others[0] < own else "no"
    return (
        f"The slowest mode of DRC-APO decays more slowly than that of {slower} stable DRC-PMI: time constant "
        f"{own:.1f} s, against at most {others[-1]:.1f} s."
    )


def _starts(results: Results) -> str:
    """Which loop has the smaller integral of the squared transient at both frequencies of the figures, by start."""
    words = {"start-output": "the measured position", "start-zero": "zero"}
    energy = results["transients"]["energy"]
    told = []
    for choice, start in words.items():
        wins = {own < other for own, other in zip(*(energy[choice][n].values() for n in (APO, PMI)), strict=True)}
        outcome = "is mixed" if len(wins) > 1 else "wins" if wins == {True} else "loses"
        told.append(f"{outcome} from {start}")
    return " and ".join(told)


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


def _against_a_fast_sensor(results: Results) -> tuple[str, str]:
    ratios = results["table"]["ratios"]
    gaps = [own / fast - 1 for own, fast in zip(ratios[APO], ratios[FAST], strict=True)]
    upper = max(abs(gap) for gap, sigma in zip(gaps, FREQUENCIES, strict=True) if sigma >= FREQUENCIES[1])
    return (
        f"In the steady state DRC-APO tracks nearly as with a fast sensor: from {FREQUENCIES[1]:g} rad/s on errors "
        "agree "
        f"within {at_most(100 * upper)} %.",
        f"At {FREQUENCIES[0]:g} rad/s with a held reference, DRC-APO's steady-state error is {abs(gaps[0]):.0%} "
        f"{'larger' if gaps[0] > 0 else 'smaller'} than with a fast sensor.",
    )


PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(
        ABSTRACT,
        INTRODUCTION,
        OBSERVER,
        THEOREM,
        MOTOR,
        STABILITY,
        RESPONSES,
        TABLE,
        WHOLE,
        CONCLUDED,
    ),
    experiments=EXPERIMENTS,
    errata=TOLD.errata(PROOFS),
    figures=TOLD.figures({**tracking.FIGURES, **stability.FIGURES}),
    findings=findings,
    brief=BRIEF,
    sensitivity=lambda results: sensitivities(results["sensitivity"]),
    common=common.common,
)
