"""Misprints of the paper: what is printed, what must be meant, and the computation that shows it."""

from __future__ import annotations

from papers.mustafa.claims.preliminaries import covers_as_step_3_prints
from papers.mustafa.experiments.identities import EXACT
from papers.mustafa.method import AS_PRINTED, CORRECT, Step4
from papers.mustafa.printed import DATA, EXAMPLES, example, middle, printed_filter, sizes
from replication.audit.declare import contrast
from replication.audit.model import Proof, Results

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


def order_of_map(results: Results) -> Proof:
    """The map below (7) in both ways to balance its brackets and in the right order, against the transfer matrix."""
    return _exchanged(
        results,
        "The brackets do not balance, which may be a slip of our copy; the exchanged indices stand in (12) again, and "
        "are the text's. Without the last bracket, and without the one before the inverse, which gives (12), the map "
        "misses the transfer matrix at a constant Delta in random cases whose sizes fit; the right order agrees.",
        {" without the last bracket": "map as printed", " without the one before the inverse": "(12) as printed"},
    )


def order_of_12(results: Results) -> Proof:
    """The same for (12)."""
    text = (
        "With the indices 12 and 21 exchanged the map agrees with the transfer matrix at a constant Delta; as printed "
        "it does not, in random cases whose sizes fit."
    )
    return _exchanged(results, text, {" as printed": "(12) as printed"})


def _exchanged(results: Results, text: str, readings: dict[str, str]) -> Proof:
    r = results["identities"]
    least = {f"least residual{reading}": r[name] for reading, name in readings.items()}
    return contrast(text, {"largest residual, reordered": r["map reordered"]}, least, zero=EXACT)


def case_u3(results: Results) -> Proof:
    """The upper ends of (9) with both logarithmic norms."""
    ends = {e: results[f"grids.{e}"]["intervals"] for e in EXAMPLES}
    return Proof(
        holds=ends[2]["printed, alpha"]["upper"] < middle(2) < ends[2]["corrected, alpha"]["upper"]
        and ends[1]["printed, alpha"]["upper"] > ends[1]["corrected, alpha"]["upper"],
        text="The logarithm is that of case L3, which our copy may have repeated. Lemma 3 bounds Delta(theta) by "
        "(e^{mu(A) theta} - 1)/mu(A). In Example 2 the printed upper end lies below h_0, the middle of the range; in "
        "Example 1 it lies beyond where the bound reaches 1/alpha.",
        quantities={
            f"upper end, Example {e}, {name}": ends[e][f"{name}, alpha"]["upper"]
            for e in ends
            for name in ("printed", "corrected")
        },
    )


def size_of_f(results: Results) -> Proof:
    """F C and B_f = -Y^-1 F must have n rows."""
    (n, r), size = sizes()
    return Proof(
        holds=n != r and size == (n, r),
        text="The printed B_f = -Y^-1 F has n rows and r columns, and so has F.",
        quantities={"n": float(n), "r": float(r)},
    )


def repeated_row(results: Results) -> Proof:
    """The right half of (10) has a row too many for a square matrix; without the repeated one it is the congruence."""
    left, right = DATA["lmi"]["left"], DATA["lmi"]["right"]
    columns = len(left[0].split(",")) + len(right[0].split(","))
    residual = results["identities"]["congruence"]
    return Proof(
        holds=len(left) == columns == len(right) - 1 == len(set(right)) and residual <= EXACT,
        text="A matrix inequality is about a square matrix. The left half has as many rows as (10) has columns, the "
        "right half one more, and one row twice. Without the repetition, and with F of size n × r, (10) is the "
        "congruence of (6) that the proof asks for.",
        quantities={
            "columns": float(columns),
            "rows, left": float(len(left)),
            "rows, right": float(len(right)),
            "largest residual": residual,
        },
    )


def steps_of_algorithm(results: Results) -> Proof:
    """Root and union in step 4: read as printed the range is covered in neither example; the correct one covers it."""
    found = {e: results[f"grids.{e}"] for e in EXAMPLES}
    runs = [grids["algorithm"] for grids in found.values()]
    literal = {step_4: {run[form.name]["end"] for run in runs for form in AS_PRINTED[step_4]} for step_4 in AS_PRINTED}
    by_root = all(grids["intervals"]["corrected, root"]["covers"] for grids in found.values())
    by_alpha = any(covers_as_step_3_prints(grids) for grids in found.values())
    return Proof(
        holds=literal[Step4.SET_MINUS] == literal[Step4.CUT] == {"STALLED"}
        and "COVERED" not in literal[Step4.UNCUT]
        and all(run[CORRECT.name]["end"] == "COVERED" for run in runs),
        text="Our copy has lost a sign in this line, so its root may be damage too. With the root, U3 as printed or "
        "corrected, a set-minus or a union cut to the range adds no new period in either example, so the algorithm "
        "never ends; a union left uncut adds periods, and the range is not covered in the passes run. With alpha, a "
        "set-minus and U3 corrected it is covered." + (BY_ROOT if by_root else "") + ("" if by_alpha else BY_ALPHA),
        quantities={
            f"elements, Example {e}, {reading.name}": float(grids["algorithm"][reading.name]["size"])
            for e, grids in found.items()
            for reading in (*AS_PRINTED[Step4.UNCUT], CORRECT)
        },
    )


def motor_constant(results: Results) -> Proof:
    """One constant of A has no value, and one value has no place in A; the printed filter bears it out."""
    in_A, valued = (set(DATA["constants"][which]) for which in ("in A", "with a value"))
    # A_f = Phi - B_f C with C = [1 0], and the off-diagonal entries of Phi = e^{hA} are to each other as those of A.
    Phi, A, filter_ = results["nominal.2"]["Phi"], example(2)["plant"]["A"], printed_filter()
    moved, factor = filter_["A"][1][0] + filter_["B"][1][0], -float(DATA["L_a"]) * A[0][1] / Phi[0][1]
    low, high = sorted(factor * (moved + sign * 2 * HALF_UNIT) for sign in (-1, 1))
    return Proof(
        holds=(in_A - valued, valued - in_A) == ({"K_theta"}, {"K_q"}) and low <= float(DATA["K"]) <= high and low > 0,
        text="The text gives the values of the constants of A. K_theta alone has none, and K_q alone has one and no "
        "place in A, so that one is the other. The filter bears it out: if A_f = Phi - B_f C, the first columns of the "
        "printed A_f and B_f, with their rounding, leave K_theta between two ends, and the value lies between them.",
        quantities={"K_theta, at least": low, "K_theta, at most": high},
    )


SI = {"kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2)}
"""Symbols of units in powers of (kg, m, s)."""


def dimension(unit: str) -> tuple[int, ...]:
    """Powers of (kg, m, s) of a unit such as "kg m^2 s^-2"."""
    symbols = [factor.partition("^") for factor in unit.split()]
    return tuple(sum(int(power or 1) * SI[symbol][i] for symbol, _, power in symbols) for i in range(3))


def unit_of_inertia(results: Results) -> Proof:
    """b/J is an entry of A and must have the unit 1/s."""
    b, J, inertia = (dimension(unit) for unit in (DATA["b"].unit, DATA["J"].unit, "kg m^2"))
    printed, meant = (tuple(x - y for x, y in zip(b, other, strict=True)) for other in (J, inertia))
    return Proof(
        holds=printed != (0, 0, -1) == meant,
        text="Powers of kg, m and s of the entry b/J of A: with J in kg m^2 it is a rate, with the printed unit not.",
        quantities={"power of s in b/J, printed": float(printed[2]), "power of s in b/J, meant": float(meant[2])},
    )


def number_of_step(results: Results) -> Proof:
    """Which steps of Algorithm 1 read the limit N_0 of the size of the grid."""
    limiting = [step for step, reads in DATA["steps"].items() if "N_0" in reads]
    named = DATA["step-against-large-grids"]
    return Proof(
        holds=limiting == ["1"] and named not in limiting,
        text="Only one step reads the size of the grid against its limit N_0; the sentence names the next one.",
        quantities={"step that reads N_0": float(limiting[0]), "step named": float(named)},
    )


PROOFS = {
    "map": order_of_map,
    "map-12": order_of_12,
    "u3": case_u3,
    "size-of-F": size_of_f,
    "row": repeated_row,
    "algorithm": steps_of_algorithm,
    "motor-constant": motor_constant,
    "unit-of-J": unit_of_inertia,
    "step": number_of_step,
}
"""By the errata of told.toml."""
