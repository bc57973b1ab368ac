"""The audit of Okajima, Hosoe and Hagiwara (2023): parts, tables, formulas and what the paper is."""

from __future__ import annotations

from papers._common import MULTIPLES
from papers.okajima2023 import common
from papers.okajima2023.brief import BRIEF
from papers.okajima2023.claims import blog, formulation, levels, simulation, theorems, timing, unstable
from papers.okajima2023.errata import ERRATA
from papers.okajima2023.experiments.declared import EXPERIMENTS, table_claim
from papers.okajima2023.figures import periods, responses
from papers.okajima2023.findings import findings
from papers.okajima2023.printed import TABLE_1
from papers.okajima2023.readings import READINGS
from replication.audit.declare import Part, paper
from replication.audit.judge.printed import sensitivities
from replication.audit.parts import Formula, Table
from replication.audit.project import about

PARTS = (
    Part("Abstract", reason="Says in short what is audited where the paper says it."),
    Part(
        "Sec. I, motivation and related work",
        reason="Statements about other papers, whose texts are not at hand, and about ease of implementation.",
    ),
    formulation.EARLIER,
    formulation.FORMULATION,
    Part(
        "Fig. 1, block diagram",
        reason="A drawing without data; its schedules are audited, the D of the sentence on it is an erratum.",
    ),
    Part("Remark 1, on zero measurements", reason="An explanation: the observer knows S_k."),
    theorems.THEOREMS,
    levels.LEVELS,
    Part(
        "Input matrix B_u", reason="It cancels in the error system, as the check of eq. (16) with a random B_u shows."
    ),
    Part(
        "Symbols d_u, d_y1, d_y2 and “standard normal” before Fig. 2",
        reason="The symbols are defined nowhere, and “standard normal” is at odds with the deviations stated; read as "
        "d, w₁ and w₂ with those deviations, zero after k = 500. A common scale of all noises cancels in eq. (34).",
    ),
    simulation.SIMULATION,
    levels.TABLE,
    timing.TIMING,
    simulation.TIMED,
    unstable.UNSTABLE,
    Part(
        "The solver mincx, and computing times",
        reason="Its source is closed, and no time is printed. By its documentation it stops at a relative accuracy of "
        "1 % unless told otherwise.",
    ),
    Part("Sec. V, conclusion", reason="Repeats statements that are audited where they are made."),
    blog.BLOG,
    Part(
        "The author's own program, to which the blog links",
        reason="Public, and not used here. It has another plant and another schedule, and neither Table 1, eq. (34) "
        "nor Sec. IV-C, so it settles none of the open points. It calls mincx with its default options.",
    ),
    Part("Blog: other articles, courses and links", reason="About other works."),
)

TABLES = (
    Table(
        place="Table 1",
        caption="Smallest level for several sensing periods, both sensors at instant 0.",
        header=("N₁, N₂", *(f"{a}, {b}" for a, b in TABLE_1)),
        rows=(("γ", *(f"claim:{table_claim(periods)}" for periods in TABLE_1)),),
    ),
    Table(
        place="Sec. IV-A",
        caption="The multi-rate observer against three dual-rate ones, with a simulated ratio of each: one draw.",
        header=("Observer", "optimal level γ", "simulated ratio, eq. (34)"),
        rows=tuple(
            (who, f"claim:gamma.{'' if name == 'proposed' else 'case-'}{name.lower()}", f"claim:gsim.{name.lower()}")
            for name, who in simulation.WHO.items()
        ),
    ),
    Table(
        place="Sec. IV-B",
        caption="Three timings of two sensors of period 3: smallest level, and l2 gain with the printed gains.",
        header=("Timing", "optimal level γ", "l2 gain with the printed gains"),
        rows=tuple((f"Case {n}, θ₂ = {n - 1}", f"claim:timing.case-{n}", f"claim:gains.eq{37 + n}") for n in (1, 2, 3)),
    ),
)

FORMULAS = (
    Formula(
        text="Error system of the observer, eqs. (16) and (18)",
        latex=r"e(k+1) = (A - L_k S_k C)\,e(k) + B_d\,d(k) - L_k S_k D\,w(k), \qquad z(k) = W e(k)",
    ),
    Formula(
        text="Matrix inequality of Theorem 2, eq. (30), for every phase of the period",
        latex=(
            r"\begin{bmatrix} P_k & P_k A - Y_k S_k C & P_k B_d & -Y_k S_k D \\ \ast & P_{k-1} - W^T W & 0 & 0 \\"
            r" \ast & \ast & \gamma^2 I & 0 \\ \ast & \ast & \ast & \gamma^2 I \end{bmatrix} \succ 0,"
            r" \qquad L_k = P_k^{-1} Y_k"
        ),
    ),
    Formula(
        text="Periodic Riccati recursion used as the independent route, over the sensors measured at each instant",
        latex=(
            r"X_{k+1} = A (I + X_k G_k)^{-1} X_k A^T + B_d B_d^T, \qquad"
            r" G_k = (S_k C)^T (S_k D D^T S_k^T)^{+} S_k C - \gamma^{-2} W^T W"
        ),
    ),
    Formula(
        text="Non-causal bound: no estimator, not even a smoother that knows all measurements, has a smaller gain; T_x "
        "leads from d to W x, T_y from d to the measurements, each scaled so that its noise has unit size",
        latex=r"\gamma_{nc}^2 = \sup_\omega \lambda_{\max}\left(T_x^* T_x,\; I + T_y^* T_y\right)",
    ),
)

PAPER = paper(
    **about(__file__),
    parts=PARTS,
    readings=READINGS,
    experiments=EXPERIMENTS,
    errata=ERRATA,
    figures=(*responses.FIGURES, *periods.FIGURES),
    tables=TABLES,
    formulas=FORMULAS,
    findings=findings,
    brief=BRIEF,
    common=lambda results: common.common(results["common"], list(MULTIPLES)),
    sensitivity=lambda results: sensitivities(results["sensitivity"]),
)
