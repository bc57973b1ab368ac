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

    def reduced(self, rules: Mapping[tuple[Letter, ...], Words]) -> Words:
        """The same by equalities: where a left side stands in a word, its right side is put, until there is none.

        What remains is equal to the sum, whatever the rules are, if they hold. Ends if the rules lead to shorter words.
        """
        done, todo = Words({}, self.symmetric), dict(self.terms)
        while todo:
            (numbers, word), a = todo.popitem()
            whole = Words({(numbers, word): a}, self.symmetric)
            found = next(
                ((left, at) for left in rules for at in range(len(word)) if word[at : at + len(left)] == left), None
            )
            if found is None:
                done += whole
            else:
                left, at = found
                front, rest = Words({(numbers, word[:at]): a}), Words({((), word[at + len(left) :]): fmpq(1)})
                todo = dict((Words(todo) + front * rules[left] * rest).terms)
        return done

    def without(self, *names: str) -> Words:
        """The same with these letters zero."""
        kept = {(n, word): a for (n, word), a in self.terms.items() if not {name for name, _ in word} & {*names}}
        return Words(kept, self.symmetric)

    def at(self, values: Mapping[str, fmpq]) -> fmpq:
        """The value where every letter is a number."""
        total = fmpq(0)
        for (numbers, word), a in self.terms.items():
            for name in (*numbers, *(name for name, _ in word)):
                a = a * values[name]
            total += a
        return total

    def _back(self, word: tuple[Letter, ...]) -> tuple[Letter, ...]:
        return tuple((name, not turned and name not in self.symmetric) for name, turned in reversed(word))

    def _of(self, terms: Mapping[Factors, fmpq], other: Words) -> Words:
        return Words({word: a for word, a in terms.items() if a != 0}, self.symmetric | other.symmetric)


NONE = Words({})
"""The sum of no word: zero."""


def one() -> Words:
    """The empty word: the identity matrix."""
    return Words({NOTHING: fmpq(1)})


def letter(name: str, *, symmetric: bool = False) -> Words:
    """A matrix of any size."""
    return Words({((), ((name, False),)): fmpq(1)}, frozenset({name} if symmetric else ()))


def number(name: str) -> Words:
    """A number, which commutes with all letters."""
    return Words({((name,), ()): fmpq(1)})
