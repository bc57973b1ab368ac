"""Example 4: the cells of Table I, how the cost grows, and whether the system is unstable."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from papers.peet2019 import data, names
from papers.peet2019.data import KEY
from replication.audit.model import Claim, Evidence, Kind, Results, SolverRecord, Verdict

SAME = 2.0
"""Cells of the same product n·K whose cost differs by less than this factor count as equal."""

FROM_PRODUCT = 5
"""Smaller products take fractions of a second, where the print is dominated by overhead."""


SMALL_CONE = (
    "A certificate in a smaller cone, with one moment of each history; rewritten in the matrices of degree 1 it is "
    "checked on all equalities of the full program."
)


def published() -> list[tuple[int, int, float]]:
    """(n, K, seconds) of every printed cell but N/A."""
    cells = [(n, k, data.seconds(n, k)) for k in data.DELAY_COUNTS for n in data.STATES]
    return [(n, k, float(text)) for n, k, text in cells if text != "N/A"]


def exponent(points: list[tuple[float, float]]) -> float:
    """Slope of log(cost) against log(product), least squares."""
    x = [math.log(product) for product, _ in points]
    y = [math.log(cost) for _, cost in points]
    mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True)) / sum((a - mean_x) ** 2 for a in x)


MEASURED_AS = {"total": "full cone", "bessel": "small cone", "plain": "full cone by cvxpy and Clarabel"}


def cell(states: int, delays: int) -> Callable[[Results], Evidence]:
    """An answer: cited seconds, with what our run of the same cell found and what it once took us."""

    def cost(results: Results) -> Evidence:
        ours = [c for c in results[names.MEASURED]["cells"] if (c["states"], c["delays"]) == (states, delays)]
        quantities = {
            f"our CPU seconds, {MEASURED_AS[c['cone']]}": c["cpu_seconds"] for c in ours if c["cpu_seconds"] is not None
        }
        where = sorted({f"{c['machine']}, {c['date']}" for c in ours})
        reason = f"CPU seconds of another machine; ours, measured on {'; '.join(where)}, stand beside them."
        found = results.get(names.cell(states, delays))
        if found is None:
            small = next(c for c in ours if c["cone"] == "bessel")
            quantities |= {
                "equalities, small cone": float(small["equalities"]),
                "level certified": small["gamma"],
                "residual of the certificate in the full program": small["residual"],
            }
            again = "This cell is not part of the default run: `benchmarks/bench_delay.py --full` measures it again."
            return Evidence(method="", not_checkable=reason, quantities=quantities, note=again)
        quantities |= {"equalities": float(found["equalities"]), "level reached": found["gamma"]}
        if "full" in found:
            quantities |= {
                "equalities of the full program of degree 1": float(found["full"]["equalities"]),
                "residual of the certificate there": found["full"]["residual"],
                "least eigenvalue of its matrices there": found["full"]["least_eigenvalue"],
            }
        return Evidence(
            method="",
            not_checkable=reason,
            quantities=quantities,
            solvers=(SolverRecord(**found["solver"]),),
            note=SMALL_CONE if "full" in found else "",
        )

    return cost


def function_of_product(results: Results) -> Evidence:
    """Printed cells with n and K exchanged, and the growth of the cost and of the number of equalities."""
    cost = {(n, k): value for n, k, value in published() if n * k >= FROM_PRODUCT}
    ratios = [max(cost[n, k] / cost[k, n], cost[k, n] / cost[n, k]) for n, k in cost if n < k]
    sizes = {(c["states"], c["delays"]): c["equalities"] for c in results[names.SIZES]["cells"]}
    ours = [max(sizes[n, k] / sizes[k, n], sizes[k, n] / sizes[n, k]) for n, k in cost if n < k]
    return Evidence(
        method="Printed seconds of cells (n, K) and (K, n) compared; equalities of our programs for the same cells.",
        holds=max(ratios) < SAME,
        margin=SAME - max(ratios),
        threshold=SAME,
        threshold_reason="The paper says that the cost depends on n·K and not how closely: within a factor of this.",
        quantities={
            "largest ratio, printed seconds": max(ratios),
            "largest ratio, our equalities": max(ours),
            "exponent of the printed seconds": exponent([(n * k, value) for (n, k), value in cost.items()]),
            "exponent of our equalities": exponent([(n * k, sizes[n, k]) for n, k in cost]),
            **_measured_growth(results[names.MEASURED]["cells"], set(cost)),
        },
    )


def _measured_growth(cells: list[dict[str, Any]], chosen: set[tuple[int, int]]) -> dict[str, float]:
    """Exponents of our CPU seconds over those cells that were measured, and what the cell left out in Table I took."""
    found = {}
    for cone, label in MEASURED_AS.items():
        seconds = {(c["states"], c["delays"]): c["cpu_seconds"] for c in cells if c["cone"] == cone}
        points = [(float(n * k), value) for (n, k), value in seconds.items() if (n, k) in chosen and value is not None]
        found[f"exponent of our CPU seconds, {label}"] = exponent(points)
        for n, k in seconds.keys() - {(n, k) for n, k, _ in published()}:
            found[f"our CPU seconds for n = {n}, K = {k}, which Table I leaves out, {label}"] = seconds[n, k]
    return found


def instability(results: Results) -> Evidence:
    """Rightmost roots of Example 4 for both readings of the Jordan block."""
    found = results[names.ROOTS]
    return Evidence(
        method="Rightmost roots over all cells: scalar factors s + Σe^{-si/K}/K for eigenvalue 1, s for eigenvalue 0.",
        holds=max(found["one"]["largest"], found["zero"]["largest"]) > 0.0,
        margin=max(found["one"]["largest"], found["zero"]["largest"]),
        quantities={
            "largest root, eigenvalue 1 [1/s]": found["one"]["largest"],
            "largest root, eigenvalue 0 [1/s]": found["zero"]["largest"],
        },
        note=(
            "The eigenvalue of the Jordan block is not printed. With 1 the system is stable; with 0 all roots are at "
            "zero, so that it is unstable only in the sense of growth like a power of time, for n > 1."
        ),
    )


def _claim(states: int, delays: int) -> Claim:
    run = (states, delays) in (*names.default_cells(), *names.small_cone_cells())
    return Claim(
        id=f"{KEY}.table1.n{states}k{delays}",
        place=f"Table I, n = {states}, K = {delays}",
        kind=Kind.CITED,
        statement=f"CPU seconds of Example 4 with {states} states and {delays} delays.",
        expected=Verdict.NOT_CHECKABLE,
        answer=cell(states, delays),
        uses=(names.MEASURED, *((names.cell(states, delays),) if run else ())),
        printed=data.seconds(states, delays),
    )


CLAIMS: tuple[Claim, ...] = (
    *(_claim(n, k) for n, k, _ in published()),
    Claim(
        id=f"{KEY}.table1.function-of-product",
        place="Sec. X, Example 4",
        kind=Kind.ORDER,
        statement="The cost is approximately a function of the product of delays and states.",
        expected=Verdict.CONSISTENT,
        answer=function_of_product,
        uses=(names.SIZES, names.MEASURED),
    ),
    Claim(
        id=f"{KEY}.ex4.unstable",
        place="Sec. X, Example 4",
        kind=Kind.FEASIBLE,
        statement="The system of Example 4 is unstable.",
        expected=Verdict.DIFFERS,
        answer=instability,
        uses=(names.ROOTS,),
    ),
)
