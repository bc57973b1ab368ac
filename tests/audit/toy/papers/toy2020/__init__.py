"""A paper with one true and one false number, to test the machinery with."""

from papers.toy2020.claims import CLAIMS, ERRATA, FIGURES
from papers.toy2020.experiments import EXPERIMENTS
from replication.audit.parts import Formula, Paper, ScopeItem, Table

PAPER = Paper(
    key="toy2020",
    title="On squares",
    authors=("A. Toy",),
    year=2020,
    venue="Journal of Toys",
    doi="10.0000/toy",
    summary="Squares and spectra.",
    bibtex="@article{toy2020, title={On squares}}",
    experiments=EXPERIMENTS,
    claims=CLAIMS,
    errata=ERRATA,
    figures=FIGURES,
    tables=(Table(place="Table 1", caption="Squares", header=("x", "x²"), rows=(("2", "claim:toy2020.square.two"),)),),
    formulas=(Formula(text="The square", latex="x^2"),),
    scope=(ScopeItem(part="All", claims=tuple(claim.id for claim in CLAIMS), figures=("toy2020-fig1",)),),
    findings=lambda results: (f"Two squared is {results['square']['squares'][1]}.",),
)
