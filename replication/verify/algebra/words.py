"""Sums of words in letters that do not commute: an identity between them holds for matrices of all sizes that fit.

A letter stands for a matrix, or an operator; a central letter stands for a number, which commutes with all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flint import fmpq

Letter = tuple[str, bool]
"""Name, and whether transposed."""
Factors = tuple[tuple[str, ...], tuple[Letter, ...]]
"""A word: the central letters in order, and the others as they stand."""
NOTHING: Factors = ((), ())


@dataclass(frozen=True)
class Words:
    """A sum of words with their coefficients, none of which is zero. symmetric: letters that are their transposes."""

    terms: Mapping[Factors, fmpq]
    symmetric: frozenset[str] = frozenset()

    def __add__(self, other: Words) -> Words:
        """The sum."""
        total = dict(self.terms)
        for word, coefficient in other.terms.items():
            total[word] = total.get(word, fmpq(0)) + coefficient
        return self._of(total, other)

    def __sub__(self, other: Words) -> Words:
        """The difference."""
        return self + other * -1

    def __mul__(self, other: Words | fmpq | int) -> Words:
        """The product, or the multiple by a number."""
        if not isinstance(other, Words):
            return self._of({word: coefficient * other for word, coefficient in self.terms.items()}, self)
        total: dict[Factors, fmpq] = {}
        for (numbers, first), a in self.terms.items():
            for (more, second), b in other.terms.items():
                word = tuple(sorted(numbers + more)), first + second
                total[word] = total.get(word, fmpq(0)) + a * b
        return self._of(total, other)

    @property
    def T(self) -> Words:
        """The transpose: each word backwards, its letters transposed."""
        return self._of({(numbers, self._back(word)): a for (numbers, word), a in self.terms.items()}, self)

    def is_zero(self) -> bool:
        """Whether there is no word."""
        return not self.terms

    def replaced(self, rules: Mapping[tuple[Letter, ...], Words]) -> Words:
        """The same after equalities: wherever the left side of a rule stands in a word, its right side is put.

        Ends if every rule shortens a word or leaves none of its left sides; the rules and their transposes must hold.
        """
        done, todo = Words({}, self.symmetric), dict(self.terms)
        while todo:
            (numbers, word), a = todo.popitem()
            for left, right in rules.items():
                at = next((i for i in range(len(word)) if word[i : i + len(left)] == left), None)
                if at is not None:
                    start, end = (Words({(n, part): fmpq(1)}) for n, part in ((numbers, word[:at]), ((), word[at + len(left) :])))
                    todo = dict((Words(todo) + start * right * end * a).terms)
                    break
            else:
                done += Words({(numbers, word): a})
        return done

    def _back(self, word: tuple[Letter, ...]) -> tuple[Letter, ...]:
        return tuple((name, not turned and name not in self.symmetric) for name, turned in reversed(word))

    def _of(self, terms: Mapping[Factors, fmpq], other: Words) -> Words:
        return Words({word: a for word, a in terms.items() if a != 0}, self.symmetric | other.symmetric)


def one() -> Words:
    """The empty word: the identity matrix."""
    return Words({NOTHING: fmpq(1)})


def letter(name: str, *, symmetric: bool = False) -> Words:
    """A matrix of any size."""
    return Words({((), ((name, False),)): fmpq(1)}, frozenset({name} if symmetric else ()))


def number(name: str) -> Words:
    """A number, which commutes with all letters."""
    return Words({((name,), ()): fmpq(1)})
