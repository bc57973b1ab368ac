"""The author's blog post: the levels that it repeats, and the reasons that it gives."""

from __future__ import annotations

from papers.okajima2023.cases import TIMINGS, case, pair
from papers.okajima2023.claims.levels import level, solvers_of
from papers.okajima2023.printed import DATA
from replication.audit.declare import Part, positive
from replication.audit.model import Evidence, Results

BLOG = Part("Blog post: levels, tables, reasons")
SCHEDULES = tuple(f"schedule.case-{n}" for n in (1, 2, 3))


def _repeated(name: str, printed: str, experiment: str, what: str) -> None:
    level(BLOG, f"blog.{name}", printed, experiment, f"The blog's level for {what}.")


_repeated("proposed", DATA["blog-methods"]["Proposed"], case("proposed"), "the proposed observer")
for _case in "ABC":
    _repeated(f"case-{_case.lower()}", DATA["blog-methods"][f"Case {_case}"], case(_case), f"Case {_case}")
for _n in (1, 3):
    _repeated(f"n{_n}{_n}", DATA["blog-periods"][f"{_n},{_n}"], pair((_n, _n)), f"N₁ = N₂ = {_n}")
for _timing, _printed in zip(TIMINGS, DATA["blog-timing"].items(), strict=True):
    _repeated(f"timing-{_printed[0]}", _printed[1], _timing, f"Case {_printed[0]} of the timing")


@BLOG.order("blog.periodic-matrices", place="Blog, on Theorem 1", uses="constant-matrix")
def periodic_matrices(results: Results) -> Evidence:
    """Periodic matrices P_k make the condition less conservative than one constant matrix."""
    found = results["constant-matrix"]
    return positive(
        found["constant"] - found["periodic"],
        method="Level with one P at every phase minus the level with P_k of their own, N₁ = 2 and N₂ = 1.",
        cross_check=f"The gains of the constant P have the exact norm {found['norm_constant']:.6f}.",
        solvers=solvers_of(found),
        quantities={"level with one P": found["constant"], "level with periodic P": found["periodic"]},
    )


def longest_gap(diagonals: list[list[float]]) -> int:
    """Longest cyclic run of phases in which no sensor measures."""
    idle = "".join("0" if any(row) else "1" for row in diagonals)
    return max(len(run) for run in (idle * 2).split("0"))


@BLOG.value("blog.idle-instants", DATA["blog-idle-instants"], uses=SCHEDULES[0])
def idle_instants(results: Results) -> Evidence:
    """In Case 1 this many consecutive instants pass without any measurement."""
    gap = longest_gap(results[SCHEDULES[0]]["diagonals"])
    return Evidence(method="Counted on the schedule, cyclically.", value=float(gap))


@BLOG.order("blog.evenness", place=DATA["blog-idle-instants"].place, uses=SCHEDULES)
def evenness(results: Results) -> Evidence:
    """In Case 2 the measurements are spread more evenly over time than in Case 1."""
    gaps = [longest_gap(results[name]["diagonals"]) for name in SCHEDULES]
    return positive(
        float(gaps[0] - gaps[1]),
        method="Longest cyclic run without measurement in each case, counted on the schedules.",
        quantities={f"longest gap, Case {n}": float(gap) for n, gap in enumerate(gaps, start=1)},
        note="Cyclically, Case 3 is as even as Case 2 and has the larger optimum: evenness alone does not rank them.",
    )
