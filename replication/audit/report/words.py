"""The words of the report: what each verdict and each term means, and a link to that where a page first uses a term.

A paper adds terms of its own in its brief.
"""

import re
from collections.abc import Iterable, Mapping

from markupsafe import Markup

from replication.audit.data import words
from replication.audit.model import Verdict
from replication.audit.report.claim import anchor
from replication.audit.store.records import PaperRecord

VERDICTS = {Verdict(name): text for name, text in words("verdicts").items()}
TERMS = words("terms")
_FORMS = {"hold, possible, fail, undetermined": "possible|undetermined"}
"""How a term is met in a text, where it is not itself or its plural."""
_MARKED = re.compile(r"(<[^>]*>)")
_TAG = re.compile(r"</?([a-z][a-z0-9]*)")
_UNTOUCHED = frozenset("a button h1 h2 h3 h4 svg math script style summary label code nav dt th caption".split())  # noqa: SIM905
"""Elements in which no link is put."""


def terms(papers: Iterable[PaperRecord]) -> dict[str, str]:
    """The terms of the report, and those that these papers add, in the order in which the results file has them."""
    briefs = (paper.brief for paper in papers if paper.brief is not None)
    return TERMS | {term: text for brief in briefs for term, text in sorted(brief.terms.items())}


def word(term: str) -> str:
    """The id of the entry of a term."""
    return anchor("word", term.partition(",")[0].replace(" ", "-"))


def linked(html: str, known: Mapping[str, str]) -> Markup:
    """A page with the first mention of each of the terms as a link to its meaning."""
    forms = (rf"(?P<t{i}>{_FORMS.get(term, re.escape(term) + 's?')})" for i, term in enumerate(known))
    pattern = re.compile(rf"(?<![\w-])(?:{'|'.join(forms)})(?![\w-])", re.IGNORECASE)
    ids = [word(term) for term in known]
    met: set[int] = set()

    def link(match: re.Match[str]) -> str:
        index = int(str(match.lastgroup)[1:])
        if index in met:
            return match[0]
        met.add(index)
        return f'<a class="term" href="#{ids[index]}">{match[0]}</a>'

    parts: list[str] = []
    untouched = 0
    for part in _MARKED.split(html):
        tag = _TAG.match(part)
        if tag is not None and tag[1] in _UNTOUCHED and not part.endswith("/>"):
            untouched += -1 if part.startswith("</") else 1
        parts.append(part if untouched or tag is not None or part.startswith("<") else pattern.sub(link, part))
    return Markup("".join(parts))
