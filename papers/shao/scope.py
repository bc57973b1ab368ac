"""What of the manuscript is audited, and what is not and why."""

from papers.shao.claims_motor import MOTOR_CLAIMS
from papers.shao.claims_table import TABLE_CELLS
from replication.audit.model import ScopeItem

SCOPE = (
    ScopeItem(
        part="Sec. I: works like a loop with a fast sensor, higher bandwidth",
        claims=("shao.theory.fast-sensor", "shao.order.bandwidth"),
        figures=("shao-error-frequency",),
    ),
    ScopeItem(part="Secs. I and II: motivation and literature", reason="Words without a checkable quantity."),
    ScopeItem(
        part="Sec. III: observer and its discrete form, eqs. (1) to (8)",
        claims=("shao.theory.discrete-observer",),
        figures=("shao-lag",),
    ),
    ScopeItem(
        part="Dots over symbols",
        reason=(
            "The text at hand is a conversion, which loses dots easily: the misprints shao.feedforward-orders and "
            "shao.third-state may be its own."
        ),
    ),
    ScopeItem(part="Fig. 1", reason="A block diagram; it holds no data."),
    ScopeItem(
        part="Sec. IV: stability theorem, eqs. (9) to (22)",
        claims=(
            "shao.theory.error-equations",
            "shao.theory.lyapunov",
            "shao.theory.output-bounds",
            "shao.theory.estimate-bound",
            "shao.theory.prediction-bound",
            "shao.theory.condition",
            "shao.theory.contraction",
            "shao.theory.stability",
        ),
        figures=("shao-rates", "shao-motor-eigenvalues"),
    ),
    ScopeItem(
        part="Sec. IV: eqs. (11), (16), (17), (19) to (21)",
        reason=(
            "Algebra that follows from (10) and (12) to (15): (15) is the step that fails, and the theorem is refuted "
            "as a whole."
        ),
    ),
    ScopeItem(
        part="Sec. V: motor model, parameters, gains, feedforward",
        claims=tuple(claim.id for claim in MOTOR_CLAIMS),
    ),
    ScopeItem(
        part="Sec. V: stability of the three controllers",
        claims=("shao.stability.src", "shao.stability.pmi", "shao.stability.apo"),
        figures=("shao-stable-sets",),
    ),
    ScopeItem(
        part="Figs. 2 and 3",
        claims=("shao.order.estimate-2", "shao.order.estimate-3", "shao.order.transient"),
        figures=("shao-fig2", "shao-fig3", "shao-robustness"),
    ),
    ScopeItem(
        part="Curves of Figs. 2 and 3, point by point",
        reason="The text at hand holds no image and no data of the curves.",
    ),
    ScopeItem(
        part="Table I and what is concluded from it",
        claims=(
            *(claim.id for claim in TABLE_CELLS),
            "shao.table.any-reading",
            "shao.order.apo-below-pmi",
            "shao.order.growth-pmi",
            "shao.order.growth-apo",
        ),
        figures=("shao-readings",),
    ),
)
