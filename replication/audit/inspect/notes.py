"""What a run tells besides verdicts: things that are allowed, and that nobody would see otherwise."""

from __future__ import annotations

import difflib
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path

from replication.audit.inspect.coverage import faults
from replication.audit.judge.proofs import flat
from replication.audit.model import Verdict
from replication.audit.names import listed
from replication.audit.parts import Paper
from replication.audit.store.records import ClaimRecord, ResultsFile

LIKENESS = 0.75
"""Of two words, from which one may be the other with a slip; `Tabel` and `Table` have 0.8."""


def _both_ways(number: float) -> tuple[tuple[str, float], tuple[str, float]]:
    """Minutes, hours or calories, and back."""
    return (f"{number:g}", number), (f"1/{number:g}", 1 / number)


SIGN = "−1"
FACTORS = {
    SIGN: -1.0,
    **{f"10^{power}": 10.0**power for power in (*range(-9, 0), *range(1, 10))},
    **{"2π": 2 * math.pi, "1/(2π)": 1 / (2 * math.pi), "180/π": 180 / math.pi, "π/180": math.pi / 180},
    **{name: times for number in (60.0, 3600.0, 4.184) for name, times in _both_ways(number)},
}
"""By which a number is off whose sign was lost, or that is in another unit."""


def notes(
    papers: Sequence[Paper], results: ResultsFile, unused: Sequence[str], figures: Path, folder: Path
) -> Iterator[str]:
    """Experiments that nothing uses, claims without a second method, places with a slip, figures that are left over,
    lists of what a text prints that do not fit it.

    unused: names of experiments whose results nobody read. figures: where the figures were drawn. folder: that of the
    papers.
    """
    if unused:
        yield f"no claim, erratum, figure or finding uses {listed(unused)}"
    if results.run.unlocked:
        yield f"not as locked: {listed(results.run.unlocked)}"
    bare = [
        claim.id
        for claim in results.claims
        if claim.evidence.value is not None and not (claim.claim.uses or claim.judgement.proved)
    ]
    if bare:
        yield f"a number that rests on no experiment: {listed(bare)}"
    unchecked = [
        claim.id
        for claim in results.claims
        if claim.verdict not in (Verdict.UNDETERMINED, Verdict.ERROR)
        and not (claim.evidence.cross_check or claim.judgement.proved)
    ]
    if unchecked:
        yield f"neither a check by a second method nor a proof: {listed(unchecked)}"
    for claim in results.claims:
        if claim.verdict is Verdict.DIFFERS and (words := factor(claim)):
            cause = "a sign lost" if words == SIGN else "another unit, or a decimal comma"
            yield f"{claim.id}: the computed number is {words} times the print; {cause}?"
    for paper in papers:
        yield from (f"{where}: {slip}" for where, slip in slips(paper))
        drawn = {figure.name for figure in paper.figures}
        files = sorted({path for path in figures.glob(f"{paper.key}-*") if path.stem not in drawn})
        if files:
            yield f"no figure is called {listed([path.name for path in files])}; remove what is left in {figures}"
        yield from _uncovered(folder / paper.key, paper)


def _uncovered(folder: Path, paper: Paper) -> Iterator[str]:
    """That the list of what the text prints does not fit the paper, as the first fault says."""
    there = all((folder / name).is_file() for name in ("coverage.toml", "printed.toml"))
    if there and (found := faults(folder, paper)):
        count = f"{len(found)} fault{'s' if len(found) > 1 else ''}"
        yield f"coverage.toml of {paper.key} has {count}, see `replication coverage {paper.key}`; the first: {found[0]}"


def factor(claim: ClaimRecord) -> str:
    """The usual factor by which all numbers of a claim are off, as another unit or place of the point leaves it."""
    numbers = [] if claim.evidence.value is None else list(flat(claim.evidence.value))
    ends = [(float(Fraction(low)), float(Fraction(high))) for low, high in claim.judgement.intervals]
    if not numbers or len(numbers) != len(ends) or any(low <= 0 <= high for low, high in ends):
        return ""  # zero is a multiple of each number
    for words, times in FACTORS.items():
        if all(low <= number / times <= high for number, (low, high) in zip(numbers, ends, strict=True)):
            return words
    return ""


def slips(paper: Paper) -> Iterator[tuple[str, str]]:
    """Words that stand in one place only of a paper and resemble one that stands in several, such as `Tabel 1`."""
    places = {claim.id: claim.place for claim in paper.claims} | {item.id: item.place for item in paper.errata}
    words = {name: set(re.findall(r"[^\W\d_]{4,}", place)) for name, place in places.items()}
    known = Counter(word for found in words.values() for word in found)
    known.update(word for item in paper.scope for word in set(re.findall(r"[^\W\d_]{4,}", item.part)))
    often = [word for word, times in known.items() if times > 1]
    for name, found in words.items():
        for word in sorted(found):
            near = difflib.get_close_matches(word, often, n=1, cutoff=LIKENESS) if known[word] == 1 else []
            if near and not _same_stem(word, near[0]):
                yield name, f"the place {places[name]!r} has {word!r}; is {near[0]!r} meant?"


def _same_stem(first: str, second: str) -> bool:
    """Whether the words differ by a capital or in number only."""
    return first.lower().rstrip("s") == second.lower().rstrip("s")
