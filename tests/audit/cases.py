"""Cases, claims and records in few words, for the tests of verdicts."""

import tomllib
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import replace

from replication.audit.judge import verdict
from replication.audit.judge.verdict import make_record
from replication.audit.model import (
    Claim,
    Erratum,
    Evidence,
    Experiment,
    Judgement,
    Kind,
    Proof,
    SolverRecord,
    StatedClaim,
    Verdict,
)
from replication.audit.parts import Paper, ScopeItem
from replication.audit.store.records import (
    SCHEMA_VERSION,
    ClaimRecord,
    ErratumRecord,
    ExperimentRecord,
    FigureRecord,
    PaperRecord,
    ResultsFile,
    RunRecord,
    shared,
)

PROOF = Proof(holds=True, text="it does", quantities={"gap": 0.5})
Case = tuple[StatedClaim, Evidence, bool | None]
"""What is judged: a claim, its evidence, and whether the proof of its erratum holds."""


def case(kind: Kind, evidence: Evidence, *, printed: str = "", proof_holds: bool | None = None, **more: Any) -> Case:
    made = claim(kind=kind, printed=printed, **more)
    return StatedClaim(**shared(StatedClaim, made)), evidence, proof_holds


def judge(case: Case, *, inferred: bool = False, scanned: bool = False, **more: Any) -> Judgement:
    claim, evidence, holds = case
    return verdict.judge(claim, evidence, proved(claim.erratum, holds, inference=inferred, scan=scanned), **more)


def value_case(printed: str, value: Any, lower: Any = None, upper: Any = None, **more: Any) -> Case:
    said = {
        name: more.pop(name) for name in ("method", "note", "as_printed", "outcomes", "over_inputs") if name in more
    }
    evidence = Evidence(**{"method": "computed", **said}, value=value, lower=lower, upper=upper)
    return case(Kind.VALUE, evidence, printed=printed, **more)


def statement_case(kind: Kind, holds: bool | None = None, margin: float | None = None, **more: Any) -> Case:
    said = {name: more.pop(name) for name in ("as_printed",) if name in more}
    return case(kind, Evidence(method="computed", holds=holds, margin=margin, **said), **more)


def claim(**more: Any) -> Claim:
    given: dict[str, Any] = {
        "id": "toy.value",
        "place": "Table 1",
        "kind": Kind.VALUE,
        "statement": "A number.",
        "expected": Verdict.REPRODUCED,
        "answer": lambda results: Evidence(method="none"),
        "printed": "1.33",
        "reading": "none",
    }
    return Claim(**(given | more))


def recorded(evidence: Evidence | None, proof: Proof | None = None, error: str = "", **more: Any) -> ClaimRecord:
    readings, inferred = more.pop("readings", ()), more.pop("inferred", False)
    erratum = proved(more.get("erratum"), proof and proof.holds, inference=inferred)
    told = {"code": "papers/toy.py:1", "seconds": 0.5, "error": error, "readings": readings}
    return make_record(claim(**more), evidence, erratum, **told)


def altered(record: ClaimRecord, **changes: Any) -> ClaimRecord:
    """The record with fields of its claim, evidence or judgement changed, whichever has them."""
    parts = {name: getattr(record, name) for name in ("claim", "evidence", "judgement")}
    for name, value in changes.items():
        (part,) = (part for part, struct in parts.items() if name in struct.__struct_fields__)
        parts[part] = replace(parts[part], **{name: value})
    return ClaimRecord(**parts)


def proved(name: str | None, holds: bool | None, **more: bool) -> ErratumRecord | None:
    """The erratum of this name, if it is one; holds: None where its proof failed."""
    if name is None:
        return None
    proof = None if holds is None else Proof(holds=holds, text="")
    stated = Erratum(name, "eq. (1)", "a", "b", lambda results: PROOF, **more)
    error = "it failed" if holds is None else ""
    return ErratumRecord.of("toy", stated, proof, code="papers/toy.py:2", error=error)


def errata_of(record: ClaimRecord, proof: Proof | None) -> dict[str, ErratumRecord]:
    erratum = proved(record.claim.erratum, proof and proof.holds)
    return {} if erratum is None else {erratum.id: erratum}


SAMPLE = tomllib.loads(Path(__file__).with_name("sample.toml").read_text(encoding="utf-8"))
"""Records as data, by name."""
RUN = msgspec.convert(SAMPLE["run"], RunRecord)
EXPERIMENT = msgspec.convert(SAMPLE["experiment"], ExperimentRecord)


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


def file_of(code: Paper, *records: ClaimRecord) -> ResultsFile:
    """A results file that says of the paper what the code says of it, with these claims."""
    figures = [
        FigureRecord(**shared(FigureRecord, figure), paper=code.key, alt="", csv_sha256="", error="", code="")
        for figure in code.figures
    ]
    (erratum,) = errata_of(recorded(None, erratum=f"{code.key}.e1"), Proof(holds=True, text="")).values()
    return replace(
        results_file(*records, errata=(erratum,)),
        papers=(PaperRecord(**shared(PaperRecord, code), findings=(), sensitivity=(), common=()),),
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


SOLVER = SolverRecord(name="s", version="1", status="optimal", options={"tol": 1e-9}, residuals={"primal": 1e-12})
RECORDS_OF_EVERY_KIND = (
    recorded(Evidence(method="m", value=1.3268, lower=1.3267, upper=1.3269, quantities={"n": 2}, solvers=(SOLVER,))),
    recorded(Evidence(method="m", value=(1.0, (2.0, -3.0))), printed="(1.0, 2.0±3.0i)", id="toy.list"),
    recorded(
        Evidence(method="m", value=((1, 2), (3, 4)), as_printed=Evidence(method="m", value=((1, 2), (3, 5)))),
        PROOF,
        id="toy.matrix",
        kind=Kind.MATRIX,
        printed="[1 2; 3 4]",
        erratum="toy.e1",
    ),
    recorded(Evidence(method="m", holds=True, margin=0.5), id="toy.order", kind=Kind.ORDER),
)
