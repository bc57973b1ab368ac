"""Sec. X, Example 4: the cells of Table I, how the cost grows, and whether the system is unstable."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from papers.peet2019.printed import published
from papers.peet2019.runs import DEFAULT_CELLS, SMALL_CONE_CELLS
from replication.audit.declare import Part, below, positive
from replication.audit.model import Evidence, Kind, Results, SolverRecord

SAME = 2.0
"""Cells of the same product n·K whose cost differs by less than this factor count as equal."""

FROM_PRODUCT = 5
"""Smaller products take fractions of a second, where the print is dominated by overhead."""

SMALL_CONE = (
    "A certificate in a smaller cone, with one moment of each history; rewritten in the matrices of degree 1 it is "
    "checked on all equalities of the full program."
)
MEASURED_AS = {"total": "full cone", "bessel": "small cone", "plain": "full cone by cvxpy and Clarabel"}

EXAMPLE_4 = Part("Example 4 and Table I", figures="cost")


def exponent(points: list[tuple[float, float]]) -> float:
    """Slope of log(cost) against log(product), least squares."""
    x = [math.log(product) for product, _ in points]
    y = [math.log(cost) for _, cost in points]
    mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True)) / sum((a - mean_x) ** 2 for a in x)


@EXAMPLE_4.feasible("ex4.unstable", place="Sec. X, Example 4", pinned="differs", uses="roots")
def instability(results: Results) -> Evidence:
    """The system of Example 4 is unstable."""
    one, zero = (results["roots"][name]["largest"] for name in ("one", "zero"))
    return positive(
        max(one, zero),
        method="Rightmost roots over all cells: scalar factors s + Σe^{-si/K}/K for eigenvalue 1, s for eigenvalue 0.",
        quantities={"largest root, eigenvalue 1 [1/s]": one, "largest root, eigenvalue 0 [1/s]": zero},
        note=(
            "The eigenvalue of the Jordan block is not printed. With 1 the system is stable; with 0 all roots are at "
            "zero, so that it is unstable only in the sense of growth like a power of time, for n > 1."
        ),
    )


def cell(states: int, delays: int, run: str, results: Results) -> Evidence:
    """Cited seconds, with what our run of the same cell found and what it once took us; run: its experiment or ""."""
    ours = [c for c in results["measured"]["cells"] if (c["states"], c["delays"]) == (states, delays)]
    quantities = {
        f"our CPU seconds, {MEASURED_AS[c['cone']]}": c["cpu_seconds"] for c in ours if c["cpu_seconds"] is not None
    }
    where = sorted({f"{c['machine']}, {c['date']}" for c in ours})
    reason = f"CPU seconds of another machine; ours, measured on {'; '.join(where)}, stand beside them."
    if not run:
        small = next(c for c in ours if c["cone"] == "bessel")
        quantities |= {
            "equalities, small cone": float(small["equalities"]),
            "level certified": small["gamma"],
            "residual of the certificate in the full program": small["residual"],
        }
        again = "This cell is not part of the default run: `benchmarks/bench_delay.py --full` measures it again."
        return Evidence(method="", not_checkable=reason, quantities=quantities, note=again)
    found = results[run]
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


for _n, _k, _seconds in published():
    _run = f"ex4.n{_n}k{_k}" if (_n, _k) in DEFAULT_CELLS + SMALL_CONE_CELLS else ""
    EXAMPLE_4.claim(
        Kind.CITED,
        f"table1.n{_n}k{_k}",
        _seconds,
        statement=f"CPU seconds of Example 4 with {_n} states and {_k} delays.",
        uses=("measured", _run) if _run else "measured",
    )(partial(cell, _n, _k, _run))


@EXAMPLE_4.order("table1.function-of-product", place="Sec. X, Example 4", uses=("sizes", "measured"))
def function_of_product(results: Results) -> Evidence:
    """The cost is approximately a function of the product of delays and states."""
    cost = {(n, k): float(seconds) for n, k, seconds in published() if n * k >= FROM_PRODUCT}
    sizes = {(c["states"], c["delays"]): c["equalities"] for c in results["sizes"]["cells"]}
    ratio = _largest_ratio(cost, cost)
    return below(
        ratio,
        SAME,
        "The paper says that the cost depends on n·K and not how closely: within a factor of this.",
        method="Printed seconds of cells (n, K) and (K, n) compared; equalities of our programs for the same cells.",
        quantities={
            "largest ratio, printed seconds": ratio,
            "largest ratio, our equalities": _largest_ratio(sizes, cost),
            "exponent of the printed seconds": exponent([(n * k, value) for (n, k), value in cost.items()]),
            "exponent of our equalities": exponent([(n * k, sizes[n, k]) for n, k in cost]),
            **_measured_growth(results["measured"]["cells"], set(cost)),
        },
    )


def _largest_ratio(of: dict[tuple[int, int], Any], cells: dict[tuple[int, int], float]) -> float:
    """Over the cells, that of (n, K) to (K, n) or of (K, n) to (n, K)."""
    return float(max(max(of[n, k] / of[k, n], of[k, n] / of[n, k]) for n, k in cells if n < k))


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
