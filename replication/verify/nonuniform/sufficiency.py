"""Lemma 1, the stability of Theorems 1 to 3 and the level of Theorem 3, for plants, filters and signals of any size."""

from __future__ import annotations

from replication.verify.algebra.symbolic import blocks, letters
from replication.verify.kernel import Identity, decide
from replication.verify.nonuniform import identities
from replication.verify.statement import statement


@statement("nonuniform.lemma-1", source="mustafa", holds=True, says="Lemma 1")
def lemma_1() -> None:
    """If one P-bar > 0 satisfies (6) at all sampling periods of a range, the error system is asymptotically stable with
    the level gamma for every sampling sequence of the range.

    Along the error system the form of (6) is V(x_{k+1}) - V(x_k) + e'e - gamma^2 w'w with V(x) = x'P-bar^{-1}x. It is
    negative: without w, V falls by one factor over the compact range; its sum from x_0 = 0 gives the level.
    """
    _dissipation()


@statement("nonuniform.stability", source="mustafa", holds=True, says="stability of Theorems 1 to 3")
def stability() -> None:
    """If the plant is stable and (6) holds at one sampling period, the error system is asymptotically stable for every
    sampling sequence with periods of at least h_l > 0; neither (8) nor a grid is needed.

    (6) at one period h_0 without w says that V falls there, so that A-bar(h_0) is Schur; products of A-bar keep its
    zero block and multiply the diagonal ones, so A_f is Schur. The exponentials of A commute: the state of the plant is
    e^(A tau_k) x_0, with tau_k >= k h_l, and tends to zero exponentially, and so does that of the filter, which it
    drives.
    """
    _dissipation()
    first, second, A_f, driven = letters("Phi", "Psi", "A_f", "driven")
    A_bar, following = (blocks([[Phi, Phi * 0], [driven, A_f]]) for Phi in (first, second))
    beside = driven @ second + A_f @ driven
    decide(
        Identity(A_bar @ following, blocks([[first @ second, first * 0], [beside, A_f @ A_f]]), "a product of A-bar")
    )


@statement("nonuniform.level", source="mustafa", holds=True, says="level of Theorem 3")
def level() -> None:
    """If (10) holds, without its repeated row and with F of size n x r, the filter (11) has the level gamma at each
    element of the grid, and for every sequence of elements.

    (10) is (6) after a congruence with an invertible matrix, as (10) gives Y > Z > 0; (11) gives back the filter, in
    other coordinates. P-bar is one for all elements, so Lemma 1 holds on the grid.
    """
    identities.require_congruence()
    identities.require_recovery()
    _dissipation()


def _dissipation() -> None:
    """The form of (6) at (p, q, r, w), where P r = x_k, P p = x_{k+1} and q = e_k; G stands for gamma^2 I.

    Then B w = P p - A P r, p'P p = V(x_{k+1}) and r'P r = V(x_k).
    """
    P, A, C, G, p, r, w = letters("P", "A", "C", "G", "p", "r", "w", symmetric=("P", "G"))
    driven, q = P @ p - A @ P @ r, C @ P @ r
    diagonal = p.T @ P @ p + q.T @ q + r.T @ P @ r + w.T @ G @ w
    beside = p.T @ (A @ P @ r + driven) + q.T @ (C @ P @ r)
    loss = p.T @ P @ p - r.T @ P @ r + q.T @ q - w.T @ G @ w
    decide(Identity(beside + beside.T - diagonal, loss, "the form of (6)"))
