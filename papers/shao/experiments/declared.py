"""What is run: every experiment of this paper by its name, with its inputs."""

import numpy as np

from papers._common import INPUTS
from papers.shao.experiments import motor, theorem, tracking
from papers.shao.experiments.tracking import SEARCH, block, windows
from papers.shao.printed import COLUMNS, DATA, FREQUENCIES
from replication.audit.declare import experiment

EXPERIMENTS = (
    experiment("common", motor.on_common_plant, **INPUTS),
    experiment(
        "sensitivity", motor.sensitivity, prints=motor.PRINTS, pole_pairs=int(DATA["pole_pairs"]),
        period=float(DATA["period"]), ratio=int(DATA["ratio"]),
        cells=[
            {"observer": observer, "frequency": sigma, "claim": f"table.{column}-{index}"}
            for column, observer in COLUMNS.items()
            for index, sigma in enumerate(FREQUENCIES, 1)
        ],
    ),
    experiment("motor", motor.motor_model, seed=1),
    experiment("eigenvalues", motor.motor_eigenvalues, periods=np.geomspace(1e-3, 0.4, 200).tolist()),
    experiment("table", tracking.table, simulated_periods=60),
    experiment("orderings", tracking.orderings),
    experiment("windows", windows),
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
    *(experiment(name, block, structure=index) for index, name in enumerate(SEARCH)),
)  # fmt: skip
