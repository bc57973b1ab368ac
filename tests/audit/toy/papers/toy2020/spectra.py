"""Sums that depend on the number of threads if nothing holds that number fixed."""

import numpy as np


def spectrum(size: int, seed: int) -> dict[str, list[float]]:
    matrix = np.random.default_rng(seed).standard_normal((size, size))
    return {"singular": np.linalg.svd(matrix @ matrix.T, compute_uv=False).tolist(), "tiny": [5e-324, -0.0, 0.1 + 0.2]}
