"""Suffix trees of variable depth: which recent sampling periods a path-dependent Lyapunov function remembers.

A leaf is a word of letters (cells of the range of periods), the most recent last. Whatever the sequence, exactly one
leaf
is a suffix of it, and the leaf after the next letter follows from the leaf before it.
"""

from __future__ import annotations

from dataclasses import dataclass

Word = tuple[int, ...]


@dataclass(frozen=True)
class ContextTree:
    """leaves: sorted words over the letters 0 ... letters - 1, complete (one is a suffix of every long word) and
    closed.

    Closed means that leaf and next letter determine the next leaf.
    """

    letters: int
    leaves: tuple[Word, ...]

    @classmethod
    def one_step(cls, letters: int) -> ContextTree:
        """The tree that remembers the last period's cell only."""
        return cls(letters, tuple((a,) for a in range(letters)))

    def successor(self, leaf: Word, letter: int) -> Word:
        """The leaf after `letter` follows `leaf`."""
        found = _suffix(set(self.leaves), (*leaf, letter))
        assert found is not None
        return found

    def transitions(self) -> list[tuple[int, int, int]]:
        """(position of the leaf, letter, position of the next leaf) for every leaf and letter."""
        position = {leaf: i for i, leaf in enumerate(self.leaves)}
        known = set(self.leaves)
        steps = []
        for leaf in self.leaves:
            for letter in range(self.letters):
                following = _suffix(known, (*leaf, letter))
                assert following is not None
                steps.append((position[leaf], letter, position[following]))
        return steps

    def split(self, chosen: list[Word]) -> ContextTree:
        """The tree in which the chosen leaves remember one period more, and others as far as closedness asks for it."""
        leaves = set(self.leaves)
        for leaf in chosen:
            _lengthen(leaves, leaf, self.letters)
        while open_ := [w for w in leaves if any(_suffix(leaves, (*w, a)) is None for a in range(self.letters))]:
            for leaf in open_:
                _lengthen(leaves, leaf, self.letters)
        return ContextTree(self.letters, tuple(sorted(leaves)))


def _lengthen(leaves: set[Word], leaf: Word, letters: int) -> None:
    leaves.remove(leaf)
    leaves.update((b, *leaf) for b in range(letters))


def _suffix(leaves: set[Word], word: Word) -> Word | None:
    """The leaf that ends `word`, or None if all its endings are inner nodes."""
    return next((word[-k:] for k in range(1, len(word) + 1) if word[-k:] in leaves), None)
