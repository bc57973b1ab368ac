"""The words of the report: what each verdict and each term means, and a link to that where a page first uses a term.

A paper adds terms of its own in its brief.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from markupsafe import Markup

from replication.audit.model import Verdict
from replication.audit.report.claim import anchor
from replication.audit.store.records import PaperRecord

VERDICTS = {
    Verdict.REPRODUCED: "our number rounds to the printed one, or lies within the stated tolerance, and the text "
    "leaves no choice. Where we know only bounds, both do.",
    Verdict.REPRODUCED_AFTER_ERRATUM: "it holds once a misprint is corrected, and the text or the mathematics alone "
    "dictates the correction.",
    Verdict.COMPATIBLE: "possible, not confirmed: it holds under a reading or correction that we chose with the print "
    "in view, under some readings of several, or as one random draw.",
    Verdict.CONSISTENT: "the statement holds; it has no digits to compare. The evidence gives the margin or the "
    "probability.",
    Verdict.DIFFERS: "we compute another number, under the reading that is named or under every reading that we "
    "tried. The evidence says by how much.",
    Verdict.REFUTED: "the statement is false, by a counter-example or a proof.",
    Verdict.UNDETERMINED: "the text does not settle it: the number is cited, is a run time, depends on a choice that "
    "the text leaves open, or our bounds are too wide.",
    Verdict.ERROR: "nothing to compare: a computation failed or did not answer the question.",
}

TERMS = {
    "hold, possible, fail, undetermined": "how cards and badges count claims: reproduced, consistent or corrected with "
    "certainty; compatible; differs or refuted; the rest, run times apart.",
    "reading": "what we assume where the text leaves a choice.",
    "our copy": "the text of a paper as a machine converted it; printed means what it shows. A slip of the copy is "
    "none of the authors.",
    "run time": "seconds of another computer, which no other machine can confirm; they are counted apart.",
    "box": "all values that round to the printed number; the line is ours.",
    "bracket": "a lower and an upper bound on the true value.",
    "certificate": "a file with the numbers that prove a theorem; a second program checks it.",
    "inference": "a correction or reading that we chose because it fits the printed number.",
}
_FORMS = {"hold, possible, fail, undetermined": "possible|undetermined"}
"""How a term is met in a text, where it is not itself or its plural."""
_MARKED = re.compile(r"(<[^>]*>)")
_TAG = re.compile(r"</?([a-z][a-z0-9]*)")
_UNTOUCHED = frozenset("a button h1 h2 h3 h4 svg math script style summary label code nav dt th caption".split())  # noqa: SIM905
"""Elements in which no link is put."""


def terms(papers: Iterable[PaperRecord]) -> dict[str, str]:
    """The terms of the report, and those that these papers add."""
    return TERMS | {
        term: text for paper in papers if paper.brief is not None for term, text in paper.brief.terms.items()
    }


def word(term: str) -> str:
    """The id of the entry of a term."""
    return anchor("word", term.partition(",")[0].replace(" ", "-"))


def linked(html: str, known: Mapping[str, str]) -> Markup:
    """A page with the first mention of each of the terms as a link to its meaning."""
    forms = (rf"(?P<t{i}>{_FORMS.get(term, re.escape(term) + 's?')})" for i, term in enumerate(known))
    pattern = re.compile(rf"(?<![\w-])(?:{'|'.join(forms)})(?![\w-])", re.IGNORECASE)
    ids = [word(term) for term in known]
    met: set[int] = set()

    def link(found: re.Match[str]) -> str:
        index = int(str(found.lastgroup)[1:])
        if index in met:
            return found[0]
        met.add(index)
        return f'<a class="term" href="#{ids[index]}">{found[0]}</a>'

    parts: list[str] = []
    untouched = 0
    for part in _MARKED.split(html):
        tag = _TAG.match(part)
        if tag is not None and tag[1] in _UNTOUCHED and not part.endswith("/>"):
            untouched += -1 if part.startswith("</") else 1
        parts.append(part if untouched or tag is not None or part.startswith("<") else pattern.sub(link, part))
    return Markup("".join(parts))
