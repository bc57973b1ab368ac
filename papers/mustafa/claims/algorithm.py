"""Algorithm 1 and Sec. V: grids and their covering, robust performance with (13)."""

from functools import partial
from typing import Any

from msgspec.structs import replace

from papers._common import outcomes_of, solvers
from papers.mustafa.claims.preliminaries import (
    NO_GRID,
    SLIP,
    WITH_U3,
    covers_as_step_3_prints,
    for_both,
    no_grid,
    printed_runs,
    reordered_map,
)
from papers.mustafa.experiments.declared import CELLS
from papers.mustafa.method import CORRECT, Step4
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA
from replication.audit.declare import Part, positive
from replication.audit.model import NO_READING, Evidence, Outcome, Results
from replication.verify.predicate import Predicate, term

CONSTANT_CHANGE, ANY_CHANGE, BOUND_9 = "constant change", "any change", "bound (9)"
CORRECTED_GRID = "grid by (9), corrected"
STEP_4 = {Step4.CUT: "no set-minus", Step4.SET_MINUS: "set-minus", Step4.UNCUT: "no set-minus, uncut"}
"""The readings of its line."""
ENOUGH, NECESSARY, CONCLUSION = "required as enough", "required as necessary", "(12) as a gain over sequences"
ALGORITHM_1 = Part("Algorithm 1; condition (8) for the grids of Sec. VI")


def ends_covered(e: int, results: Results) -> Evidence:
    """Whether Algorithm 1 as corrected ends with a grid; with the root that step 4 prints, by readings of its line."""
    run, literal = results[f"grids.{e}"]["algorithm"][CORRECT.name], printed_runs(e, results)
    ends = {step_4: any(record["end"] == "COVERED" for record in runs) for step_4, runs in literal.items()}
    u3 = ("U3 as printed", "U3 corrected")
    uncut = " and ".join(_added(*pair) for pair in zip(literal[Step4.UNCUT], u3, strict=True))
    return Evidence(
        method="Algorithm 1 with U3 corrected, alpha in both steps and a set-minus in step 4.",
        holds=run["end"] == "COVERED",
        as_printed=Evidence(
            method="Algorithm 1 with sqrt(alpha) in step 4, and U3 as printed or corrected. The text at hand has no "
            "sign between the range and the union, perhaps a set-minus that was lost on the way; it is read with one, "
            "as one more union, and, an assumption of ours, as that union cut to the range.",
            holds=any(ends.values()),
            outcomes=tuple(Outcome(reading=STEP_4[step_4], holds=covered) for step_4, covered in ends.items()),
        ),
        quantities={
            "elements": float(run["size"]),
            "passes": float(run["rounds"]),
            **{
                f"with the root, {STEP_4[step_4]}, {name}: periods added": float(record["size"] - 1)
                for step_4, runs in literal.items()
                for name, record in zip(u3, runs, strict=True)
            },
        },
        note="With the root of step 4, a set-minus or a cut union adds no new period here although step 3 fails, so "
        f"the algorithm never ends. An uncut union adds {uncut}; the range stays uncovered. {WITH_U3}",
    )


def _added(run: dict[str, Any], u3: str) -> str:
    """How many periods a union that is not cut adds, and what ends that."""
    stopped = ", until step 1 stops it without a filter" if run["end"] == "LIMIT" else ""
    return f"{run['size'] - 1 or 'none'} with {u3}{stopped}"


def _no_one_element(e: int, results: Results) -> Evidence:
    """What Algorithm 1 as printed gives; where it gives no grid, also that step 3 as printed alone rules out one."""
    printed, condition = no_grid(e, results), results[f"condition.{e}"]
    if not printed.not_checkable or covers_as_step_3_prints(results[f"grids.{e}"]):
        return printed
    fails = "; (8) itself fails there too" if min(condition["constant"], condition["modal"]) >= 1 else ""
    return replace(
        printed,
        not_checkable="With alpha as step 3 prints it one element does not cover the range by (9), with U3 as printed "
        f"or corrected, whatever step 4 means{fails}. {NO_GRID}",
    )


def grid_size(e: int, results: Results) -> Evidence:
    """The number of elements of the grid of the corrected algorithm; beside it, with (8) itself for (9)."""
    r, c = results[f"grids.{e}"], results[f"condition.{e}"]
    run = r["algorithm"][CORRECT.name]
    sizes = {BOUND_9: run["size"], CONSTANT_CHANGE: c["elements"], ANY_CHANGE: c["modal_elements"]}
    covering = "; ".join(name for name, interval in r["intervals"].items() if interval["covers"]) or "none"
    return Evidence(
        method="Algorithm 1 with (9), U3 corrected, alpha in both steps and a set-minus in step 4.",
        value=float(run["size"]),
        outcomes=tuple(Outcome(reading=reading, value=float(size)) for reading, size in sizes.items()),
        cross_check="alpha does not depend on the filter, so the grid does not: Sigma_11 with random filters "
        f"against the plant's part, largest relative residual {results['identities']['sigma 11']:.1e}.",
        quantities={"alpha": r["alpha"], "passes": float(run["rounds"])},
        as_printed=_no_one_element(e, results),
        note="Step 3 says that an element covers the interval (9), which bounds (8); Theorem 3 "
        "asks for (8) alone. "
        "Where an element covers what (8) itself allows, a new one goes to the middle of each gap. Forms of (9), by "
        f"case U3 and by alpha or its root, in which the middle alone covers the range: {covering}. The root of alpha, "
        "which step 4 prints, is against the print of step 3, and its interval is not one on which the small-gain "
        f"condition gives (8): it would not leave the step valid, and does not count. {WITH_U3}",
    )


def condition_8(e: int, results: Results) -> Evidence:
    """Whether (8) holds over the whole range with the one element of the grid, evaluated directly."""
    r = results[f"condition.{e}"]
    # Between the nodes the left side is known up to its steepness: to hold, its bound must stay below one.
    margins = {
        reading: 1 - (r[f"{name}_bound"] if r[f"{name}_bound"] < 1 else r[name])
        for reading, name in ((CONSTANT_CHANGE, "constant"), (ANY_CHANGE, "modal"))
    }
    undecided = [name for name in ("constant", "modal") if r[name] < 1 <= r[f"{name}_bound"]]
    return Evidence(
        method="Left side of (8) with the middle of the range for h_0, over periods of the whole range, and a bound of "
        "its steepness between them. The filter plays no part.",
        cross_check="A norm of transfer matrices, and a formula in modal coordinates that shares no code with it.",
        holds=min(margins.values()) > 0,
        margin=min(margins.values()),
        outcomes=outcomes_of(margins),
        quantities={
            "largest left side, constant change": r["constant"],
            "largest left side, constant change: at the period (s)": r["constant_at"],
            "largest left side, constant change: bound between the nodes": r["constant_bound"],
            "largest left side, any change, modal coordinates": r["modal"],
            "largest left side, any change, modal coordinates: bound between the nodes": r["modal_bound"],
            "largest left side, any change, modal coordinates: least over other single elements tried": r["best"],
        },
        not_checkable="" if not undecided else "The bound between the nodes does not decide; take more of them.",
        note="In modal coordinates the left side is the least that any coordinates give for a constant change: where "
        "it exceeds one, no change of coordinates helps. Its gain for every sequence in the coordinates of the plant "
        "is not evaluated.",
    )


for e, with_grid, with_8 in ((1, "differs", "refuted"), (2, "compatible", "consistent")):
    allowed = [
        Predicate(of=term("condition (8)", f"example-{e}"), reading=kind) for kind in (CONSTANT_CHANGE, ANY_CHANGE)
    ]
    ALGORITHM_1.feasible(
        f"algorithm.{e}",
        place=f"Algorithm 1; eq. (9), case U3; {GAMMA[e].place}",
        statement=f"Algorithm 1 ends with a grid that covers the range of Example {e}.",
        erratum="algorithm",
        pinned="compatible",
        reading=CORRECTED_GRID,
        says=term("Algorithm 1 ends", f"example-{e}"),
    )(partial(ends_covered, e))
    ALGORITHM_1.value(
        f"grid-size.example-{e}",
        DATA[f"grid-size-{e}"],
        statement=f"Algorithm 1 ends with one element in the grid in Example {e}.",
        erratum="algorithm",
        pinned=with_grid,
        reading=BOUND_9,
        # Where an element covers what (8) allows, the algorithm ends with the first one if (8) holds over the range.
        says=[term("elements of the grid", f"example-{e}"), *allowed],
    )(partial(grid_size, e))
    ALGORITHM_1.feasible(
        f"condition-8.{e}",
        place=f"{GAMMA[e].place}; Theorem 3; eq. (8)",
        statement=f"With one element in the grid, the middle of the range, Example {e} satisfies (8) at every period.",
        ours=True,
        erratum=SLIP[e],
        pinned=with_8,
        reading=CONSTANT_CHANGE,
        says=allowed,
    )(partial(condition_8, e))


# Sec. V: robust performance, eq. (12), and the remark on one level for both channels


ROBUST_PERFORMANCE = Part("Sec. V-A, eq. (12) and the remark on one level", reading=NO_READING)


@ROBUST_PERFORMANCE.feasible(
    "map-12",
    place="Eq. (12)",
    erratum="map-12",
    pinned="reproduced after erratum",
    says=for_both("map of the error system"),
)
def map_12(results: Results) -> Evidence:
    """The transfer function in condition (12) maps w to e, for a constant change of the period."""
    return reordered_map(
        results,
        ("(12) as printed",),
        "Transfer matrices of random error systems at one point outside the unit circle, constant Delta.",
    )


@ROBUST_PERFORMANCE.feasible(
    "performance-12",
    place="Sec. V-A, eq. (12)",
    erratum="map-12",
    reading=NECESSARY,
    pinned="undetermined",
)
def performance_by_12(results: Results) -> Evidence:
    """For robust performance, in addition to (8), (12) is required."""
    corrected = map_12(results)
    constant = {e: max(results[f"curve.{e}"]["filter"]) for e in EXAMPLES}
    room = min(results[f"bracket.{e}"]["upper"] - constant[e] for e in EXAMPLES)
    # Of a transfer matrix (12) asks for the gain at one constant period; read as a gain, it is the conclusion.
    reached, bound = results["bracket.2"]["lower"], results["condition.2"]["constant_bound"]
    return Evidence(
        method="Necessary: a constant period is one of the sequences, and (12), with the indices exchanged, is the "
        "gain there; beside it, in both examples, the guaranteed gain over all sequences less the largest at constant "
        "periods. Enough: the printed filter of Example 2, for which (8) holds over the range; its largest gain at "
        "constant periods less the ratio that one sequence reaches.",
        cross_check="Ratios are simulated, and guaranteed gains come from certificates; those at constant periods are "
        "exact norms at nodes.",
        outcomes=(
            Outcome(reading=NECESSARY, holds=bool(corrected.holds) and room >= 0),
            Outcome(reading=ENOUGH, holds=bound >= 1 or reached <= constant[2]),
            Outcome(reading=CONCLUSION, holds=True),
        ),
        quantities={
            "guaranteed gain less the largest at a constant period, least": room,
            "Example 2, largest gain at constant periods": constant[2],
            "Example 2, ratio along a sequence": reached,
            "Example 2, largest left side of (8), bound": bound,
        },
        as_printed=corrected.as_printed,
        note="Read as a gain over every sequence, and not as the norm of a transfer matrix, (12) is the conclusion "
        "itself, required in either sense.",
    )


@ROBUST_PERFORMANCE.feasible(
    "same-level",
    place="Sec. V-A",
    statement="One level for both channels may be conservative: in Example 1 it is, with (13) as reconstructed here, "
    f"on {CELLS} equal cells of the range.",
    reading="(13) reconstructed",
    says=term("conservative level", "example-1", cells=CELLS),
)
def same_level_for_both(results: Results) -> Evidence:
    """What one level for both channels forces at least, against free multipliers on the same cells."""
    # With one level gamma for both channels, gamma is at least the norm of the uncertainty channel: alpha_i, or
    # alpha_i delta_i if Delta is first divided by its radius. The smaller of both is taken. A scalar scaling changes
    # neither. Against it: a free multiplier, on the same cells and in the same coordinates.
    quantities: dict[str, float] = {}
    for e in EXAMPLES:
        levels = results[f"robust.{e}"]
        quantities |= {
            f"one level: at least alpha, Example {e}": levels["lmi13_alpha"],
            f"one level, Delta divided by its radius: at least, Example {e}": levels["lmi13_small_gain"],
            f"free multipliers, Example {e}": levels["lmi13"],
            f"alpha times radius with one cell, Example {e}": levels["one_cell_small_gain"],
            f"one Lyapunov function over the continuum, guaranteed, Example {e}": levels["guaranteed"],
        }
    first = results["robust.1"]
    margin = min(first["lmi13_alpha"], first["lmi13_small_gain"]) - first["lmi13"]
    return positive(
        margin,
        method="The least that one level for both channels forces in Example 1, with a scalar scaling, in the more "
        "favourable of two normalisations of Delta; less the level with one free multiplier for each cell, on the same "
        "cells in the same modal coordinates.",
        quantities=quantities,
        solvers=solvers(*(results[f"robust.{e}"] for e in EXAMPLES)),
        note="The text says that it may: one example is enough. In Example 2 this comparison shows nothing if Delta is "
        "divided by its radius. With one cell, as in the paper's grids, the bound of Lemma 3 times alpha exceeds one "
        "in these coordinates in both examples, so the reconstructed (13) has no solution at all.",
    )
