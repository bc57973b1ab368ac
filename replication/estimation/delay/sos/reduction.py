"""Theorem 3 without what a large 𝒵 makes redundant: a smaller program with the same infimum of γ.

𝒵 adds any multiple of |e_y|² and ∫|φ_y|² to the dissipation, where y marks the measured states, and V may hold
σ∫|φ_y|² at no cost, which adds (σ/τ)|φ_y(-1)|². As these grow, e_y, φ_y and φ_y(-1) drop out of N ⪰ 0 and φ_y out of
V ⪰ 0 (Schur complements), with every equality that names them. An observer of the unmeasured states is left, driven by
the derivative of y. The infimum over 𝒵 is seldom attained: the full program then ends with a gap, the reduced one not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy

from replication.estimation.delay.sos import lie
from replication.estimation.delay.sos.forms import FormSpace, Index, triangle
from replication.estimation.delay.sos.synthesis import Assembly

Mask = npt.NDArray[np.bool_]


def reduced(assembly: Assembly) -> Assembly:
    """The program of `assembly` with rows and columns of measured variables left out; its certificates are limits.

    For γ only: a point of it gives a certificate of Theorem 3 for every level above, but not by itself.
    """
    system, count = assembly.system, assembly.count
    source, target = lie.state_space(system, count), lie.derivative_space(system, count)
    _, e, late = lie.point_offsets(system)
    unmeasured = np.arange(system.states) < system.states - system.measurements
    functions = np.tile(unmeasured, system.delay_count)
    points = np.ones(target.points, dtype=bool)
    points[e:late], points[late:] = unmeasured, functions
    everything = np.ones(source.points, dtype=bool)
    storage, v_labels = _restricted(assembly.storage, assembly.v_labels, np.concatenate([everything, functions]))
    dissipation, h_labels = _restricted(assembly.dissipation, assembly.h_labels, np.concatenate([points, functions]))
    return replace(
        assembly,
        storage=storage,
        dissipation=dissipation,
        v_labels=v_labels,
        h_labels=h_labels,
        kept=assembly.kept & _named(target, points, functions),
    )


def _restricted(
    columns: scipy.sparse.csr_array, labels: tuple[Index, ...], keep: Mask
) -> tuple[scipy.sparse.csr_array, tuple[Index, ...]]:
    """The map without the rows and columns of its matrices whose variable is not kept; empty matrices are left out."""
    rows = [keep[label] for label in labels]
    mask = np.concatenate([np.outer(row, row).ravel() for row in rows])
    left = tuple(label[row] for label, row in zip(labels, rows, strict=True) if np.any(row))
    return columns[:, np.flatnonzero(mask)], left


def _named(space: FormSpace, points: Mask, functions: Mask) -> Mask:
    """Mask of the monomials that name kept variables only."""
    functionals = np.concatenate([points, np.tile(functions, space.count)])
    first, second = triangle(space.functionals)
    _, left, right = space.multiplier_functions()
    named: Mask = np.concatenate([functionals[first] & functionals[second], functions[left] & functions[right]])
    return named
