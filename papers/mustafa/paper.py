"""The audit of the nonuniform-sampling paper: its parts in the order of the text, and what is said of it."""

from __future__ import annotations

from papers.mustafa import common
from papers.mustafa.brief import BRIEF
from papers.mustafa.claims.algorithm import ALGORITHM_1
from papers.mustafa.claims.examples import LEVELS, RESPONSE
from papers.mustafa.claims.extensions import ROBUST_PERFORMANCE
from papers.mustafa.claims.guarantees import ABSTRACT
from papers.mustafa.claims.main_results import THEOREM_1, THEOREM_2, THEOREM_3
from papers.mustafa.claims.preliminaries import LEMMAS
from papers.mustafa.errata import ERRATA
from papers.mustafa.experiments.declared import EXPERIMENTS, TRIED
from papers.mustafa.figures import gains, responses
from papers.mustafa.findings import findings
from papers.mustafa.printed import EXAMPLES
from papers.mustafa.readings import READINGS
from replication.audit.declare import Part, paper
from replication.audit.judge.printed import sensitivities
from replication.audit.parts import Formula, Table
from replication.audit.project import about

FORMULAS = (
    Formula(
        text="Error system, eq. (5), with the sampling period in the plant's blocks only",
        latex=(
            r"\bar{x}_{k+1} = \begin{bmatrix} \Phi(h_k) & 0 \\ B_f C & A_f \end{bmatrix} \bar{x}_k"
            r" + \begin{bmatrix} \Gamma(h_k) \\ B_f D \end{bmatrix} w_k"
        ),
    ),
    Formula(
        text="Path-dependent Lyapunov inequality behind the proved level g: c begins the coming periods, d is next",
        latex=r"e^T e + \bar{x}_{+}^T P_d \bar{x}_{+} \le \bar{x}^T P_c \bar{x} + g^2 w^T w",
    ),
)

PARTS = (
    ABSTRACT,
    Part("Sec. I, related work", reason="Statements about other papers; their texts are not at hand."),
    Part("Sec. II", reason="Definitions, by which gains are computed here."),
    LEMMAS,
    Part("Fig. 1, block diagram", reason="A drawing without data; Lemma 2 is audited."),
    THEOREM_1,
    Part(
        "Eq. (9), cases L1, L2, U1 and U2",
        reason="Limits of the same integral as L3 and U3, as mu tends to zero or below −alpha; no example meets them.",
    ),
    THEOREM_2,
    Part("Theorem 2, proof", reason="Its conclusion is proved in another way, without the condition (8)."),
    THEOREM_3,
    ALGORITHM_1,
    ROBUST_PERFORMANCE,
    Part("Eq. (13)", reason="Announced but missing in the text at hand; a reconstruction of ours is used."),
    Part("Sec. V-B, continuous-time performance", reason="A remark without a computation."),
    LEVELS,
    RESPONSE,
)

LEVELS_TABLE = Table(
    place="Sec. VI",
    caption="Printed levels, whether each holds for every sampling sequence (norms count samples), and how many "
    "elements the grids have.",
    header=("Example", "level at one period", "for every sequence", "elements of the grid"),
    rows=tuple((str(e), *(f"claim:{name}.{e}" for name in ("gamma", "robust-level", "grid"))) for e in EXAMPLES),
)

PAPER = paper(
    **about(__file__),
    parts=PARTS,
    experiments=EXPERIMENTS,
    errata=ERRATA,
    figures=(*responses.FIGURES, *gains.FIGURES),
    tables=(LEVELS_TABLE,),
    formulas=FORMULAS,
    readings=READINGS,
    findings=findings,
    brief=BRIEF,
    common=lambda results: common.common(results["common"], TRIED),
    sensitivity=lambda results: tuple(move for e in EXAMPLES for move in sensitivities(results[f"sensitivity.{e}"])),
)
