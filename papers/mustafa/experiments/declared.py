"""The experiments with their inputs: what is computed for each example, how finely, and from which random numbers."""

from typing import Any

import numpy as np

from papers._common import MULTIPLES, PLANT
from papers.mustafa.experiments import levels, small_gain
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA, example, printed_filter, upper_end
from replication.audit.declare import experiment
from replication.audit.model import Experiment

SEED, SEEDS, TRIALS, STEPS = 20100600, 400, 30, 500
"""Seed and number of draws of Figs. 2 and 3, random cases of the identities, samples of the figures."""
LIMIT, CELLS, POINTS = 32, 16, 121
"""N_0 of Algorithm 1; cells of (13); points of the curves over h."""
CENTRES, ANGLES, TRIED_LAWS = 401, 1501, 100
"""Other centres for (8); points of the circle for C_f; sequences under each law of the periods."""
TRIED = [m for m in MULTIPLES if m <= 4]
"""Multiples of the base period on the common plant: beyond, a fixed filter promises little here."""

FILTERS = {1: None, 2: printed_filter()}
"""The printed filters; Example 1 has none."""
EFFORT: dict[int, dict[str, Any]] = {
    1: {"horizon": 600, "final_horizon": 4000, "leaves": 140, "cuts": None},
    2: {"horizon": 1500, "final_horizon": 4500, "leaves": 56, "cuts": [0.08]},
}
DURATION_EFFORT: dict[int, dict[str, Any]] = {
    1: {"horizon": 200, "final_horizon": 1000, "leaves": 120, "cuts": [0.03, 0.08]},
    2: {"horizon": 250, "final_horizon": 2000, "leaves": 150, "cuts": [0.02, 0.06]},
}

LOOSEST_EFFORT = {"horizon": 150, "final_horizon": 600, "leaves": 2}


def _of_example(e: int) -> tuple[Experiment, ...]:
    case = example(e)
    subject, level = {**case, "printed": FILTERS[e]}, upper_end(GAMMA[e])
    return (
        experiment(f"nominal.{e}", levels.nominal, **case),
        experiment(f"grids.{e}", levels.grids, **case, limit=LIMIT),
        experiment(f"condition.{e}", small_gain.condition, **case, nodes=201, centres=CENTRES),
        experiment(
            f"own-grid.{e}", small_gain.own_grid, **case, nodes=POINTS, horizon=200, final_horizon=1000, leaves=24
        ),
        experiment(f"robust.{e}", levels.robust, **case, cells=CELLS),
        experiment(f"curve.{e}", levels.level_curve, **subject, nodes=POINTS, level=level),
        experiment(f"bracket.{e}", levels.bracket, **subject, per_duration=False, **EFFORT[e]),
        experiment(f"bracket-duration.{e}", levels.bracket, **subject, per_duration=True, **DURATION_EFFORT[e]),
    )


def _of_first() -> tuple[Experiment, ...]:
    plant, (h_l, h_u) = example(1).values()
    printed, ends = {**DATA["example-1"], "h_l": DATA["h_l-1"]}, [float(h) for h in np.linspace(0.02, h_u, 5)]
    return (
        experiment("sensitivity.1", levels.nominal_level, prints=printed, h_u=h_u, claim="gamma.1"),
        experiment("loosest.1", small_gain.loosest, **example(1), level=upper_end(GAMMA[1]), **LOOSEST_EFFORT),
        experiment("against-range", levels.against_range, plant=plant, h_l=h_l, ends=ends, horizon=200, leaves=12),
    )


def _of_second() -> tuple[Experiment, ...]:
    case, printed = example(2), {**DATA["filter"], "h": DATA["grid-2"]}
    wave = {name: float(text) for name, text in DATA["disturbance"].items()}
    response = {**case, "printed": FILTERS[2], **wave, "steps": STEPS, "seed": SEED}
    inputs = {**case, "printed": FILTERS[2], "level": upper_end(GAMMA[2])}
    return (
        experiment("output-matrix", levels.output_matrix, **inputs, angles=ANGLES),
        experiment("laws", levels.laws, **response, seeds=TRIED_LAWS),
        experiment("sensitivity.2", levels.filter_norm, prints=printed, plant=case["plant"], claim="filter.norm"),
        experiment("draws", levels.draws, **response, seeds=SEEDS),
    )


EXPERIMENTS = (
    experiment("common", levels.on_common_plant, plant=PLANT, multiples=TRIED, leaves=16, horizon=400),
    *(entry for e in EXAMPLES for entry in _of_example(e)),
    *_of_first(),
    *_of_second(),
    experiment("identities", small_gain.identities, trials=TRIALS, seed=SEED),
)
OF_SECOND = frozenset(declaration.name for declaration in (*_of_example(2), *_of_second()))
"""Those that take A of Example 2."""
