"""The experiments of the audit, with their inputs."""

from __future__ import annotations

import numpy as np

from papers._common import INPUTS
from papers.shao import common, data, sensitivity
from papers.shao.bounds import step_bounds
from papers.shao.problem import APO, FREQUENCIES, PMI
from papers.shao.search import BLOCKS, block
from papers.shao.stability import motor_eigenvalues, motor_model, slowest_rates, stable_sets, theorem
from papers.shao.tracking import frequency_sweep, lags, orderings, robustness, table, transients
from replication.audit.model import Experiment

SEARCH = tuple(f"shao.readings-{index:02d}" for index in BLOCKS)
"""Names of the blocks of the search."""

SENSITIVITY, COMMON = "shao.sensitivity", "shao.common"

EXPERIMENTS = (
    Experiment(name=COMMON, function=common.levels, inputs=INPUTS),
    Experiment(
        name=SENSITIVITY,
        function=sensitivity.table,
        inputs={
            "prints": sensitivity.PRINTS,
            "pole_pairs": int(data.POLE_PAIRS),
            "ratio": int(data.RATIO),
            "cells": [
                {"observer": observer, "frequency": sigma, "claim": f"shao.table.{column}-{index + 1}"}
                for column, observer in (("pmi", PMI), ("apo", APO))
                for index, sigma in enumerate(FREQUENCIES)
            ],
        },
    ),
    Experiment(name="shao.motor", function=motor_model, inputs={"seed": 1}),
    Experiment(name="shao.table", function=table, inputs={"simulated_periods": 60}),
    Experiment(name="shao.orderings", function=orderings),
    Experiment(
        name="shao.frequencies",
        function=frequency_sweep,
        inputs={"frequencies": np.geomspace(0.05, 8.0, 40).tolist(), "levels": [0.1, 1 - 0.5**0.5, 0.5]},
    ),
    Experiment(name="shao.transients", function=transients, inputs={"slow_periods": 40, "substeps": 10}),
    Experiment(name="shao.lags", function=lags, inputs={"ratios": list(range(1, 11)), "frequency": 1e-3}),
    Experiment(name="shao.robustness", function=robustness, inputs={"factors": np.geomspace(0.5, 2.0, 25).tolist()}),
    Experiment(
        name="shao.theorem",
        function=theorem,
        inputs={"periods": [1e-4, 1e-5, 1e-6], "ratios": [2, 3, 5, 8]},
    ),
    Experiment(name="shao.bounds", function=step_bounds, inputs={"trials": 400, "seed": 3}),
    Experiment(
        name="shao.eigenvalues", function=motor_eigenvalues, inputs={"periods": np.geomspace(1e-3, 0.4, 200).tolist()}
    ),
    Experiment(name="shao.rates", function=slowest_rates, inputs={"periods": np.geomspace(1e-4, 1.0, 41).tolist()}),
    Experiment(
        name="shao.stable-sets",
        function=stable_sets,
        inputs={
            "ratios": [1, 2, 3, 5, 8],
            "periods": [*np.arange(0.0004, 0.04, 0.0004).tolist(), *np.arange(0.04, 0.4, 0.01).tolist()],
            "largest_ratio": 60,
        },
    ),
    *(
        Experiment(name=name, function=block, inputs={"structure": index, "decoys": 40, "seed": 2022})
        for index, name in zip(BLOCKS, SEARCH, strict=True)
    ),
)
