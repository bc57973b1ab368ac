"""Cases, claims and records in few words, for the tests of verdicts."""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from replication.audit.judge.verdict import Case, make_record
from replication.audit.model import (
    Claim,
    Erratum,
    Evidence,
    Experiment,
    Figure,
    FigureData,
    Kind,
    Paper,
    Proof,
    ScopeItem,
    Verdict,
)
from replication.audit.run.stated import paper_fields
from replication.audit.store.records import (
    SCHEMA_VERSION,
    ClaimRecord,
    ErratumRecord,
    ExperimentRecord,
    FigureRecord,
    PaperRecord,
    Reading,
    ResultsFile,
    RunRecord,
)


def value_case(printed: str, value: Any, lower: Any = None, upper: Any = None, **more: Any) -> Case:
    return Case(kind=Kind.VALUE, printed=printed, reading=Reading(value=value, lower=lower, upper=upper), **more)


def statement_case(kind: Kind, holds: bool | None = None, margin: float | None = None, **more: Any) -> Case:
    return Case(kind=kind, reading=Reading(holds=holds, margin=margin), **more)


def claim(**more: Any) -> Claim:
    given: dict[str, Any] = {
        "id": "toy.value",
        "place": "Table 1",
        "kind": Kind.VALUE,
        "statement": "A number.",
        "expected": Verdict.REPRODUCED,
        "answer": lambda results: Evidence(method="none"),
        "printed": "1.33",
    }
    return Claim(**(given | more))


def recorded(evidence: Evidence | None, proof: Proof | None = None, error: str = "", **more: Any) -> ClaimRecord:
    return make_record(claim(**more), "toy", evidence, proof, "papers/toy.py:1", 0.5, error)


def errata_of(record: ClaimRecord, proof: Proof | None) -> dict[str, ErratumRecord]:
    if record.erratum is None:
        return {}
    erratum = ErratumRecord(
        id=record.erratum,
        paper="toy",
        place="eq. (1)",
        printed="a",
        meant="b",
        inference=False,
        holds=proof is not None and proof.holds,
        text="",
        quantities={},
        code="papers/toy.py:2",
        error="" if proof is not None else "it failed",
    )
    return {erratum.id: erratum}


RUN = RunRecord(
    package_version="0",
    date="2020-01-01T00:00:00Z",
    commit="c0",
    dirty=False,
    lock_sha256="l0",
    python="3.11.0",
    packages={"numpy": "2.1"},
    blas="openblas",
    threads=1,
    cpu="a processor",
    platform="linux",
)
EXPERIMENT = ExperimentRecord(
    name="toy-run",
    paper="toy",
    function="papers.toy:run",
    code="papers/toy.py:3",
    inputs={"n": 2},
    key="k0",
    seconds=0.5,
    solvers=(),
    error="",
)


def results_file(*records: ClaimRecord, errata: tuple[ErratumRecord, ...] = ()) -> ResultsFile:
    return ResultsFile(
        schema_version=SCHEMA_VERSION,
        run=RUN,
        papers=(),
        claims=records,
        errata=errata,
        figures=(),
        experiments=(EXPERIMENT,),
        certificates=(),
    )


def figure(name: str) -> Figure:
    """A figure of nothing."""
    return Figure(
        name=name,
        place="Fig. 1",
        title="A figure",
        caption="",
        published=True,
        uses=(),
        data=lambda results: FigureData(columns={}),
        plot=lambda data: None,
        alt=lambda data: "",
    )


def file_of(code: Paper, *records: ClaimRecord) -> ResultsFile:
    """A results file that says of the paper what the code says of it, with these claims."""
    figures = [
        FigureRecord(
            name=figure.name, paper=code.key, place=figure.place, title=figure.title, caption=figure.caption,
            published=figure.published, alt="", csv_sha256="", error="",
        )
        for figure in code.figures
    ]  # fmt: skip
    (erratum,) = errata_of(recorded(None, erratum=f"{code.key}.e1"), Proof(holds=True, text="")).values()
    return replace(
        results_file(*records, errata=(erratum,)),
        papers=(PaperRecord(findings=(), **paper_fields(code)),),
        figures=tuple(figures),
        experiments=(replace(EXPERIMENT, name=f"{code.key}-run", function="builtins:dict", inputs={}),),
    )


def paper(*claims: Claim, key: str = "toy", **more: Any) -> Paper:
    """A paper with the claims, an experiment `toy-run`, an erratum `toy.e1` and a scope that covers all claims."""
    given: dict[str, Any] = {
        "experiments": (Experiment(name=f"{key}-run", function=dict),),
        "errata": (
            Erratum(
                id=f"{key}.e1", place="eq. (1)", printed="a", meant="b", prove=lambda r: Proof(holds=True, text="")
            ),
        ),
        "scope": (ScopeItem(part="all", claims=tuple(claim.id for claim in claims), reason="-"),),
    }
    return Paper(
        key=key,
        title="A toy",
        authors=("A. Author",),
        year=2020,
        venue="Toys",
        doi="10.0/0",
        summary="",
        bibtex="",
        claims=claims,
        **(given | more),
    )
