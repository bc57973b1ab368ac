"""Prefix trees of variable depth: which coming sampling periods a path-dependent Lyapunov function knows.

A leaf is a word of letters (cells of the range of periods), the next period first. Whatever the sequence, exactly one
leaf is a prefix of what is to come, and the leaf before a period follows from its letter and the leaf after it.
"""

from __future__ import annotations

from dataclasses import dataclass

Word = tuple[int, ...]


@dataclass(frozen=True)
class ContextTree:
    """leaves: sorted words over the letters 0 ... letters - 1, complete (one is a prefix of every long word) and
    closed.

    Closed means that a letter and the leaf after it determine the leaf before it.
    """

    letters: int
    leaves: tuple[Word, ...]

    @classmethod
    def one_step(cls, letters: int) -> ContextTree:
        """The tree that knows the next period's cell only."""
        return cls(letters, tuple((a,) for a in range(letters)))

    def transitions(self) -> list[tuple[int, int, int]]:
        """(position of the leaf before, letter, position of the leaf after) for every letter and leaf after it."""
        position = {leaf: i for i, leaf in enumerate(self.leaves)}
        known = set(self.leaves)
        steps = []
        for leaf in self.leaves:
            for letter in range(self.letters):
                before = _prefix(known, (letter, *leaf))
                assert before is not None
                steps.append((position[before], letter, position[leaf]))
        return steps

    def before(self) -> list[list[int]]:
        """For each leaf and letter after it the position of the leaf before."""
        found = [[0] * self.letters for _ in self.leaves]
        for leaf, letter, after in self.transitions():
            found[after][letter] = leaf
        return found

    def split(self, chosen: list[Word]) -> ContextTree:
        """The tree in which the chosen leaves know one period more, and others as far as closedness asks for it."""
        leaves = set(self.leaves)
        for leaf in chosen:
            _lengthen(leaves, leaf, self.letters)
        while open_ := [w for w in leaves if any(_prefix(leaves, (a, *w)) is None for a in range(self.letters))]:
            for leaf in open_:
                _lengthen(leaves, leaf, self.letters)
        return ContextTree(self.letters, tuple(sorted(leaves)))


def _lengthen(leaves: set[Word], leaf: Word, letters: int) -> None:
    leaves.remove(leaf)
    leaves.update((*leaf, b) for b in range(letters))


def _prefix(leaves: set[Word], word: Word) -> Word | None:
    """The leaf that begins `word`, or None if all its beginnings are inner nodes."""
    return next((word[:k] for k in range(1, len(word) + 1) if word[:k] in leaves), None)
