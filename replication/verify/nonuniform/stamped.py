"""The statement on a filter that knows the periods by the time stamps of its samples: its gain, from both sides."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from flint import acb_mat, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.balls import circle_point
from replication.verify.algebra.linear import block, identity, product, solved, zeros
from replication.verify.nonuniform import gain
from replication.verify.nonuniform.gain import Storage, require_level, require_motion
from replication.verify.nonuniform.system import CaseOf, Plant, on_plant
from replication.verify.reading import fields, matrices, rational, sequence, sized, square
from replication.verify.says import Says
from replication.verify.statement import BOTH, Depends
from replication.verify.theorem import Found


@dataclass(frozen=True)
class Stamped:
    """x^(k|k) = x^ + G_x v, w^ = G_w v, v = y - C x^, then the plant's own motion over the known period.

    cells: shares at which the cells end; entries: E = I - G [C, D] for each cell of the period before, G = [G_x; G_w].
    """

    cells: list[fmpq]
    entries: list[fmpq_mat]

    def steps(self, plant: Plant, step: arb_mat) -> list[arb_mat]:
        """e+ = Phi (e - G_x v) + Gamma (w - G_w v), v = C e + D w: (n, n + m)."""
        return [step * arb_mat(entry) for entry in self.entries]

    def output(self, plant: Plant) -> fmpq_mat:
        """z - z^ = L e, before the sample."""
        return plant.L


def read_stamped(value: Any, path: str, plant: Plant) -> Stamped:
    """Cells that cover the range exactly, and G (n + m, r) for each."""
    edges, gains = fields(value, path, "cells", "G")
    cells = gain.read_cells(edges, f"{path}.cells")
    seen = block([[plant.C, plant.D]])
    size = seen.ncols()
    G = matrices(gains, f"{path}.G", size, seen.nrows(), len(cells) - 1)
    return Stamped(cells, [identity(size) - product(one, seen) for one in G])


def in_coordinates(plant: Plant, filter_: Stamped, T: fmpq_mat) -> tuple[Plant, Stamped]:
    """The same for the state T x; no gain depends on that."""
    n, m = plant.A.nrows(), plant.B.ncols()
    back = solved(T, identity(n), "witness.T is not invertible")
    enter, leave = (block([[M, zeros(n, m)], [zeros(m, n), identity(m)]]) for M in (T, back))
    entries = [product(product(enter, entry), leave) for entry in filter_.entries]
    A, B = product(product(T, plant.A), back), product(T, plant.B)
    return replace(plant, A=A, B=B, C=plant.C * back, L=plant.L * back), replace(filter_, entries=entries)


@on_plant(
    "nonuniform.stamped-gain",
    bound=BOTH,
    witness={
        "filter": Depends(lambda given: sized(read_stamped, given.plant)),
        "T": Depends(lambda given: sized(square, given.plant.A.nrows())),
        "storage": Depends(lambda given: sized(gain.read_storage, given.plant.A.nrows(), given.filter.cells)),
        "pattern": gain.read_pattern,
        "turn": rational,
        "w": Depends(
            lambda given: sized(sequence, sized(gain.complex_vector, given.plant.B.ncols()), len(given.pattern))
        ),
    },
    says=Says(
        quantity="least gain over sequences",
        estimators=("filters with time stamps",),
        found=lambda given: Found(upper=given["upper"]),
    ),
)
def stamped_gain(
    plant: Plant,
    lower: fmpq,
    upper: fmpq,
    filter: Stamped,
    T: fmpq_mat,
    storage: Storage,
    pattern: list[fmpq],
    turn: fmpq,
    w: list[acb_mat],
) -> Found:
    """The filter with time stamps that stands here has a gain of more than {lower:down} and at most {upper:up}
    {scope}; its error settles for every such sequence.

    Nothing is asked of the plant: its state does not enter the error. The inequality of `require_level` is strict and
    its periods are those of a closed range, so that without a disturbance the storage falls by a fixed share with each
    step: the error system is stable, as `require_motion` asks. The gain at the first sample, which no period precedes,
    may be any of the filter's: each is one of the inequalities, and one step does not change what a motion tends to.
    The storage is written for the state T x: balls are narrow where it is about the identity.
    """
    moved, chosen = in_coordinates(plant, filter, T)
    case = CaseOf(ends=(plant.h_l, plant.h_u), weight="samples", filter=chosen, level=upper)
    require_level(moved, case, upper, storage)
    require_motion(moved, case, lower, pattern, circle_point(turn), w)
    return Found(words={"scope": case.scope})
