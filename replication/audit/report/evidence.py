"""Evidence as one packed text, which the page unpacks where a claim is opened; proofs to check there; digit ladders."""

import base64
import json
import math
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from jinja2 import Environment

from replication.audit.model import Verdict
from replication.audit.report.claim import ClaimView, anchor
from replication.audit.report.entries import EntryView
from replication.audit.report.templates import source
from replication.audit.store.records import CertificateRecord, ClaimRecord, PaperRecord, ResultsFile
from replication.files import sha256
from replication.verify.subjects import subject

_SPACE = re.compile(r">\s+<")


def drawings(environment: Environment, shown: Mapping[str, Any]) -> dict[str, str]:
    """HTML by the id of the element that it belongs into: the evidence of each claim, the inputs of each experiment."""
    module = environment.get_template("evidence.html.j2").make_module(dict(shown))
    claims = {
        anchor("claim", view.record.id): str(module.evidence(view, paper))  # type: ignore[attr-defined]
        for paper in shown["papers"]
        for view in paper.claims
    }
    inputs = {
        anchor("experiment", record.name): str(module.inputs(record))  # type: ignore[attr-defined]
        for record in shown["results"].experiments
        if record.inputs or record.solvers
    }
    return {name: _SPACE.sub("> <", html).strip() for name, html in (claims | inputs).items()}


def packed(parts: Mapping[str, Any]) -> str:
    """`parts` as JSON, deflated, in base64: what no HTML parser can take for anything else."""
    return base64.b64encode(zlib.compress(json.dumps(parts, ensure_ascii=False).encode(), 9)).decode()


MOST_BYTES = 11_000
"""Of one certificate in the page, which is to stay light enough to be mailed; larger ones are files beside it."""
COUNTEREXAMPLE = "dualrate.counterexample"
_STATEMENT = re.compile(r'^    "((?:multirate|dualrate|delay)\.[a-z0-9-]+)"', re.MULTILINE)


def checkable() -> frozenset[str]:
    """The statements that the script has a check for, by its own table of them."""
    return frozenset(_STATEMENT.findall(source("check.js")))


def checks(results: ResultsFile, root: Path | None) -> dict[str, Any]:
    """`entries` by the path of a certificate: its text, what it must be about, printed numbers; and the `plants`.

    The text is byte for byte the file that the run verified. What it must be about is made from the paper's own
    `printed.toml` and `theorems.json`; the script compares both, and checks the rest in exact fractions.
    root: of the project; without one, or where it has not the files that the run verified, nothing can be checked.
    """
    entries: dict[str, Any] = {}
    plants: dict[str, Any] = {}
    known = checkable()
    for record in results.certificates:
        text = _verified(record, root) if root is not None and record.proved and record.statement in known else None
        if text is None or root is None:
            continue
        theorem = subject(record.paper, record.name, root)
        plant = f"{record.paper}/{theorem['plant']['name']}"
        plants[plant] = theorem["plant"]
        prints = _prints(record, results.claims)
        entries[record.path] = {"text": text, "wanted": {**theorem, "plant": plant}, "prints": prints}
    return {"entries": entries, "plants": plants}


def played(proofs: Mapping[str, Any]) -> dict[str, str]:
    """By paper, the scalar loop that a certificate proves to diverge, as data for the sliders of `html/play.js`."""
    loops = {}
    for entry in proofs["entries"].values():
        plant = proofs["plants"][entry["wanted"]["plant"]]
        if entry["wanted"]["statement"] == COUNTEREXAMPLE and len(plant["A"]) == 1:
            loop = {name: plant[key][0][0] for name, key in zip("abcKL", "ABCKL", strict=True)}
            loop |= {name: plant[name] for name in "TM"}
            paper = entry["wanted"]["paper"]
            numbers = {name: float(Fraction(value)) for name, value in loop.items()}
            loops[paper] = json.dumps({"name": f"play-{paper}"} | numbers)
    return loops


def _verified(record: CertificateRecord, root: Path) -> str | None:
    """The text of a certificate, if its file is small enough, and the one that the run verified."""
    path = root / record.path
    content = path.read_bytes() if path.is_file() and path.stat().st_size <= MOST_BYTES else b""
    return content.decode() if sha256(content) == record.sha256 else None


def _prints(record: CertificateRecord, claims: Sequence[ClaimRecord]) -> list[str]:
    """The numbers that the paper prints for what a theorem bounds; each once, however often it is repeated."""
    about = [term.of for term in record.says]
    numbers = (
        claim.claim.printed
        for claim in claims
        if record.path in claim.evidence.certificates
        and claim.claim.tolerance is None
        and claim.claim.kind == "value"
        and all(predicate.relation == "is" and predicate.to == claim.claim.printed for predicate in claim.claim.says)
        and any(predicate.of in about for predicate in claim.claim.says)
    )
    return list(dict.fromkeys(numbers))


MOST = 8
"""Ladders of a paper."""
FARTHEST = 2
"""Units of the last printed place that the first rung shows on either side."""

Ends = tuple[Fraction, Fraction]


@dataclass(frozen=True, kw_only=True)
class Rung:
    """One scale. factor: how many times finer than the first. box: the part of it that rounds to the print.

    ours: the bracket, a line where it is thinner than one. end: the nearer end of the interval.
    """

    factor: int
    box: tuple[float, float] | None
    ours: tuple[float, float]
    end: float | None


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """One claim; near: the gap from the bracket to the nearer end of the interval, as a share of the interval.

    inside: whether the bracket lies in it. end: the nearer end. bracket: what is proved, rounded outwards. room: how
    many times its width goes into the gap. beside: claims of its place that find the same print, if it is above the
    least level.
    """

    view: ClaimView
    entry: EntryView
    inside: bool
    near: float
    end: Fraction
    bracket: Ends
    room: int
    rungs: tuple[Rung, ...]
    beside: tuple[ClaimView, ...]


def ladders(paper: PaperRecord, claims: Sequence[ClaimView]) -> tuple[Ladder, ...]:
    """The proved numbers of the paper's tables, each once, first those outside their interval, then the closest."""
    cells = {name for table in paper.tables for name in table.claims}
    views = [view for view in claims if view.record.id in cells and view.record.counted]
    items = [ladder for view in views if (ladder := _ladder(view, claims)) is not None]
    # Several claims of one place may print the same digits; the first of them stands for all.
    distinct = {(ladder.view.record.claim.place, ladder.entry.printed): ladder for ladder in reversed(items)}.values()
    chosen = sorted(distinct, key=lambda ladder: (ladder.inside, ladder.near))[:MOST]
    return tuple(sorted(chosen, key=lambda ladder: (ladder.inside, ladder.view.place)))


def _ladder(view: ClaimView, claims: Sequence[ClaimView]) -> Ladder | None:
    """None unless one printed number has a proved bracket, in sight of its interval, from which its verdict follows."""
    evidence, judgement = view.record.evidence, view.record.judgement
    if len(view.entries) != 1 or not judgement.proved or view.record.verdict is Verdict.ERROR:
        return None
    (entry,) = view.entries
    low, high = evidence.lower, evidence.upper
    if entry.interval is None or not isinstance(low, int | float) or not isinstance(high, int | float):
        return None
    ours, box = (Fraction(low), Fraction(high)), entry.interval
    inside = box[0] <= ours[0] and ours[1] <= box[1]
    if abs(entry.deviation) > FARTHEST or ours[0] >= ours[1] or (not inside and ours[1] > box[0] and ours[0] < box[1]):
        return None
    gap, end = min((max(end - ours[1], ours[0] - end), end) for end in box)
    # Whether it agrees hangs on more than this bracket, such as a second reading: no verdict for a drawing.
    if not gap or inside is (view.record.verdict is Verdict.DIFFERS or bool(view.rounded)):
        return None
    # With as many digits as show its width.
    unit = Fraction(10) ** math.floor(math.log10(ours[1] - ours[0]))
    return Ladder(
        view=view,
        entry=entry,
        inside=inside,
        near=float(gap) / float(box[1] - box[0]),
        end=end,
        bracket=(math.floor(ours[0] / unit) * unit, math.ceil(ours[1] / unit) * unit),
        room=_two_digits(gap / (ours[1] - ours[0])),
        rungs=_rungs(box, ours, end),
        beside=tuple(claim for claim in claims if _attains(claim, view)) if view.rounded else (),
    )


def _attains(view: ClaimView, least: ClaimView) -> bool:
    """Whether a claim of the place of a least level finds the number printed for it, as the printed filter's level."""
    first, second = view.record.claim, least.record.claim
    return (first.place, first.printed) == (second.place, second.printed) and view.record.counted and view.within == 1


def _two_digits(number: Fraction) -> int:
    """A large number to two digits, a whole one in any case."""
    return int(round(number, min(0, 1 - math.floor(math.log10(number)))))


def _rungs(box: Ends, ours: Ends, end: Fraction) -> tuple[Rung, ...]:
    """The whole interval, its nearer end, and the bracket."""
    around = (min(box[0], ours[0]), max(box[1], ours[1])), (min(end, ours[0]), max(end, ours[1])), ours
    margins = (box[1] - box[0]) / 4, (around[1][1] - around[1][0]) / 3, (ours[1] - ours[0]) / 2
    windows = [(low - margin, high + margin) for (low, high), margin in zip(around, margins, strict=True)]
    scale = windows[0][1] - windows[0][0]
    return tuple(_rung(window, scale, box, ours, end if n == 1 else None) for n, window in enumerate(windows))


def _rung(window: Ends, scale: Fraction, box: Ends, ours: Ends, end: Fraction | None) -> Rung:
    def at(number: Fraction) -> float:
        return round(float(100 * (number - window[0]) / (window[1] - window[0])), 2)

    low, high = (min(max(at(number), 0.0), 100.0) for number in box)
    return Rung(
        factor=_two_digits(scale / (window[1] - window[0])),
        box=(low, high) if low < high else None,
        ours=(at(ours[0]), at(ours[1])),
        end=None if end is None else at(end),
    )
