"""Which part of the paper is audited by which claims and figures, and what is left out for which reason."""

from __future__ import annotations

from papers.okajima2023.designs import KEY
from replication.audit.model import Claim, ScopeItem


def scope(claims: tuple[Claim, ...]) -> tuple[ScopeItem, ...]:
    """The scope of the audit; `claims` are all claims, found here by the beginnings of their ids."""

    def _ids(*prefixes: str) -> tuple[str, ...]:
        return tuple(
            claim.id for claim in claims if claim.id.startswith(tuple(f"{KEY}.{prefix}" for prefix in prefixes))
        )

    def _figures(*numbers: int) -> tuple[str, ...]:
        return tuple(f"{KEY}-fig{number}" for number in numbers)

    return (
        ScopeItem(part="Sec. I, size of the earlier design", claims=_ids("size.cyclic")),
        ScopeItem(part="Sec. I, related work", reason="Statements about other papers; their texts are not at hand."),
        ScopeItem(part="Sec. II, plant, schedules, observer, error system",
                  claims=_ids("schedule.", "theory.observable", "theory.product", "theory.error-system",
                              "theory.dual-rate")),
        ScopeItem(part="Fig. 1, block diagram", reason="A drawing without data; its schedules are audited."),
        ScopeItem(part="Sec. III, Theorems 1 and 2",
                  claims=_ids("theory.dissipation", "theory.schur", "theory.theorem", "theory.gains", "theory.stable")),
        ScopeItem(part="Sec. IV-A, levels, gains (33), size of the inequality",
                  claims=(*_ids("gamma.", "gains.eq33", "gains.unmeasured", "size.variables", "size.rows"),
                          f"{KEY}.order.proposed-best")),
        ScopeItem(part="Sec. IV-A, simulation, eq. (34), Figs. 2-5", claims=_ids("gsim.", "simulation."),
                  figures=(*_figures(2, 3, 4, 5), f"{KEY}-worst")),
        ScopeItem(part="Table 1", claims=_ids("table1.", "order.shorter"), figures=(f"{KEY}-periods",)),
        ScopeItem(part="Sec. IV-B, timing, gains (38)-(40), Figs. 6-8",
                  claims=_ids("timing.", "gains.eq38", "gains.eq39", "gains.eq40", "gains.depend", "order.timing"),
                  figures=(*_figures(6, 7, 8), f"{KEY}-timing")),
        ScopeItem(part="Sec. IV-C, unstable plant, gains (42)", claims=_ids("unstable.")),
        ScopeItem(part="Blog post: levels, tables, reasons", claims=_ids("blog.")),
        ScopeItem(part="Remark 1, on zero measurements", reason="An explanation: the observer knows S_k."),
        ScopeItem(part="Sec. V, conclusion", reason="Repeats statements that are audited where they are made."),
        ScopeItem(part="Symbols d_u, d_y1, d_y2 before Fig. 2",
                  reason="Defined nowhere; read as d, w₁ and w₂, which are zero after k = 500."),
        ScopeItem(part="Computing times, and the solver mincx itself", reason="None printed; closed source."),
        ScopeItem(part="Input matrix B_u",
                  reason="It cancels in the error system, as the check of eq. (16) with a random B_u shows."),
    )  # fmt: skip
