"""What a run tells besides verdicts: things that are allowed, and that nobody would see otherwise."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from replication.audit.model import Paper, Verdict
from replication.audit.store.records import ResultsFile

SHOWN = 3
"""Names that a note lists; it counts the others."""
LIKENESS = 0.75
"""Of two words, from which one may be the other with a slip; `Tabel` and `Table` have 0.8."""


def notes(papers: Sequence[Paper], results: ResultsFile, unused: Sequence[str], figures: Path) -> Iterator[str]:
    """Experiments that nothing uses, claims without a second method, places with a slip, figures that are left over.

    unused: names of experiments whose results nobody read. figures: where the figures were drawn.
    """
    if unused:
        yield f"no claim, erratum, figure or finding uses {_listed(unused)}"
    unchecked = [
        claim.id
        for claim in results.claims
        if claim.verdict not in (Verdict.UNDETERMINED, Verdict.ERROR)
        and not (claim.evidence.cross_check or claim.judgement.proved)
    ]
    if unchecked:
        yield f"neither a check by a second method nor a proof: {_listed(unchecked)}"
    for paper in papers:
        yield from (f"{where}: {slip}" for where, slip in slips(paper))
        drawn = {figure.name for figure in paper.figures}
        files = sorted({path for path in figures.glob(f"{paper.key}-*") if path.stem not in drawn})
        if files:
            yield f"no figure is called {_listed([path.name for path in files])}; remove what is left in {figures}"


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


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return f"{', '.join(names[:SHOWN])}{more}"
