"""A second paper, in one file."""

from replication.audit.model import Claim, Evidence, Experiment, Kind, Results, Verdict
from replication.audit.parts import Paper, ScopeItem


def half(value: float) -> float:
    return value / 2


def answer(results: Results) -> Evidence:
    return Evidence(method="division", value=results["half"])


PAPER = Paper(
    key="other2021",
    title="On halves",
    authors=("B. Toy",),
    year=2021,
    venue="Journal of Toys",
    doi="10.0000/other",
    summary="Halves.",
    bibtex="@article{other2021, title={On halves}}",
    experiments=(Experiment(name="other2021.half", function=half, inputs={"value": 3.0}),),
    claims=(
        Claim(
            reading="none",
            id="other2021.half",
            place="Sec. 1",
            kind=Kind.VALUE,
            statement="Half of three.",
            expected=Verdict.REPRODUCED,
            answer=answer,
            printed="1.5",
        ),
    ),
    scope=(ScopeItem(part="All", claims=("other2021.half",)),),
)
