"""The scalar loop A = B = C = 1, L = 2: det(I - Phi) as a polynomial in h = e^T - 1."""

from __future__ import annotations

from fractions import Fraction

Polynomial = list[Fraction]


def _times(left: Polynomial, right: Polynomial) -> Polynomial:
    found = [Fraction(0)] * (len(left) + len(right) - 1)
    for i, a in enumerate(left):
        for j, b in enumerate(right):
            found[i + j] += a * b
    return found


def _plus(*terms: Polynomial) -> Polynomial:
    size = max(map(len, terms))
    return [sum((term[i] for term in terms if i < len(term)), Fraction(0)) for i in range(size)]


def margin(k: Fraction, ratio: int) -> Polynomial:
    """(1 + h)^(2M) det(I - Phi), h = e^T - 1, by states x, zeta and measurements times (1 + h)^phase."""
    one: Polynomial = [Fraction(1), Fraction(1)]
    columns = []
    for x, own in (([Fraction(1)], [Fraction(0)]), ([Fraction(0)], [Fraction(1)])):
        measured = x
        for _ in range(ratio):
            pushed = _times([Fraction(0), k], own)
            ahead = _times(one, _plus(_times(one, own), pushed))
            x, own = (
                _times(one, _plus(_times(one, x), pushed)),
                _plus(own, pushed, _times([Fraction(0), Fraction(2)], measured)),
            )
            measured = ahead
        columns.append((x, own))
    (a, b), (c, d) = columns
    whole: Polynomial = [Fraction(1)]
    for _ in range(ratio):
        whole = _times(whole, one)
    negative = [Fraction(-1)]
    first, second = _plus(whole, _times(negative, a)), _plus(whole, _times(negative, d))
    return _plus(_times(first, second), _times(negative, _times(b, c)))
