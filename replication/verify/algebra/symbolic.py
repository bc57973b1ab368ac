"""Words in letters, and matrices of blocks of them: an identity holds for matrices of all sizes that fit.

Letters do not commute: one stands for a matrix, or an operator; a central letter for a number, which commutes with all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flint import fmpq

from replication.verify.stdlib.balls import Ring

Letter = tuple[str, bool]
"""Name, and whether transposed."""
Factors = tuple[tuple[str, ...], tuple[Letter, ...]]
"""A word: the central letters in order, and the others as they stand."""
NOTHING: Factors = ((), ())


@dataclass(frozen=True)
class Words(Ring):
    """A sum of words with their coefficients, none of which is zero. symmetric: letters that are their transposes."""

    terms: Mapping[Factors, fmpq]
    symmetric: frozenset[str] = frozenset()

    def __add__(self, other: Words | fmpq | int) -> Words:
        """The sum."""
        other = other if isinstance(other, Words) else one() * other
        total = dict(self.terms)
        for word, coefficient in other.terms.items():
            total[word] = total.get(word, fmpq(0)) + coefficient
        return self._of(total, other)

    def __neg__(self) -> Words:
        """The negative."""
        return self * -1

    def __truediv__(self, divisor: int) -> Words:
        """A part of it."""
        return self * fmpq(1, divisor)

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

    def derivative(self, name: str) -> Words:
        """The derivative in a central letter."""
        total = self * 0
        for (numbers, word), a in self.terms.items():
            if name in numbers:
                at = numbers.index(name)
                total += Words({((*numbers[:at], *numbers[at + 1 :]), word): a * numbers.count(name)})
        return total

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
            place = next(
                ((left, at) for left in rules for at in range(len(word)) if word[at : at + len(left)] == left), None
            )
            if place is None:
                done += whole
            else:
                left, at = place
                front, rest = Words({(numbers, word[:at]): a}), Words({((), word[at + len(left) :]): fmpq(1)})
                todo = dict((Words(todo) + front * rules[left] * rest).terms)
        return done

    def without(self, *names: str) -> Words:
        """The same with these letters zero."""
        terms = {(n, word): a for (n, word), a in self.terms.items() if not {name for name, _ in word} & {*names}}
        return Words(terms, self.symmetric)

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


@dataclass(frozen=True)
class Symbolic(Ring):
    """A matrix of sums of words, by rows."""

    rows: tuple[tuple[Words, ...], ...]

    @property
    def T(self) -> Symbolic:
        """The transpose."""
        return Symbolic(tuple(tuple(entry.T for entry in column) for column in zip(*self.rows, strict=True)))

    def __add__(self, other: Symbolic) -> Symbolic:
        """The sum."""
        pairs = zip(self.rows, other.rows, strict=True)
        return Symbolic(tuple(tuple(a + b for a, b in zip(*pair, strict=True)) for pair in pairs))

    def __neg__(self) -> Symbolic:
        """The negative."""
        return self * -1

    def __mul__(self, factor: Words | fmpq | int) -> Symbolic:
        """The multiple by a central letter or a number."""
        return Symbolic(tuple(tuple(entry * factor for entry in row) for row in self.rows))

    def __matmul__(self, other: Symbolic) -> Symbolic:
        """The product."""
        columns = tuple(zip(*other.rows, strict=True))
        pairs = ([zip(row, column, strict=True) for column in columns] for row in self.rows)
        return Symbolic(tuple(tuple(sum((a * b for a, b in pair), NONE) for pair in row) for row in pairs))

    def is_zero(self) -> bool:
        """Whether every entry is zero."""
        return all(entry.is_zero() for row in self.rows for entry in row)


def letters(*names: str, symmetric: Sequence[str] = ()) -> tuple[Symbolic, ...]:
    """A matrix of any size for each name; those in `symmetric` are their own transposes."""
    return tuple(Symbolic(((letter(name, symmetric=name in symmetric),),)) for name in names)


IDENTITY = Symbolic(((one(),),))
"""The identity matrix of any size."""


def blocks(table: Sequence[Sequence[Symbolic]]) -> Symbolic:
    """The matrix made of these blocks."""
    rows = [zip(*(part.rows for part in parts), strict=True) for parts in table]
    return Symbolic(tuple(tuple(entry for piece in pieces for entry in piece) for row in rows for pieces in row))
