"""Sec. IV: the intervals (9) that the small-gain condition covers, the inequality (10)."""

from functools import partial

from msgspec.structs import replace

from papers.mustafa.claims.guarantees import STABLE
from papers.mustafa.claims.preliminaries import FILTER, MISNAMED, SLIP, for_both, identity, stable_room, up
from papers.mustafa.method import CORRECT
from papers.mustafa.printed import EXAMPLES, GAMMA, example, sizes
from replication.audit.declare import ROUNDING, Part, positive, rounded
from replication.audit.model import NO_READING, Evidence, Results
from replication.verify.predicate import term

THEOREM_1 = Part("Sec. III, condition (8); Theorem 1, eq. (9), cases L3 and U3; its conservatism", reading=NO_READING)
THEOREM_2 = Part("Theorem 2, what it concludes", reading=NO_READING)
THEOREM_3 = Part("Theorem 3, eqs. (10) and (11)", reading=NO_READING)

AT_ELEMENTS = 1e-6
"""A level that a solver finds is held to this, relatively, at the elements."""


def reached(results: Results, end: str) -> Evidence:
    """Evidence that alpha times the bound of Lemma 3 reaches one at this end of (9), and not before."""
    ends = {e: results[f"condition.{e}"]["ends"][end] for e in EXAMPLES}
    return rounded(
        max(abs(at["bound"] - 1) for at in ends.values()),
        method="Alpha times the integral of e^{mu t} from the middle of the range to the end of (9), by quadrature: "
        "one at the end, and less before it. Largest distance from one over both examples.",
        quantities={
            **{f"alpha times the bound at the end, Example {e}": at["bound"] for e, at in ends.items()},
            **{f"alpha times |Delta| at the end, Example {e}": at["size"] for e, at in ends.items()},
        },
    )


@THEOREM_1.feasible("l3", place="Theorem 1, case L3", erratum=MISNAMED, says=for_both("sharp lower end (9)"))
def lower_end_is_sharp(results: Results) -> Evidence:
    """Case L3 ends in both examples where the bound of Lemma 3 on α‖Δ‖ reaches one."""
    return reached(results, "lower")


@THEOREM_1.feasible("u3", place="Theorem 1, case U3", erratum="u3", says=for_both("sharp upper end (9)"))
def u3_covers(results: Results) -> Evidence:
    """Case U3, with μ(A) in the logarithm too, ends in both examples where the bound of Lemma 3 on α‖Δ‖ reaches one."""
    corrected, printed = (reached(results, f"upper, {reading}") for reading in ("corrected", "printed"))
    return replace(corrected, as_printed=printed)


@THEOREM_1.feasible(
    "conservative",
    place="Sec. IV-A, after Theorem 1",
    says=for_both("conservative element"),
)
def one_interval_is_conservative(results: Results) -> Evidence:
    """A direct use of Theorem 1 can be conservative, and several elements can reduce that: they do in both examples."""
    # (9) around the middle leaves part of the range out in both examples, although all of it is stable.
    left_out, elements, covered = {}, {}, True
    for e in EXAMPLES:
        (h_l, h_u), interval = example(e)["periods"], results[f"grids.{e}"]["intervals"]["corrected, alpha"]
        left_out[e] = max(interval["lower"] - h_l, 0.0) + max(h_u - interval["upper"], 0.0)
        run = results[f"grids.{e}"]["algorithm"][CORRECT.name]
        elements[e] = run["size"]
        covered &= run["end"] == "COVERED"
    without = "".join(
        f"With U3 as printed (9) is empty around the elements in Example {e}, so that several do not help there. "
        for e in empty_as_printed(results)
    )
    largest = up(results["condition.2"]["constant_bound"])
    stable = all(stable_room(e, results) > 0 for e in EXAMPLES)
    return Evidence(
        method="Part of the range outside (9) around its middle, U3 corrected; exact stability test; whether the "
        "intervals (9) of several elements cover the range.",
        holds=stable and covered and min(left_out.values()) > 0,
        note=f"{without}The text lays this to the condition (8). In Example 2 it is the bound (9): the norm in (8), "
        f"evaluated directly for constant changes of the period, is at most {largest} "
        "on the whole range with one element. The elements are those of our run of Algorithm 1; that their intervals "
        "cover the range needs U3 alone corrected. How many the algorithm makes is no part of what decides.",
        quantities={
            **{f"left out by one element (s), Example {e}": length for e, length in left_out.items()},
            **{f"elements shown to cover, Example {e}": float(size) for e, size in elements.items()},
        },
    )


def empty_as_printed(results: Results) -> list[int]:
    """Examples in which (9) with U3 as printed is empty around every element."""
    # With mu(A) < 0 < mu(-A) the printed upper end lies below h_0 by more than the lower one, whatever alpha is.
    grids = {e: results[f"grids.{e}"] for e in EXAMPLES}
    ends = {e: r["intervals"]["printed, alpha"] for e, r in grids.items()}
    return [e for e, r in grids.items() if r["mu"] < 0 < r["mu_minus"] and ends[e]["upper"] <= ends[e]["lower"]]


def robustly_stable(e: int, results: Results) -> Evidence:
    """Whether the error system is stable over the whole range, by the exact test."""
    r, room = results[f"bracket.{e}"], stable_room(e, results)
    return positive(
        room,
        method="Exact test: block-triangular with commuting Phi(h), so A Hurwitz and A_f Schur decide.",
        quantities={"abscissa of A": r["plant_abscissa"], "spectral radius of A_f": r["filter_radius"]},
        note=f"The numbers are those of {FILTER[e]}. As A is Hurwitz, the same holds for every range of sampling "
        "periods and every filter with A_f Schur, which (6) at one period gives; a grid is not needed for stability.",
    )


for e, which in (1, "every filter that satisfies (6) at one period"), (2, "the printed filter"):
    THEOREM_2.feasible(
        f"stable.{e}",
        place=GAMMA[e].place,
        statement=f"The error system of Example {e} is robustly stable over the whole range, with {which}.",
        erratum=SLIP[e],
        says=STABLE[e],
    )(partial(robustly_stable, e))


def stability_follows(results: Results) -> Evidence:
    """The error system of a stable plant is stable for every sequence if (6) holds at one period."""
    return positive(
        min(stable_room(e, results) for e in EXAMPLES),
        method="Proof: (6) at one period makes A_f Schur, and exponentials of a Hurwitz A commute. Beside it, both "
        "numbers in both examples.",
        note="Neither (8) nor the grid is needed.",
    )


def with_printed_f(method: str = "Size of F C, with F of the printed size, against n by n.") -> Evidence:
    """The same with F of the printed size, r by n: only if n is r do the products exist."""
    (n, r), _ = sizes()
    return Evidence(method=method, holds=n == r)


@THEOREM_3.feasible(
    "theorem-3.stability",
    place="Theorem 3",
    erratum="size-of-F",
    says=[STABLE[1], term("size of F", "printed-filter")],
)
def stability_of_theorem_3(results: Results) -> Evidence:
    """Theorem 3: under (2), the error system is robustly stable for all periods that it names."""
    return replace(
        stability_follows(results),
        as_printed=with_printed_f(),
        note="Theorem 3 is taken at its hypothesis (6), which (10) stands for once F has its size and the repeated row "
        "stands once (erratum row).",
    )


for part, name, place, statement in (
    (THEOREM_1, "theorem-1", "Theorem 1", ""),
    (THEOREM_2, "theorem-2", "Theorem 2", ""),
    (
        THEOREM_1,
        "small-gain",
        "Sec. III, below (8)",
        "Under (2), the error system is robustly stable as long as α‖Δ‖ is at most one.",
    ),
):
    part.feasible(
        name,
        place=place,
        statement=statement
        or f"{place}: under (2), the error system is robustly stable for all periods that it names.",
        says=STABLE[1],
    )(stability_follows)


@THEOREM_1.feasible(
    "small-gain.required",
    place="Sec. III, before (8)",
    says=STABLE[1],
)
def small_gain_is_required(results: Results) -> Evidence:
    """To ensure stability (8) is required: where it holds, the error system is stable."""
    rooms = {e: stable_room(e, results) for e in EXAMPLES}
    # Stability without (8), in the coordinates that favour it most, shows that it is not necessary.
    breaks = max(results[f"condition.{e}"]["modal"] for e, room in rooms.items() if room > 0) - 1
    return positive(
        min(rooms.values()),
        method="The small-gain theorem; beside it the exact test of stability, and the left side of (8) over the range "
        "with one element, in modal coordinates.",
        quantities={"excess of (8) in a stable example": breaks},
        note="Necessary it is not: Example 1 with one element is stable for every sequence and breaks (8) in any "
        "coordinates. The text does not mean it so: Sec. IV-A calls the condition conservative.",
    )


@THEOREM_3.feasible(
    "theorem-3.level",
    place="Theorem 3",
    erratum="size-of-F",
    says=term("level of Theorem 3"),
)
def level_of_theorem_3(results: Results) -> Evidence:
    """The filter (11) of a solution of (10) has the level γ at each element of the grid."""
    worst = max(results["identities"][name] for name in ("congruence", "recovery"))
    own_grids = [results[f"own-grid.{e}"] for e in EXAMPLES]
    rooms = [grid["level"] * (1 + AT_ELEMENTS) - grid["at_elements"] for grid in own_grids]
    return Evidence(
        method="Proof: (10) is (6) after a congruence, and (11) gives back its filter. Beside it, the largest gain of "
        "such a filter at the elements of our grids against its level.",
        holds=worst <= ROUNDING and min(rooms) > 0,
        quantities={"largest relative residual": worst},
        as_printed=with_printed_f(),
        note="(10) is read without its repeated row (erratum row).",
    )


@THEOREM_3.feasible(
    "theorem-3.sizes",
    place="Theorem 3",
    erratum="size-of-F",
    says=term("size of F", "printed-filter"),
)
def lmi_size_of_f(results: Results) -> Evidence:
    """F in (10) and (11) has the size that Theorem 3 gives, once it is read n × r."""
    # F C is added to an n by n block in (10), and B_f = -Y^-1 F has the size of F.
    (n, r), size = sizes()
    return Evidence(
        method="Size of the printed B_f = -Y^-1 F, against n by r.",
        holds=size == (n, r),
        as_printed=Evidence(method="The same against r by n.", holds=size == (r, n)),
    )


@THEOREM_3.feasible(
    "recovery",
    place="Eq. (11)",
    erratum="size-of-F",
    says=term("recovery (11)"),
)
def recovery(results: Results) -> Evidence:
    """Formula (11) recovers the filter from the unknowns of (10)."""
    return replace(
        identity(results, "recovery", "Transfer matrices of random filters at one point, before and after (11)."),
        # Y has n columns; the printed F has r rows.
        as_printed=with_printed_f(
            "Columns of Y against rows of F, which is printed r by n: only if they are as many does the product Y^-1 F "
            "exist."
        ),
    )


@THEOREM_3.feasible(
    "congruence",
    place="Theorem 3, proof",
    erratum="size-of-F",
    says=term("congruence (10)"),
)
def congruence(results: Results) -> Evidence:
    """Inequality (10) follows from (6) by a congruence with diag(J_1, I, J_1, I)."""
    # F C is added to an n by n block; the printed F has r rows.
    return replace(
        identity(results, "congruence", "J'(6)J against (10) for random storage matrices and filters."),
        as_printed=with_printed_f(),
        note="The text at hand repeats a row of (10); it is read without the repetition (erratum row).",
    )
