"""The audit of the nonuniform-sampling paper: its parts in the order of the text, what leads its page, its misprints.

Each misprint has the computation that shows what must be meant.
"""

from functools import partial
from typing import Any

from papers._common import MINCX, POSITION, Proofs, Told, common_levels, curve, dots, label, parts_of, signal, ticks
from papers.mustafa.claims import algorithm, examples, guarantees, main_results, preliminaries
from papers.mustafa.claims.preliminaries import covers_as_step_3_prints, down, on_motor, printed_runs, times, up
from papers.mustafa.experiments.declared import EXPERIMENTS, LIMIT, TRIED
from papers.mustafa.experiments.levels import ABOVE, IRREGULAR, LAWS
from papers.mustafa.figures import FIGURES
from papers.mustafa.method import AS_PRINTED, CORRECT, Step4
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA, example, middle, printed_filter, sizes, upper_end
from replication.audit.brief import Draws, Sketch
from replication.audit.declare import ROUNDING, contrast, paper
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Proof, Results
from replication.audit.project import about

BY_ROOT = (
    " With √α in step 3 as well, and U3 corrected, one element comes out in both examples, as printed; but it does not "
    "leave (8) valid: in Example 1 (8) fails with that element."
)
BY_ALPHA = (
    " Whatever step 4 means: with alpha as step 3 prints it, one element does not cover the range by (9) in either "
    "example, with U3 as printed or corrected."
)
HALF_UNIT = 0.00005
"""Rounding of an entry of the printed filter."""


def exchanged(readings: dict[str, str], text: str, results: Results) -> Proof:
    """A map as it is read and in the right order, against the transfer matrix."""
    r = results["identities"]
    least = {f"least residual{reading}": r[name] for reading, name in readings.items()}
    return contrast(text, {"largest residual, reordered": r["map reordered"]}, least)


def case_u3(text: str, results: Results) -> Proof:
    """The upper ends of (9) with both logarithmic norms."""
    ends = {e: results[f"grids.{e}"]["intervals"] for e in EXAMPLES}
    return Proof(
        holds=ends[2]["printed, alpha"]["upper"] < middle(2) < ends[2]["corrected, alpha"]["upper"]
        and ends[1]["printed, alpha"]["upper"] > ends[1]["corrected, alpha"]["upper"],
        text=text,
        quantities={
            f"upper end, Example {e}, {name}": ends[e][f"{name}, alpha"]["upper"]
            for e in ends
            for name in ("printed", "corrected")
        },
    )


def size_of_f(text: str, results: Results) -> Proof:
    """F C and B_f = -Y^-1 F must have n rows."""
    (n, r), size = sizes()
    return Proof(
        holds=n != r and size == (n, r),
        text=text,
        quantities={"n": float(n), "r": float(r)},
    )


def repeated_row(text: str, results: Results) -> Proof:
    """The right half of (10) has a row too many for a square matrix; without the repeated one it is the congruence."""
    left, right = DATA["lmi"]["left"], DATA["lmi"]["right"]
    columns = len(left[0].split(",")) + len(right[0].split(","))
    residual = results["identities"]["congruence"]
    return Proof(
        holds=len(left) == columns == len(right) - 1 == len(set(right)) and residual <= ROUNDING,
        text=text,
        quantities={
            "columns": float(columns),
            "rows, left": float(len(left)),
            "rows, right": float(len(right)),
            "largest residual": residual,
        },
    )


def steps_of_algorithm(text: str, results: Results) -> Proof:
    """Root and union in step 4: read as printed the range is covered in neither example; the correct one covers it."""
    records = {e: results[f"grids.{e}"] for e in EXAMPLES}
    runs = [grids["algorithm"] for grids in records.values()]
    literal = {step_4: {run[form.name]["end"] for run in runs for form in AS_PRINTED[step_4]} for step_4 in AS_PRINTED}
    by_root = all(grids["intervals"]["corrected, root"]["covers"] for grids in records.values())
    by_alpha = any(covers_as_step_3_prints(grids) for grids in records.values())
    return Proof(
        holds=literal[Step4.SET_MINUS] == literal[Step4.CUT] == {"STALLED"}
        and "COVERED" not in literal[Step4.UNCUT]
        and all(run[CORRECT.name]["end"] == "COVERED" for run in runs),
        text=text + (BY_ROOT if by_root else "") + ("" if by_alpha else BY_ALPHA),
        quantities={
            f"elements, Example {e}, {reading.name}": float(grids["algorithm"][reading.name]["size"])
            for e, grids in records.items()
            for reading in (*AS_PRINTED[Step4.UNCUT], CORRECT)
        },
    )


def motor_constant(text: str, results: Results) -> Proof:
    """One constant of A has no value, and one value has no place in A; the printed filter bears it out."""
    in_A, valued = (set(DATA["constants"][which]) for which in ("in A", "with a value"))
    # A_f = Phi - B_f C with C = [1 0], and the off-diagonal entries of Phi = e^{hA} are to each other as those of A.
    Phi, A, filter_ = results["nominal.2"]["Phi"], example(2)["plant"]["A"], printed_filter()
    moved, factor = filter_["A"][1][0] + filter_["B"][1][0], -float(DATA["L_a"]) * A[0][1] / Phi[0][1]
    low, high = sorted(factor * (moved + sign * 2 * HALF_UNIT) for sign in (-1, 1))
    return Proof(
        holds=(in_A - valued, valued - in_A) == ({"K_theta"}, {"K_q"}) and low <= float(DATA["K"]) <= high and low > 0,
        text=text,
        quantities={"K_theta, at least": low, "K_theta, at most": high},
    )


SI = {"kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2)}
"""Symbols of units in powers of (kg, m, s)."""


def dimension(unit: str) -> tuple[int, ...]:
    """Powers of (kg, m, s) of a unit such as "kg m^2 s^-2"."""
    symbols = [factor.partition("^") for factor in unit.split()]
    return tuple(sum(int(power or 1) * SI[symbol][i] for symbol, _, power in symbols) for i in range(3))


def unit_of_inertia(text: str, results: Results) -> Proof:
    """b/J is an entry of A and must have the unit 1/s."""
    b, J, inertia = (dimension(unit) for unit in (DATA["b"].unit, DATA["J"].unit, "kg m^2"))
    printed, meant = (tuple(x - y for x, y in zip(b, divisor, strict=True)) for divisor in (J, inertia))
    return Proof(
        holds=printed != (0, 0, -1) == meant,
        text=text,
        quantities={"power of s in b/J, printed": float(printed[2]), "power of s in b/J, meant": float(meant[2])},
    )


def number_of_step(text: str, results: Results) -> Proof:
    """Which steps of Algorithm 1 read the limit N_0 of the size of the grid."""
    limiting = [step for step, reads in DATA["steps"].items() if "N_0" in reads]
    named = DATA["step-against-large-grids"]
    return Proof(
        holds=limiting == ["1"] and named not in limiting,
        text=text,
        quantities={"step that reads N_0": float(limiting[0]), "step named": float(named)},
    )


PROOFS: Proofs = {
    # Both ways to balance the brackets; the first gives (12).
    "map": partial(exchanged, {
        " without the last bracket": "map as printed", " without the one before the inverse": "(12) as printed",
    }),
    "map-12": partial(exchanged, {" as printed": "(12) as printed"}),
    "u3": case_u3,
    "size-of-F": size_of_f,
    "row": repeated_row,
    "algorithm": steps_of_algorithm,
    "motor-constant": motor_constant,
    "unit-of-J": unit_of_inertia,
    "step": number_of_step,
}  # fmt: skip
"""By the errata of told.toml."""


SAMPLED = (14, 24, 49, 54, 92, 110, 116, 151, 159, 194, 203, 238, 246, 252, 289, 302)
DESIGNED = [14 + 19.2 * step for step in range(16)]


def _higher(x: float) -> float:
    """The signal, with room for two rows of ticks below."""
    return signal(x) - 14


PARTS = parts_of(guarantees, preliminaries, main_results, algorithm, examples)
TOLD = Told.read(__file__, mincx=MINCX, above=ABOVE, **LAWS)
BRIEF = TOLD.brief(
    Sketch(
        alt="A signal is sampled at irregular instants, while the filter is designed for one constant period.",
        strokes=(
            curve(Draws.TRUTH, _higher),
            dots(Draws.MEASURED, SAMPLED, _higher),
            ticks(Draws.TICK, DESIGNED, 118),
            ticks(Draws.TICK_OURS, SAMPLED, 147),
            label("designed for", 8, 106),
            label("sampled at", 8, 131, Draws.LABEL_OURS),
        ),
    )
)


def facts(results: Results) -> dict[str, Any]:
    """The levels, stability, what varying periods cost, what can be guaranteed, the grids."""
    brackets, grids = ([results[f"{name}.{e}"] for e in EXAMPLES] for name in ("bracket", "grids"))
    solutions = {e: results[f"own-grid.{e}"] for e in EXAMPLES}
    lowered = all(solutions[e]["upper"] < results[f"bracket.{e}"]["lower"] for e in EXAMPLES)
    literal = [printed_runs(e, results) for e in EXAMPLES]
    ends = {run["end"] for runs in literal for step_4 in (Step4.SET_MINUS, Step4.CUT) for run in runs[step_4]}
    agreement = all(bracket["nominal"] <= upper_end(GAMMA[e]) for e, bracket in zip(EXAMPLES, brackets, strict=True))
    return {
        "both": "Both" if agreement else "Not both",
        "worst": [times(bracket["lower"], GAMMA[e]) for e, bracket in zip(EXAMPLES, brackets, strict=True)],
        "least": results["nominal.2"]["formula"],
        "floor": times(results["curve.1"]["floor"], GAMMA[1]),
        "level": GAMMA[1],
        "D": DATA["example-1"]["D"],
        "one_element": not covers_as_step_3_prints(grids[0]),
        "sizes": [grid["algorithm"][CORRECT.name]["size"] for grid in grids],
        "by_modal": results["condition.1"]["modal_elements"],
        "by_condition": results["condition.2"]["elements"],
        "by_root": all(grid["intervals"]["corrected, root"]["covers"] for grid in grids),
        "robust": [up(results[f"robust.{e}"]["guaranteed"]) for e in EXAMPLES],
        "lowered": "lower" if lowered else "do not always lower",
        "own": [times(solution["lower"], str(solution["level"])) for solution in solutions.values()],
        "never_ends": ends == {"STALLED"},
        "uncut": {run["end"] for run in literal[0][Step4.UNCUT]} == {"LIMIT"},
        "limit": LIMIT,
        "in_seconds": [down(results[f"bracket-duration.{e}"]["lower"]) for e in EXAMPLES],
    }


PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(*map(on_motor, PARTS)),
    experiments=EXPERIMENTS,
    errata=TOLD.errata(PROOFS),
    figures=TOLD.figures(FIGURES),
    findings=TOLD.findings(facts),
    brief=BRIEF,
    common=lambda results: common_levels(f"l2 {POSITION}", {IRREGULAR: results["common"]}, TRIED),
    sensitivity=lambda results: tuple(move for e in EXAMPLES for move in sensitivities(results[f"sensitivity.{e}"])),
)
