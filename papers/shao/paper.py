"""The audit of Shao, Yang, Li and Yi: its parts in the order of the manuscript, what leads its page, and its misprints.

Each misprint has the computation behind the correction.
"""

import math
from itertools import groupby
from math import floor
from typing import Any

import numpy as np

from papers._common import INPUTS, Told, common_levels, curve, dots, label, parts_of, signal, ticks
from papers.shao import printed
from papers.shao.claims import comparison, table, theory
from papers.shao.experiments import theorem, tracking
from papers.shao.experiments.tracking import PREDICTORS, SEARCH, merged
from papers.shao.figures import FIGURES
from papers.shao.printed import APO, COUNTEREXAMPLE, DATA, DESIGN
from replication.audit.brief import Curve, Draws, Sketch, Traces
from replication.audit.declare import ROUNDING, contrast, experiment, paper
from replication.audit.judge.numerals import at_most, short
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Proof, Results
from replication.audit.project import about


def feedforward_orders(text: str, results: Results) -> Proof:
    """The corrected feedforward is the inverse of the motor, the printed one is not."""
    gaps = results["motor"]["inverse_gap"]
    words = {form: {f"{form}: largest |P ȳ_d/y_d − 1|": gaps[form]} for form in ("corrected", "printed")}
    return contrast(text, words["corrected"], words["printed"])


def mechanical_speed(text: str, results: Results) -> Proof:
    """The power balance of the motor."""
    ideal, printed = results["motor"]["torque_constant"], float(DATA["torque_constant"])
    return Proof(
        holds=abs(ideal - printed) < ROUNDING, text=text, quantities={"1.5 p Ψ_f": ideal, "printed K_T": printed}
    )


def third_state(text: str, results: Results) -> Proof:
    """The third state by the printed A."""
    state = DESIGN.model.A
    return Proof(
        holds=bool(state[0, 1] == 1 and state[1, 2] == 1 and abs(state[0]).sum() == 1 and abs(state[1]).sum() == 1),
        text=text,
        quantities={"A(2,3)": float(state[1, 2])},
    )


def output_rate(text: str, results: Results) -> Proof:
    """The shapes of C and ẏ."""
    rows, columns = DESIGN.model.C.shape
    return Proof(
        holds=rows != columns,
        text=text.format(rows=rows, columns=columns),
        quantities={"rows of C": rows, "columns of C": columns},
    )


def prediction_error_term(text: str, results: Results) -> Proof:
    """(14) with |e_p| alone over a long period, and with t − t_k too."""
    worst, slow = results["bounds"]["worst"], results["bounds"]["slow"]
    return Proof(
        holds=slow["modulus"] > 1 >= max(worst["14"], slow["14"]),
        text=text,
        quantities={
            "slow loop, with |e_p|: left over right": slow["modulus"],
            "slow loop, with |e_p| and t − t_k: left over right": slow["14"],
            "with |e_p| and t − t_k: largest left over right": worst["14"],
        },
    )


PROOFS = {
    "feedforward-orders": feedforward_orders,
    "mechanical-speed": mechanical_speed,
    "third-state": third_state,
    "output-rate": output_rate,
    "prediction-error-term": prediction_error_term,
}
"""By the errata of told.toml."""


TOLD = Told.read(__file__, **{f"sigma_{figure}": sigma for figure, sigma in printed.DATA["frequency"].items()})
STEP_MS = 1000 * COUNTEREXAMPLE.period
STEP = 14
PERIOD = STEP * printed.DESIGN.ratio
_SLOW = range(14, 303, PERIOD)
_FAST = [x for x in range(14, 303, STEP) if x not in _SLOW]


def _virtual(x: float) -> float:
    """The model drifts away from the signal until the sensor measures again."""
    since = (x - 14) % PERIOD
    return signal(x) - 0.3 * since * math.cos(x / 40)


BRIEF = TOLD.brief(
    card="Between samples the observer is fed its own prediction, a virtual measurement, which at short periods "
    "corrects nothing. In the loop below the observer's gain then acts like "
    f"{short(COUNTEREXAMPLE.injection[0, 0])}/{COUNTEREXAMPLE.ratio}, too little for the plant. "
    "[Condition (18)](-theory.stability) misses this: the ratio of the two periods does not occur in it. The paper's "
    "motor loop is [stable](+stability.apo). We tried over a million combinations of settings, starts and time "
    "windows: [none](-table.any-reading) reproduces any whole column of tracking errors in Table I.",
    picture=Traces(
        figure="shao-counter-example",
        last=4.0,
        across="time_s",
        x="time (s); the output starts at 1, the estimate at 0",
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
        alt=f"A slow sensor measures at every {printed.DESIGN.ratio}th fast instant; a model fills in virtual "
        "measurements between, which drift away from the output.",
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


def facts(results: Results) -> dict[str, Any]:
    """The stability result, Table I, comparisons that depend on what is open, what the loop does, what was searched."""
    theorem, record = results["theorem"], results["table"]
    search = merged(results[name] for name in SEARCH)
    unstable = [int(M) for M, radius in theorem["scalar"]["radii"].items() if radius > 1.0]
    apo, pmi = comparison.settling(results)
    pairs = table.ordering_counts(table.printed_forms(results["orderings"]))
    gaps = [ours / fast - 1 for ours, fast in zip(record["ratios"][APO], record["ratios"][printed.FAST], strict=True)]
    moduli = results["eigenvalues"]["moduli"][APO]
    return {
        "allowed": floor(theorem["scalar"]["allowed_period"] * 1e5) / 1e5,
        "M": [min(unstable), max(unstable)],
        "longer": [results["longer"]["ratio"] - 1, results["longer"]["ratio"]],
        "first": [record["ratios"][APO][0], printed.table_1("DRC-APO")[0]],
        "starts": _starts(results),
        "condition": short(theorem["motor"]["condition"], 2),
        "exact": [record["ratios"][printed.STATE][row] for row in (0, -1)],
        "moved": at_most(100 * _largest_move(results)),
        "hits": sum(search.hits.values()) or "No",
        "distinct": sum(search.distinct.values()),
        "not_searched": table.NOT_SEARCHED,
        "start": abs(printed.START[0]),
        "pairs": sum(pairs.values()),
        "holds": pairs["holds"],
        "slower": "each" if pmi[-1] < apo else "not each" if pmi[0] < apo else "no",
        "others": pmi[-1],
        "fast": results["transients"]["time_constants"][printed.FAST],
        "own": apo,
        "frequencies": printed.FREQUENCIES,
        "upper": at_most(100 * max(map(abs, gaps[1:]))),
        "lowest": abs(gaps[0]),
        "larger": "larger" if gaps[0] > 0 else "smaller",
        "shares": [100 * end(table.weak_gain_shares(record)) for end in (min, max)],
        "ranges": sum(stable for stable, _ in groupby(row[0] < 1.0 for row in moduli)),
        "src": [record["radius"][observer] for observer in (printed.SRC, printed.SRC_SINGLE)],
    }


def _starts(results: Results) -> str:
    """Which loop has the smaller integral of the squared transient at both frequencies of the figures, by start."""
    words = {"start-output": "the measured position", "start-zero": "zero"}
    energy = results["transients"]["energy"]
    phrases = []
    for choice, start in words.items():
        pairs = zip(energy[choice][APO].values(), energy[choice][printed.PMI].values(), strict=True)
        wins = {apo < pmi for apo, pmi in pairs}
        outcome = "is mixed" if len(wins) > 1 else "wins" if wins == {True} else "loses"
        phrases.append(f"{outcome} from {start}")
    return " and ".join(phrases)


def _largest_move(results: Results) -> float:
    """How far a number of the literal reading moves under the other readings of the command and of the maximum."""
    moves = (
        abs(value / literal - 1)
        for readings in results["table"]["readings"].values()
        for choice in printed.MEASURES
        for value, literal in zip(readings[choice], readings[printed.LITERAL], strict=True)
    )
    return float(max(moves))


EXPERIMENTS = (
    experiment("common", tracking.on_common_plant, **INPUTS),
    experiment(
        "sensitivity", tracking.sensitivity, prints=tracking.PRINTS, pole_pairs=int(DATA["pole_pairs"]),
        period=float(DATA["period"]), ratio=int(DATA["ratio"]),
        cells=[
            {"observer": observer, "frequency": sigma, "claim": f"table.{column}-{index}"}
            for column, observer in printed.COLUMNS.items()
            for index, sigma in enumerate(printed.FREQUENCIES, 1)
        ],
    ),
    experiment("motor", theorem.motor_model, seed=1),
    experiment("eigenvalues", theorem.motor_eigenvalues, periods=np.geomspace(1e-3, 0.4, 200).tolist()),
    experiment("table", tracking.table, simulated_periods=60),
    experiment("orderings", tracking.orderings),
    experiment("windows", tracking.windows),
    experiment(
        "frequencies", tracking.frequency_sweep, frequencies=np.geomspace(0.05, 8.0, 40).tolist(),
        levels=[0.1, 1 - 0.5**0.5, 0.5],
    ),
    experiment("transients", tracking.transients, slow_periods=40, substeps=10),
    experiment("lags", tracking.lags, ratios=list(range(1, 11)), frequency=1e-3),
    experiment("robustness", tracking.robustness, factors=np.geomspace(0.5, 2.0, 49).tolist()),
    experiment("theorem", theorem.theorem, periods=list(theorem.PERIODS), ratios=[2, 3, 5, 8]),
    experiment("longer", theorem.longer_ratios, stable=5, unstable=2000, beyond=[1100, 1500, 2000, 3000, 5000]),
    experiment("divergence", theorem.divergence, ratio=2000, length=8.0, points=200),
    experiment("bounds", theorem.step_bounds, trials=400, seed=3),
    experiment("rates", theorem.slowest_rates, periods=np.geomspace(1e-4, 1.0, 41).tolist()),
    *(experiment(name, tracking.block, structure=index) for index, name in enumerate(SEARCH)),
)  # fmt: skip
"""Every experiment of this paper by its name, with its inputs."""

PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(*parts_of(theory, comparison, table)),
    experiments=EXPERIMENTS,
    errata=TOLD.errata(PROOFS),
    figures=TOLD.figures(FIGURES),
    findings=TOLD.findings(facts),
    brief=BRIEF,
    sensitivity=lambda results: sensitivities(results["sensitivity"]),
    common=lambda results: common_levels(
        "noise to position in closed loop",
        {sensor: [(e, e) for e in results["common"][name]] for name, sensor in PREDICTORS.items()},
    ),
)
