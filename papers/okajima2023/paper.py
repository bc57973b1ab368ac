"""The audit of Okajima, Hosoe and Hagiwara (2023): experiments, claims, errata, figures, tables and scope together."""

from __future__ import annotations

from typing import Any

from papers._common import INPUTS, MULTIPLES
from papers.okajima2023 import common, data, sensitivity
from papers.okajima2023.claims import gains, levels, orders, simulation, theory, unstable
from papers.okajima2023.designs import (
    CASES,
    GAIN_SETS,
    HALF_UNIT_OF_GAINS,
    KEY,
    LARGEST_PERIOD,
    PERIOD_TABLE,
    experiments,
)
from papers.okajima2023.errata import ERRATA
from papers.okajima2023.experiments import constant_matrix
from papers.okajima2023.figures import FIGURES
from papers.okajima2023.findings import findings
from papers.okajima2023.identities import (
    identities,
    observability,
    observable_but_not_detectable,
    product_orders,
)
from papers.okajima2023.period_table import period_row
from papers.okajima2023.schedules import selections
from papers.okajima2023.scope import scope
from papers.okajima2023.section4c import as_printed, recovered
from papers.okajima2023.simulations import draws, response, worst_disturbance
from replication.audit.judge.perturb import sensitivities
from replication.audit.judge.printed import parse
from replication.audit.model import Experiment, Formula, Paper, Table

CLAIMS = (*levels.CLAIMS, *orders.CLAIMS, *gains.CLAIMS, *simulation.CLAIMS, *unstable.CLAIMS, *theory.CLAIMS)

_NOISE = {"sigma": float(data.SIGMA), "noisy": data.LAST_NOISE, "last": data.LAST_SUMMED}
_PROPOSED = {**CASES["proposed"], "gains": data.gains(data.GAINS_33)}
_SIMULATED = {**CASES, "proposed": _PROPOSED}
_TIMINGS = {
    f"timing-{theta + 1}": {
        "periods": [3, 3], "offsets": [0, theta], "sensors": [0, 1], "gains": data.gains(GAIN_SETS[str(38 + theta)][2])
    }
    for theta in range(3)
}  # fmt: skip
SEEDS, SEED = 2000, 20230302
"""Draws for the distribution of g_sim, and the seed of all simulations."""
IDENTITY_TRIALS = 50
DIAGONAL_STEP, LARGEST_ENTRY, WIDER = 0.01, 3, 5
"""Grids of the search behind Sec. IV-C: step of the diagonal of A, largest entry of C, and of its possible rivals."""
WORST_HORIZON = 300


def _experiment(name: str, function: object, **inputs: object) -> Experiment:
    return Experiment(name=f"{KEY}.{name}", function=function, inputs=inputs)  # type: ignore[arg-type]


def stated(printed: str) -> list[list[float]]:
    """Printed poles as (real, imaginary); one of each conjugate pair."""
    return [[float(entry.value) for entry in cell] + [0.0] * (2 - len(cell)) for cell in parse(printed).cells]


SENSITIVITY, COMMON = f"{KEY}.sensitivity", f"{KEY}.common"


def _tried() -> list[dict[str, Any]]:
    """The designs whose level is printed, each with the claims on it."""
    found = [
        {"periods": list(periods), "offsets": [0, 0], "sensors": [0, 1], "claims": [levels.table_claim_id(periods)]}
        for periods in data.TABLE_1
    ]
    found += [{**CASES[name], "claims": [f"{KEY}.gamma.case-{name.lower()}"]} for name in "ABC"]
    found += [
        {"periods": [3, 3], "offsets": [0, n], "sensors": [0, 1], "claims": [f"{KEY}.timing.case-{n + 1}"]}
        for n in (1, 2)
    ]
    return found


EXPERIMENTS = (
    *experiments(),
    _experiment("common", common.levels, **INPUTS),
    _experiment("sensitivity", sensitivity.levels, plant=data.printed_plant(), designs=_tried()),
    *(
        _experiment(f"schedule.{name}", selections, periods=list(periods), offsets=list(offsets))
        for name, (periods, offsets, _) in data.SELECTION.items()
    ),
    _experiment("schedule.dual-rate", selections, periods=[6, 6], offsets=[0, 0]),
    *(
        Experiment(
            name=name, function=period_row,
            inputs={"plant": data.plant(), "first": first, "largest": LARGEST_PERIOD},
        )
        for first, name in enumerate(PERIOD_TABLE, start=1)
    ),
    _experiment("constant-matrix", constant_matrix, plant=data.plant(), periods=[2, 1], offsets=[0, 0]),
    _experiment("identities", identities, trials=IDENTITY_TRIALS, seed=SEED),
    _experiment("observability", observability, plant=data.plant()),
    _experiment("observable-not-detectable", observable_but_not_detectable),
    _experiment(
        "product-orders", product_orders, plant=data.plant(), periods=[2, 3], offsets=[0, 0],
        gains=data.gains(data.GAINS_33),
    ),
    _experiment("responses", response, plant=data.plant(), cases=_SIMULATED | _TIMINGS, **_NOISE, seed=SEED),
    *(
        Experiment(
            name=name, function=draws,
            inputs={"plant": data.plant(), "cases": _SIMULATED, **_NOISE, "seeds": SEEDS, "seed": SEED, "part": part,
                    "parts": len(simulation.DRAWS)},
        )
        for part, name in enumerate(simulation.DRAWS)
    ),
    _experiment(
        "worst-disturbance", worst_disturbance, plant=data.plant(), case=_PROPOSED, horizon=WORST_HORIZON, seed=SEED
    ),
    _experiment("unstable.as-printed", as_printed, plant=data.plant(), gains=data.gains(data.GAINS_42)),
    _experiment(
        "unstable.recovered", recovered, printed_A=data.matrix(data.A_41), printed_gains=data.gains(data.GAINS_42),
        stated_poles=stated(data.POLES_A),
        stated_error_poles=[pole[0] for pole in stated(data.POLES_A_E)], half_unit=HALF_UNIT_OF_GAINS,
        step=DIAGONAL_STEP, bound=LARGEST_ENTRY, wider_bound=WIDER,
    ),
)  # fmt: skip

TABLES = (
    Table(
        place="Table 1",
        caption="Optimal level for several sensing periods, both sensors at instant 0.",
        header=("N₁, N₂", *(f"{a}, {b}" for a, b in data.TABLE_1)),
        rows=(("γ", *(f"claim:{levels.table_claim_id(periods)}" for periods in data.TABLE_1)),),
    ),
    Table(
        place="Sec. IV-A",
        caption="The multi-rate observer against three dual-rate ones, and one simulated ratio of each.",
        header=("Observer", "optimal level γ", "simulated ratio, eq. (34)"),
        rows=tuple(
            (
                simulation.WHO[name],
                f"claim:{KEY}.gamma.{'proposed' if name == 'proposed' else f'case-{name.lower()}'}",
                f"claim:{KEY}.gsim.{name.lower()}",
            )
            for name in CASES
        ),
    ),
    Table(
        place="Sec. IV-B",
        caption="Three timings of two sensors of period 3: optimal level, and the level of the printed gains.",
        header=("Timing", "optimal level γ", "level of the printed gains"),
        rows=tuple(
            (f"Case {n + 1}, θ₂ = {n}", f"claim:{KEY}.timing.case-{n + 1}", f"claim:{KEY}.gains.eq{38 + n}")
            for n in range(3)
        ),
    ),
)

FORMULAS = (
    Formula(
        text="Error system of the observer, eqs. (16) and (18)",
        latex=r"e(k+1) = (A - L_k S_k C)\,e(k) + B_d\,d(k) - L_k S_k D\,w(k), \qquad z(k) = W e(k)",
    ),
    Formula(
        text="Matrix inequality of Theorem 2, eq. (30), for every phase of the period",
        latex=(
            r"\begin{bmatrix} P_k & P_k A - Y_k S_k C & P_k B_d & -Y_k S_k D \\ \ast & P_{k-1} - W^T W & 0 & 0 \\"
            r" \ast & \ast & \gamma^2 I & 0 \\ \ast & \ast & \ast & \gamma^2 I \end{bmatrix} \succ 0,"
            r" \qquad L_k = P_k^{-1} Y_k"
        ),
    ),
    Formula(
        text="Periodic Riccati recursion used as the independent route, over the sensors measured at each instant",
        latex=(
            r"X_{k+1} = A (I + X_k G_k)^{-1} X_k A^T + B_d B_d^T, \qquad"
            r" G_k = (S_k C)^T (S_k D D^T S_k^T)^{+} S_k C - \gamma^{-2} W^T W"
        ),
    ),
    Formula(
        text="Non-causal bound: no estimator, not even a smoother, has a smaller gain",
        latex=r"\gamma_{nc}^2 = \sup_\omega \lambda_{\max}\left(T_x^* T_x,\; I + T_y^* T_y\right)",
    ),
)

SUMMARY = (
    "The paper designs observers for plants whose sensors have different periods and timings: the gains change "
    "periodically with the sensors that are measured, and matrix inequalities minimise the worst-case ratio of "
    "estimation error to noise energy. A plant of three states and two sensors is the example; the author's blog post "
    "repeats its levels."
)


PAPER = Paper(
    key=KEY,
    title="State Observer Under Multi-Rate Sensing Environment and Its Design Using l₂-Induced Norm",
    authors=("Hiroshi Okajima", "Yohei Hosoe", "Tomomichi Hagiwara"),
    year=2023,
    venue="IEEE Access 11, 20079-20087",
    doi="10.1109/ACCESS.2023.3249187",
    summary=SUMMARY,
    notebook="multirate",
    bibtex="""@article{okajima2023,
  author  = {Okajima, Hiroshi and Hosoe, Yohei and Hagiwara, Tomomichi},
  title   = {State Observer Under Multi-Rate Sensing Environment and Its Design Using $l_2$-Induced Norm},
  journal = {IEEE Access},
  volume  = {11},
  pages   = {20079--20087},
  year    = {2023},
  doi     = {10.1109/ACCESS.2023.3249187}
}""",
    experiments=EXPERIMENTS,
    claims=CLAIMS,
    errata=ERRATA,
    figures=FIGURES,
    tables=TABLES,
    formulas=FORMULAS,
    scope=scope(CLAIMS),
    findings=findings,
    common=lambda results: common.common(results[COMMON], list(MULTIPLES)),
    sensitivity=lambda results: sensitivities(results[SENSITIVITY]),
)
