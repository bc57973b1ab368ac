"""The audit of Shao, Yang, Li and Yi: what it covers, in the order of the manuscript, and what it shows."""

from papers.shao import common
from papers.shao.brief import BRIEF
from papers.shao.claims.columns import WHOLE
from papers.shao.claims.comparison import RESPONSES, STABILITY
from papers.shao.claims.introduction import ABSTRACT, INTRODUCTION
from papers.shao.claims.motor import MOTOR
from papers.shao.claims.orders import CONCLUDED
from papers.shao.claims.table import TABLE
from papers.shao.claims.theory import OBSERVER, THEOREM
from papers.shao.errata import ERRATA
from papers.shao.experiments.declared import EXPERIMENTS
from papers.shao.figures import readings as reading_figures
from papers.shao.figures import responses as response_figures
from papers.shao.figures import robustness as robustness_figures
from papers.shao.figures import stability as stability_figures
from papers.shao.figures import tracking as tracking_figures
from papers.shao.findings import findings
from papers.shao.printed import REFERENCES
from papers.shao.readings import READINGS
from replication.audit.about import about
from replication.audit.declare import Part, paper
from replication.audit.judge.perturb import sensitivities
from replication.audit.parts import Formula, Table

PAPER = paper(
    **about(__file__),
    parts=(
        ABSTRACT,
        INTRODUCTION,
        Part("Sec. I: motivation and literature", reason="Words without a checkable quantity."),
        Part("Sec. II: problem formulation", reason="Definitions: plant, fast and slow period, held input and output."),
        OBSERVER,
        Part(
            "Sec. III: updates as fast as the actuator, an observation close to the measurement",
            reason="Properties of the design by its definition, and words without a checkable quantity.",
        ),
        Part(
            "Dots over symbols",
            reason=(
                "The text at hand is a conversion, which misreads dots easily: the misprints shao.feedforward-orders "
                "and shao.third-state may be its own."
            ),
        ),
        Part("Fig. 1", reason="A block diagram; it holds no data."),
        THEOREM,
        Part(
            "Sec. IV: eqs. (11), (16), (19) to (21)",
            reason=(
                "Steps between (10), (12) to (15), (17) and (22), read and not tested by a claim: (15) is the step "
                "that fails, and the stability result is refuted as a whole."
            ),
        ),
        MOTOR,
        STABILITY,
        RESPONSES,
        Part(
            "Curves of Figs. 2 and 3, point by point",
            reason="The text at hand holds no image and no data of the curves.",
        ),
        TABLE,
        WHOLE,
        CONCLUDED,
        Part(
            "Sec. VI: conclusion",
            also=("theory.stability", "order.transient", "order.apo-below-pmi", "order.bandwidth", "theory.condition"),
        ),
        Part(
            "Sec. V and VI: simple implementation, more complex systems",
            reason="Words without a checkable quantity, and work to come.",
        ),
    ),
    readings=READINGS,
    experiments=EXPERIMENTS,
    errata=ERRATA,
    figures=(
        *response_figures.FIGURES,
        *robustness_figures.FIGURES,
        *tracking_figures.FIGURES,
        *stability_figures.FIGURES,
        *reading_figures.FIGURES,
    ),
    tables=(
        Table(
            place="Table I",
            caption=(
                "Largest tracking error over the amplitude of the reference, percent; ours as the text reads "
                "literally, with SRC from ζ(0) = 0"
            ),
            header=("Reference", "SRC", "DRC-PMI", "DRC-APO"),
            rows=tuple(
                (
                    reference,
                    f"claim:table.src-{number}|–|unstable",
                    *(f"claim:table.{c}-{number}" for c in ("pmi", "apo")),
                )
                for number, reference in enumerate(REFERENCES, 1)
            ),
        ),
    ),
    formulas=(
        Formula(
            text="The observer between fast instants, with a measured or a virtual output",
            latex=r"\dot{\zeta}(t) = (A - LC)\zeta(t) + B u(t_k) + L \bar{y}(t_k)",
        ),
        Formula(
            text="The virtual measurement (6) as printed",
            latex=r"y_p(t_k) = C\left(\bar{A}\zeta(t_{k-1}) + \bar{B}u(t_{k-1})\right)",
        ),
        Formula(
            text="The virtual measurement restarted at each true one",
            latex=r"y_p(t_k) = \bar{y}(t_{k-1}) + C\left((\bar{A} - I)\zeta(t_{k-1}) + \bar{B}u(t_{k-1})\right)",
        ),
        Formula(
            text="The error of the virtual measurement (6), which does not vanish as T goes to zero",
            latex=r"y_p(t_k) - y(t_k) = -C e^{AT}\xi(t_{k-1})",
        ),
    ),
    findings=findings,
    brief=BRIEF,
    sensitivity=lambda results: sensitivities(results["sensitivity"]),
    common=common.common,
)
