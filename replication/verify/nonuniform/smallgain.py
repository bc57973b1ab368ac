"""Condition (8) itself, in balls: where one element of the grid meets it over the whole range, and where it does not.

For a constant change theta = h - h_0 the norm in (8) is that of T(z) = A Phi (zI - Phi)^-1 Delta(theta), Phi at h_0.
All factors are functions of A: with an eigenvalue a of A, T(z) has the eigenvalue (e^{ah} - e^{a h_0})/(z - e^{a h_0}),
the largest modulus of which over the circle is r(a, h) = |e^{ah} - e^{a h_0}|/(1 - |e^{a h_0}|).
"""

from __future__ import annotations

from itertools import pairwise

from flint import acb, arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.balls import beside, hold
from replication.verify.algebra.linear import identity
from replication.verify.algebra.work import BALL, spend
from replication.verify.kernel import Below, Hurwitz, Positive, decide, holds
from replication.verify.nonuniform.gain import require_everywhere
from replication.verify.nonuniform.system import PERIODS, Plant, along, in_words, on_plant, seconds
from replication.verify.reading import sequence, sized, symmetric, text
from replication.verify.says import Says
from replication.verify.statement import Depends
from replication.verify.theorem import Found, require

CONDITION = Says(quantity="condition (8)", setting={}, readings=("constant change", "any change"))
HALVINGS = 12
"""Times that a piece of the range may be halved before its storage matrix is refused."""
MOST_PIECES = 200


def eigenvalues(A: fmpq_mat) -> tuple[acb, acb]:
    """Both eigenvalues of A of order two."""
    require(A.nrows() == 2, "the eigenvalues are written out for two states")
    half = (A[0, 0] + A[1, 1]) / 2
    root = acb(arb(half * half - A.det())).sqrt()
    return acb(arb(half)) + root, acb(arb(half)) - root


def modal(a: acb, h_0: arb, h: arb) -> arb:
    """r(a, h)."""
    start = (a * acb(h_0)).exp()
    return abs((a * acb(h)).exp() - start) / (1 - abs(start))


@on_plant("nonuniform.breaks-condition-8", source="mustafa", parameters={"period": text}, holds=False, says=CONDITION)
def breaks_condition(plant: Plant, period: str) -> Found:
    """With the middle of the range for its one element (8) does not hold over the range in any coordinates: at the
    period {period} s the norm is at least {least:down 6}.

    The norm of T(z) is not below the modulus of an eigenvalue, in whatever coordinates. A constant change is one of the
    sequences, so that the gain for every sequence is no less.
    """
    decide(Hurwitz(plant.A, "the plant"))
    changed = plant.period(period, "parameters.period")
    h_0, h = seconds(plant.middle), seconds(changed)
    found = [modal(a, h_0, h) for a in eigenvalues(plant.A)]
    reached = [size for size in found if holds(Below(1, size, "one"))]
    require(reached != [], f"the eigenvalues give {found[0].str(5)} and {found[1].str(5)} there, not more than one")
    return Found(words={"period": in_words(changed), "least": reached[0]})


@on_plant(
    "nonuniform.meets-condition-8",
    source="mustafa",
    witness={"P": Depends(lambda given: sized(sequence, sized(symmetric, given.plant.A.nrows())))},
    holds=True,
    says=CONDITION,
)
def meets_condition(plant: Plant, P: list[fmpq_mat]) -> Found:
    """With the middle of the range for its one element (8) holds over the whole range: for every constant change in the
    coordinates of the plant, and for every sequence of changes in modal coordinates, where the norm is at most
    {most:up 6}.

    The range is cut into as many equal pieces as there are matrices P > 0 (bounded real lemma, on each piece). In modal
    coordinates the factors are diagonal, so that the gain is the largest r(a, h); for real a < 0 the modulus in r is
    largest at an end of the range.
    """
    decide(Hurwitz(plant.A, "the plant"))
    require(0 < len(P) <= MOST_PIECES, f"witness.P must have 1 to {MOST_PIECES} matrices")
    values = eigenvalues(plant.A)
    trace, determinant = plant.A[0, 0] + plant.A[1, 1], plant.A.det()
    decide(Below(4 * determinant, trace * trace, "the eigenvalues of A are not real and different"))
    h_0, ends = seconds(plant.middle), [seconds(plant.period(name, "period")) for name in (PERIODS[0], PERIODS[-1])]
    sizes = [modal(a, h_0, h) for a in values for h in ends]
    for size in sizes:
        decide(Below(size, 1, "in modal coordinates the norm is not proved to be below one"))
    for k, (first, last) in enumerate(pairwise([fmpq(i, len(P)) for i in range(len(P) + 1)])):
        require_everywhere(_Gain(plant, P[k]).fails, first, last, [(k, k)], HALVINGS)
    return Found(words={"most": max(sizes, key=lambda size: float(size.upper()))})


class _Gain:
    """The bounded real lemma for T at the level one: [P - C'C - Phi'P Phi, -Phi'P D; ., I - D'P D] > 0, C = A Phi."""

    def __init__(self, plant: Plant, P: fmpq_mat) -> None:
        self.plant, self.P = plant, arb_mat(P)
        self.Phi = hold(plant.A, plant.B, seconds(plant.middle))[0]
        seen = arb_mat(plant.A) * self.Phi
        decide(Positive(self.P, "witness.P"))
        self.state = self.P - seen.transpose() * seen - self.Phi.transpose() * self.P * self.Phi

    def fails(self, a: fmpq, b: fmpq, transitions: list[tuple[int, int]]) -> list[tuple[int, int]]:
        """The piece, unless the inequality holds for the changes to all periods between the shares a and b."""
        plant, n = self.plant, self.plant.A.nrows()
        spend(30 * n**3 * BALL, "condition (8)")
        h = seconds(along(plant.h_l, plant.h_u, a)).union(seconds(along(plant.h_l, plant.h_u, b)))
        one = arb_mat(identity(n))
        D = hold(plant.A, identity(n), h - seconds(plant.middle))[1]
        cross = -(self.Phi.transpose() * self.P * D)
        rows = beside(self.state, cross).tolist()
        rows += beside(cross.transpose(), one - D.transpose() * self.P * D).tolist()
        return [] if holds(Positive(arb_mat(rows), "the bounded real lemma")) else transitions
