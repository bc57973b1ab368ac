"""An invented results file with every kind and verdict, and two figures, for the tests of rendering.

The paper does not exist and its numbers are made up.
"""

import functools
import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import msgspec
from cases import EXPERIMENT, RUN, SAMPLE, altered, proved

from replication.audit.brief import Brief, Explorer, Picture
from replication.audit.judge.verdict import make_record
from replication.audit.model import Claim, Evidence, Kind, Outcome, Proof, Reading, SolverRecord, Verdict
from replication.audit.parts import Figure, FigureData, Formula, ScopeItem, Table
from replication.audit.report.page import build_report
from replication.audit.run.draw import write_figure
from replication.audit.store.records import (
    SCHEMA_VERSION,
    CertificateRecord,
    ClaimRecord,
    ErratumRecord,
    FigureRecord,
    PaperRecord,
    ResultsFile,
)
from replication.audit.store.sources import SourceTree
from replication.drawing.style import line, new_axes
from replication.verify.predicate import Exported, Predicate, term

KEY = "doe1999"
READINGS = msgspec.convert(SAMPLE["readings"], tuple[Reading, ...])
SOLVER = msgspec.convert(SAMPLE["solver"], SolverRecord)


def claim(
    name: str, kind: Kind, expected: Verdict, printed: str, evidence: Evidence | None, **more: Any
) -> ClaimRecord:
    """Record of an invented claim, judged like any other; `error` and `proof` stand for what a run would bring."""
    error, proof, inferred = more.pop("error", ""), more.pop("proof", None), more.pop("inferred", False)
    fields = {"place": f"Table 1, {name}", "statement": f"Guaranteed level of the observer, case {name}."} | more
    made = Claim(
        id=f"{KEY}.{name}",
        kind=kind,
        expected=expected,
        printed=printed,
        answer=lambda results: cast(Evidence, evidence),
        uses=(f"{KEY}.levels",),
        **fields,
    )
    proofs = [certificate for certificate in certificates() if made.id in certificate.claims]
    if proofs:
        said = Predicate(of=term("gain", name), relation="is", to=printed, unit="1", reading=made.reading)
        made = msgspec.structs.replace(made, says=(said,))
    return make_record(
        made,
        evidence,
        proved(made.erratum, proof and proof.holds, inference=inferred),
        readings=READINGS,
        code="papers/doe1999/claims.py:42",
        seconds=1.234,
        error=error,
        certificates=proofs,
        unproved="" if proofs else "The paper does not exist.",
    )


def bracketed(value: float, width: float, **more: Any) -> Evidence:
    return Evidence(
        method="Periodic Riccati equation by structured doubling, bisection on the level",
        cross_check="Norm of the lifted closed loop with the gains of the matrix inequality",
        value=value,
        lower=value - width,
        upper=value + width,
        solvers=(SOLVER,),
        quantities={"relative gap": width / value, "spectral radius": 0.8125, "variables": 73.0},
        **more,
    )


def claims() -> tuple[ClaimRecord, ...]:
    """One claim of each kind with each verdict that it may have."""
    return tuple(_claim(**one) for one in SAMPLE["claims"])


def _claim(
    name: str, kind: str, expected: str, printed: str = "", bracket: Sequence[float] = (), **more: Any
) -> ClaimRecord:
    said = msgspec.convert({"method": "Evaluated directly"} | more.pop("evidence", {}), Evidence)
    if name == "gains":
        gains = tuple(tuple(math.sin(3 * i + j) for j in range(3)) for i in range(5))
        printed = "[" + "; ".join(" ".join(f"{x:.3f}" for x in row) for row in gains) + "]"
        said = msgspec.structs.replace(said, value=gains)
    if bracket:
        said = bracketed(*bracket, note=said.note)
    if "erratum" in more:
        more["proof"] = Proof(holds=True, text="No other reading fits.")
    return claim(name, Kind(kind), Verdict(expected), printed, None if "error" in more else said, **more)


def draw(data: FigureData) -> Any:
    figure, axes = new_axes(2)
    for index, (ax, name) in enumerate(zip(axes, ("error 1", "error 2"), strict=True)):
        ax.plot(data.columns["k"], data.columns[name], **line(index), label=name)
        ax.set(ylabel=name, ylim=(-0.5, 0.5))
        ax.legend(loc="upper right")
    axes[-1].set_xlabel("time k")
    return figure


def trace(results: Any) -> FigureData:
    time = tuple(float(k) for k in range(501))
    wave = tuple(0.4 * math.sin(k / 9) * math.exp(-k / 300) for k in time)
    return FigureData(columns={"k": time, "error 1": wave, "error 2": tuple(x * x for x in wave)})


def figure(name: str = "doe1999-fig2", **more: Any) -> Figure:
    fields: dict[str, Any] = {
        "place": "Fig. 2",
        "title": "Estimation error of the two states",
        "caption": "Both errors stay within the printed axes.",
        "published": True,
        "uses": (),
        "data": trace,
        "plot": draw,
        "alt": lambda data: (
            f"Two curves over {len(data.columns['k'])} steps, at most {max(data.columns['error 1']):.3g}."
        ),
    }
    return Figure(name=name, **(fields | more))


def write_figures(
    directory: Path, *figures: Figure, results: Mapping[str, Any] | None = None, sources: SourceTree | None = None
) -> tuple[FigureRecord, ...]:
    tree = sources or SourceTree({})
    return tuple(write_figure(one, KEY, results or {}, directory, tree) for one in figures)


def figure_records(directory: Path) -> tuple[FigureRecord, ...]:
    """Write two figures into `directory`; a third one fails."""
    extra = figure("doe1999-worst", place="Extra", title="Worst disturbance", published=False)
    broken = figure("doe1999-fig3", place="Fig. 3", title="A figure that fails", uses=("doe1999.absent",))
    return write_figures(directory, figure(), extra, broken)


def results(directory: Path) -> ResultsFile:
    """The whole invented results file; its figures are written into `directory`."""
    made = claims()
    ids = tuple(record.id for record in made)
    return ResultsFile(
        schema_version=SCHEMA_VERSION,
        run=msgspec.structs.replace(
            RUN, date="2024-02-29T12:00:00Z", commit="0123456789abcdef" * 2 + "01234567", package_version="0.1.0"
        ),
        papers=(paper_record(ids),),
        claims=made,
        errata=errata(),
        figures=figure_records(directory),
        experiments=(
            msgspec.structs.replace(
                EXPERIMENT,
                name=f"{KEY}.levels",
                paper=KEY,
                code="papers/doe1999/experiments.py:17",
                inputs={"periods": [2, 3], "tolerance": 1e-10},
                solvers=(SOLVER,),
            ),
        ),
        certificates=certificates(),
    )


def certificate(name: str, **more: Any) -> CertificateRecord:
    fields: dict[str, Any] = {
        "paper": KEY,
        "name": name,
        "path": f"certificates/{KEY}/{name}.json",
        "sha256": hashlib.sha256(name.encode()).hexdigest(),
        "claims": (f"{KEY}.{name}",),
        "statement": "invented.level",
        "proved": True,
        "reason": "",
        "sentence": f"The level of {name} lies within its bounds.",
        "lower": None,
        "upper": None,
        "holds": None,
        "items": (),
    } | more
    said = Exported(of=term("gain", name), unit="1", readings=("none", ""), items=((fields["lower"], fields["upper"]),))
    return CertificateRecord(**fields, says=(said,) if fields["proved"] else ())


def certificates() -> tuple[CertificateRecord, ...]:
    """A theorem whose bounds do not decide a claim, one that says a claim, and a certificate that was refused."""
    return (
        certificate("column-4-5", lower="15441/10000", upper="15481/10000"),
        certificate("column-8-9", lower="26351/10000", upper="26357/10000"),
        certificate("refused", claims=(), proved=False, reason="P is indefinite.", sentence=""),
    )


def paper_record(ids: tuple[str, ...]) -> PaperRecord:
    scope = ScopeItem(part="Table 1", claims=ids, figures=("doe1999-fig2",))
    left_out = ScopeItem(part="Section V", reason="It describes hardware.")
    made = msgspec.convert(SAMPLE["paper"], PaperRecord)
    return msgspec.structs.replace(made, readings=READINGS, brief=brief(), scope=(scope, left_out))


def _filled(value: Any, **words: str) -> Any:
    """Data with these words in the place of their names."""
    if isinstance(value, str):
        return functools.reduce(lambda text, word: text.replace(*word), words.items(), value)
    if isinstance(value, list):
        return [_filled(entry, **words) for entry in value]
    return {name: _filled(entry, **words) for name, entry in value.items()} if isinstance(value, dict) else value


def brief(topic: str = "Sensors that are slow", words: str = "one column") -> Brief:
    made = msgspec.convert(_filled(SAMPLE["brief"], TOPIC=topic, WORDS=words), Brief)
    return msgspec.structs.replace(made, explorers=(explorer(" ".join(topic.split()[:15])),))


def explorer(words: str = "Sensors that are slow", **more: Any) -> Explorer:
    """Two pictures of the first figure, and one of the figure that fails."""
    moved = msgspec.structs.replace(msgspec.convert(_filled(SAMPLE["picture"], WORDS=words), Picture), **more)
    still = msgspec.structs.replace(moved, begin=None, label="still", claim="column-2-3")
    absent = msgspec.structs.replace(moved, figure="doe1999-fig3")
    return Explorer(title=words, text=words, pictures=(moved, still, absent))


def errata() -> tuple[ErratumRecord, ...]:
    return msgspec.convert(SAMPLE["errata"], tuple[ErratumRecord, ...])


HOSTILE = (
    "<script>alert('x')</script>",
    '"><img src=x onerror=alert(1)>',
    "</td></tr></table></main>",
    "{{ 7 * 7 }}{% raw %}",
    "word" * 2500,
    "' onfocus='alert(1)' autofocus='",
    "\u202eright to left שלום\u202d",
    "null \x00 bell \x07 end \ufffe",
    "& &amp; &lt;b&gt;",
)
"""Strings that must stay text wherever they stand."""


def hostile_results(directory: Path, text: str) -> ResultsFile:
    """The sample with `text` in the place of all prose, names of solvers and quantities, errors and code."""
    made = results(directory)

    def said(record: Any, words: str, **more: Any) -> Any:
        return (altered if isinstance(record, ClaimRecord) else msgspec.structs.replace)(
            record, **dict.fromkeys(words.split(), text), **more
        )

    papers = {
        "authors": (text,),
        "brief": brief(text, re.sub(r"[][0-9]", "x", text).partition(" ")[0]),
        "findings": (text,),
        "formulas": (Formula(text=text, latex=r"x"),),
        "tables": (Table(place=text, caption=text, header=(text,), rows=((text,),)),),
        "scope": (ScopeItem(part=text, reason=text),),
        "readings": (Reading(name=text, place=text, text=text, inference=True),),
    }
    claims = {
        "quantities": {text: 1.5},
        "solvers": (said(SOLVER, "name status", options={text: text}, residuals={text: 1.0}),),
        "as_printed": Evidence(method=text),
        "outcomes": (Outcome(reading=text, value=1.5, lower=1.0, upper=2.0, holds=True, margin=0.5),),
        "certificates": (text,),
    }
    of_claims = "place statement method cross_check code reason note unit remark reading unproved"
    return msgspec.structs.replace(
        made,
        run=said(made.run, "cpu commit", packages={text: text}),
        papers=tuple(said(one, "title venue doi summary bibtex", **papers) for one in made.papers),
        claims=tuple(said(one, of_claims, **claims) for one in made.claims),
        certificates=tuple(said(one, "path reason sentence") for one in made.certificates),
        errata=tuple(said(one, "place printed meant text error") for one in made.errata),
        figures=tuple(said(one, "place title caption alt") for one in made.figures),
        experiments=tuple(said(one, "code error", inputs={text: text}) for one in made.experiments),
    )


def build(directory: Path) -> Path:
    """Build the report of the sample in `directory`."""
    return build_report(results(directory / "figures"), directory / "figures", directory / "index.html")
