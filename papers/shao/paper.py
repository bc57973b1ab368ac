"""The audit of Shao, Yang, Li and Yi: experiments, claims, errata, figures, tables and scope together."""

from papers._common import MULTIPLES
from papers.shao import common
from papers.shao.claims_compare import COMPARISONS
from papers.shao.claims_motor import MOTOR_CLAIMS
from papers.shao.claims_table import ANY_READING, TABLE_CELLS
from papers.shao.claims_theory import THEORY_CLAIMS
from papers.shao.errata import ERRATA
from papers.shao.experiments import COMMON, EXPERIMENTS, SENSITIVITY
from papers.shao.figures import FIGURES
from papers.shao.findings import findings
from papers.shao.scope import SCOPE
from papers.shao.tables import FORMULAS, TABLES
from replication.audit.judge.perturb import sensitivities
from replication.audit.model import Paper

PAPER = Paper(
    key="shao",
    title=("A New Alternating Predictive Observer Approach for Higher Bandwidth Control of Dual-Rate Dynamic Systems"),
    authors=("Liren Shao", "Jun Yang", "Shihua Li", "Yang Yi"),
    year=None,
    venue="manuscript; its newest reference is of 2022",
    doi="",
    summary=(
        "A sensor delivers the output once in M fast periods of the controller. The alternating predictive observer "
        "feeds its correction with a virtual measurement, predicted by the model, at the instants between. The audit "
        "analyses the loop exactly as a periodic system, searches the readings of its simulation, and tests the "
        "stability theorem."
    ),
    notebook="dualrate",
    bibtex=(
        "@unpublished{shao,\n"
        "  author = {Shao, Liren and Yang, Jun and Li, Shihua and Yi, Yang},\n"
        "  title = {A New Alternating Predictive Observer Approach for Higher Bandwidth Control of Dual-Rate Dynamic "
        "Systems},\n"
        "  note = {Undated manuscript}\n"
        "}"
    ),
    experiments=EXPERIMENTS,
    claims=(*THEORY_CLAIMS, *MOTOR_CLAIMS, *COMPARISONS, ANY_READING, *TABLE_CELLS),
    errata=ERRATA,
    figures=FIGURES,
    tables=TABLES,
    formulas=FORMULAS,
    scope=SCOPE,
    findings=findings,
    common=lambda results: common.common(results[COMMON], list(MULTIPLES)),
    sensitivity=lambda results: sensitivities(results[SENSITIVITY]),
)
