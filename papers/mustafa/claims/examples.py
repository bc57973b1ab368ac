"""Sec. VI: both levels, what they hold for, the levels of other papers, the printed filter, Figs. 2 and 3."""

from __future__ import annotations

from functools import partial
from typing import Any

from papers.mustafa.claims.extensions import solvers
from papers.mustafa.experiments.draws import DRAWS, merged
from papers.mustafa.experiments.levels import ABOVE
from papers.mustafa.printed import DATA, GAMMA, matrix
from replication.audit.declare import Part
from replication.audit.model import Evidence, Results

ABSTRACT = Part("Abstract, Secs. I and VII: what the filter guarantees")
LEVELS = Part(
    "Sec. VI, levels, filter, comparison", also=("stable.1", "stable.2"), figures=("levels", "range", "worst")
)
RESPONSE = Part("Figs. 2 and 3", figures=("fig2", "fig3"))

PRINTED_FILTER, COLUMNS = DATA["filter"], DATA["columns-of-A_f"]

FILTER = {
    1: f"our filter at the optimum times 1 + {ABOVE:.0e} (the paper prints none)",
    2: "the printed filter",
}
"""The filter that stands for the paper's."""


def routes(r: dict[str, Any]) -> tuple[str, dict[str, float]]:
    """The optimum of (10) at one period by three further routes: as text, and relative to the formula."""
    levels = {
        "Riccati": r["riccati"],
        "LMI": r["lmi"]["level"],
        "LMI through cvxpy": r["printed_lmi"]["level"],
        "norm of the LMI's filter": r["lmi"]["norm"],
    }
    told = (
        f"Riccati bisection {r['riccati']:.12f}; LMI {r['lmi']['level']:.12f} ({r['lmi']['status']}), exact norm of "
        f"its filter {r['lmi']['norm']:.12f}."
    )
    return told, {f"{name} over formula, relative": level / r["formula"] - 1 for name, level in levels.items()}


def where_it_holds(e: int, results: Results) -> str:
    """The constant sampling periods at which the printed level holds to its digits, as a sentence."""
    c = results[f"curve.{e}"]
    return (
        f"For {FILTER[e]} the level holds, to its printed digits, at constant sampling periods from "
        f"{c['holds_from']:.5f} to {c['holds_to']:.5f} s around the middle {c['middle']:.5f} s of the range."
    )


def guaranteed(e: int, results: Results) -> Evidence:
    """Whether the printed level holds for every sequence in the range."""
    r, d, printed = results[f"bracket.{e}"], results[f"bracket-duration.{e}"], float(GAMMA[e])
    return Evidence(
        method="Worst-case l2 gain over all sampling sequences: a sequence that is at hand below, a path-dependent "
        "Lyapunov function for the continuum of periods above.",
        cross_check="The lower end is a simulated ratio; the upper one is checked without the solver.",
        lower=r["lower"],
        upper=r["upper"],
        value=r["lower"],
        holds=r["lower"] <= printed,
        margin=printed - r["lower"],
        quantities={
            "upper over lower": r["upper"] / r["lower"],
            "lower over printed": r["lower"] / printed,
            "one Lyapunov function": r["common"],
            "leaves of the context tree": float(r["leaves"]),
            "duration-weighted, lower": d["lower"],
            "duration-weighted, upper": d["upper"],
        },
        solvers=solvers(r),
        note="The abstract, step 3 and Sec. VII read as if the level held for every sequence. Sec. V-A says that "
        "it is nominal, and Sec. VI-B says so of the level of Example 2. "
        f"The bracket is that of {FILTER[e]}. {where_it_holds(e, results)}",
    )


for e, place in ((1, "Sec. VI-A; abstract; Sec. VII"), (2, "abstract; Sec. VII")):
    ABSTRACT.feasible(
        f"robust-level.{e}",
        place=place,
        statement=f"The level of Example {e} holds for all possible variations of the sampling period.",
        uses=(f"bracket.{e}", f"bracket-duration.{e}", f"curve.{e}"),
        pinned="differs",
    )(partial(guaranteed, e))


def beside(e: int, others: str, remark: str, results: Results) -> Evidence:
    """The levels of other papers beside the true gain: not like with like, and no order is claimed."""
    r = results[f"bracket.{e}"]
    return Evidence(
        method=f"True worst-case gain over all sampling sequences of {FILTER[e]}.",
        value=r["lower"],
        lower=r["lower"],
        upper=r["upper"],
        quantities={
            "robust design with one Lyapunov function, guaranteed": results[f"robust.{e}"]["guaranteed"],
            "duration-weighted gain, upper": results[f"bracket-duration.{e}"]["upper"],
        },
        not_checkable=f"The paper sets {GAMMA[e]} and {others} side by side and claims no order. "
        f"{remark} The printed level is nominal; over all sequences the gain of {FILTER[e]} lies between "
        f"{r['lower']:.4f} and {r['upper']:.4f}.",
    )


def compared(e: int, reference: int, others: str, statement: str, remark: str) -> None:
    """Declare the claim that sets the level of an example beside those of a reference."""
    LEVELS.order(
        f"compare.{reference}",
        place=GAMMA[e].place,
        statement=statement,
        uses=(f"bracket.{e}", f"robust.{e}", f"bracket-duration.{e}"),
        pinned="not checkable",
    )(partial(beside, e, others, remark))


@LEVELS.value("gamma.1", GAMMA[1], uses=("nominal.1", "curve.1"))
def nominal_optimum(results: Results) -> Evidence:
    """A filter with the printed level is found in Example 1; it is the least level of step 2."""
    r = results["nominal.1"]
    told, relative = routes(r)
    return Evidence(
        method="Closed form of the optimum of (10) at the one period of the grid.",
        cross_check=told,
        value=r["formula"],
        quantities=relative,
        solvers=solvers(r),
        note=where_it_holds(1, results),
    )


for name, level in DATA["gamma-13"].items():
    LEVELS.cited(
        f"cited.13-{name.replace(' ', '-')}",
        level,
        statement=f"The level of the {name} filter of reference [13].",
        reason="A level of a paper that is not at hand; its performance index is in continuous time, as the text says.",
    )
compared(
    1,
    13,
    " and ".join(f"{level} ({name})" for name, level in DATA["gamma-13"].items()),
    "The level of Example 1 stands beside those of both filters of [13].",
    "It remarks that the index of [13] is in continuous time, its own is not.",
)
LEVELS.cited(
    "cited.14",
    DATA["gamma-14"],
    statement="The level of the filter of reference [14].",
    reason="A level of a paper that is not at hand; the text calls that filter robust and does not say for which "
    "index.",
)


@LEVELS.feasible("gamma.2", GAMMA[2], uses=("nominal.2", "bracket.2", "curve.2"))
def level_is_found(results: Results) -> Evidence:
    """A filter with the printed level is found in Example 2."""
    r, norm, printed = results["nominal.2"], results["bracket.2"]["nominal"], float(GAMMA[2])
    told, relative = routes(r)
    return Evidence(
        method="Exact H-infinity norm of (5) with the printed filter at the printed grid period, against the level.",
        cross_check=f"Infimum over all filters by closed form {r['formula']:.12f}. {told}",
        value=norm,
        holds=norm <= printed,
        margin=printed - norm,
        quantities={
            "infimum over all filters": r["formula"],
            "printed level over infimum, relative": printed / r["formula"] - 1,
            **relative,
        },
        solvers=solvers(r),
        note="The paper finds a filter with this level and does not call it the least one; step 2 minimises, and the "
        f"infimum is smaller. {where_it_holds(2, results)}",
    )


compared(
    2,
    14,
    f"{DATA['gamma-14']} ([14])",
    "The level of Example 2 stands beside that of the robust filter of [14].",
    "It notes that its own is based on the nominal condition.",
)


@LEVELS.value("filter.norm", GAMMA[2], uses=("bracket.2", "nominal.2"))
def norm_of_printed_filter(results: Results) -> Evidence:
    """The printed filter attains the printed level at the printed grid period."""
    norm, best = results["bracket.2"]["nominal"], results["nominal.2"]["formula"]
    return Evidence(
        method="Exact H-infinity norm of (5) with the printed filter at the printed grid period.",
        value=norm,
        quantities={"optimum": best, "printed filter over optimum, relative": norm / best - 1},
    )


def undetermined(name: str, results: Results) -> Evidence:
    """Two filters keep the printed level and differ in this matrix, so the level does not determine it."""
    r, norm = results["nominal.2"], results["bracket.2"]["nominal"]
    rows, printed = r["filter"][name], matrix(PRINTED_FILTER[f"{name}_f"])
    apart = max(abs(a - b) for row, other in zip(rows, printed, strict=True) for a, b in zip(row, other, strict=True))
    both = "both keep" if max(norm, r["riccati_norm"]) <= float(GAMMA[2]) else "do not both keep"
    return Evidence(
        method="Riccati filter at the nominal optimum, beside the printed one.",
        value=tuple(tuple(row) for row in rows),
        quantities={
            "largest difference of an entry": apart,
            "norm of the Riccati filter": r["riccati_norm"],
            "norm of the printed filter": norm,
        },
        not_checkable="The paper gives the filter that it found and calls it neither unique nor optimal. With "
        f"D = 0 the infimum is degenerate: the filter there and the printed one {both} the printed level, and "
        f"differ by up to {apart:.4f} in this matrix. Which one a solver returns depends on where it stops, which "
        "is not stated. What does not depend on it is checked by itself: the norm, A_f "
        "as Phi - B_f C, and C_f.",
    )


for name, called in (("A", "state"), ("B", "input")):
    LEVELS.matrix(
        f"filter.{called}-matrix",
        PRINTED_FILTER[f"{name}_f"],
        statement=f"{name}_f of the filter that is found.",
        uses=("nominal.2", "bracket.2"),
        pinned="not checkable",
    )(partial(undetermined, name))


@LEVELS.matrix("filter.output-matrix", PRINTED_FILTER["C_f"], uses="nominal.2")
def output_matrix(results: Results) -> Evidence:
    """C_f of the filter is L, as at the optimum."""
    return Evidence(
        method="Riccati filter at the nominal optimum, which tends to K = Phi Gamma (C Gamma)^-1.",
        value=tuple(tuple(row) for row in results["nominal.2"]["filter"]["C"]),
    )


@LEVELS.matrix("filter.second-column", COLUMNS["second"], uses="nominal.2")
def second_column(results: Results) -> Evidence:
    """The second column of A_f is that of Phi(0.05), as in an observer whose sensor sees the first state."""
    # C does not see the second state, so A_f = Phi - B_f C keeps that column.
    column = tuple((row[1],) for row in results["nominal.2"]["Phi"])
    return Evidence(method="Second column of Phi(0.05) by the matrix exponential.", value=column)


@LEVELS.matrix(
    "filter.first-column",
    COLUMNS["first"],
    uses="nominal.2",
    tolerance="0.0001",
    tolerance_reason="B_f is printed to half a unit as well, and enters the difference.",
)
def first_column(results: Results) -> Evidence:
    """The first column of A_f is that of Phi(0.05) - B_f C: the filter is an observer."""
    Phi, B = results["nominal.2"]["Phi"], matrix(PRINTED_FILTER["B_f"])
    return Evidence(
        method="First column of Phi(0.05) - B_f C, with B_f as printed.",
        value=tuple((r[0] - b[0],) for r, b in zip(Phi, B, strict=True)),
    )


@RESPONSE.statistical("figure.attenuated", place="Fig. 2", uses=(*DRAWS, "bracket.2"))
def attenuated(results: Results) -> Evidence:
    """The disturbance of the text is attenuated in the error, for sampling periods of a law that is ours."""
    r = merged(results)
    ordered = sorted(r["ratios"])
    return Evidence(
        method=f"{len(ordered)} sequences of {len(r['k'])} independent periods, uniform in the range, and the one "
        "disturbance of the text. The law and the length are assumptions of ours: the text states neither.",
        holds=ordered[-1] < 1,
        margin=1 - ordered[-1],
        quantities={
            "smallest ratio": ordered[0],
            "median ratio": ordered[len(ordered) // 2],
            "largest ratio": ordered[-1],
            "attained worst-case gain": results["bracket.2"]["lower"],
        },
        note="Other laws of the periods and other disturbances are not covered: the attained worst case is far larger.",
    )
