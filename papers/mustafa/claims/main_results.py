"""Sec. IV: the intervals (9) that the small-gain condition covers, the inequality (10), Algorithm 1."""

from __future__ import annotations

import math
from functools import partial

from papers.mustafa.claims.preliminaries import identity, up_to_rounding
from papers.mustafa.experiments.identities import EXACT
from papers.mustafa.method.algorithm1 import AS_PRINTED, CORRECT, WITH_SET_MINUS
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA, example, middle, sizes
from replication.audit.declare import Part
from replication.audit.model import Evidence, Results

THEOREM_1 = Part("Theorem 1, eq. (9), cases L3 and U3; its conservatism")
THEOREM_2 = Part("Theorem 2, what it concludes")
THEOREM_3 = Part("Theorem 3, eqs. (10) and (11)")
ALGORITHM_1 = Part("Algorithm 1")

GRIDS = tuple(f"grids.{e}" for e in EXAMPLES)
BRACKETS = tuple(f"bracket.{e}" for e in EXAMPLES)


@THEOREM_1.feasible("l3", place="Theorem 1, case L3", uses=GRIDS)
def lower_end_is_sharp(results: Results) -> Evidence:
    """The lower end of the interval that (8) covers."""
    product = {}
    for e in EXAMPLES:
        r = results[f"grids.{e}"]
        reach = middle(e) - r["intervals"]["corrected, alpha"]["lower"]
        product[e] = r["alpha"] * math.expm1(r["mu_minus"] * reach) / r["mu_minus"]
    return up_to_rounding(
        max(abs(value - 1) for value in product.values()),
        "Lower end of (9) around the middle of the range: there alpha times the bound must be one.",
        quantities={f"alpha times the bound, Example {e}": value for e, value in product.items()},
    )


@THEOREM_1.feasible("u3", place="Theorem 1, case U3", uses=GRIDS, erratum="u3", pinned="reproduced after erratum")
def u3_covers(results: Results) -> Evidence:
    """The upper end of the interval that (8) covers."""
    # With mu(A) the interval holds its own centre, and ends where the bound of Lemma 3 reaches 1/alpha.
    sound = dict.fromkeys(("printed", "corrected"), True)
    ends = {}
    for reading in sound:
        for e in EXAMPLES:
            grid = results[f"grids.{e}"]
            upper = grid["intervals"][f"{reading}, alpha"]["upper"]
            product = grid["alpha"] * math.expm1(grid["mu"] * (upper - middle(e))) / grid["mu"]
            sound[reading] &= upper > middle(e) and product <= 1 + EXACT
            ends[f"alpha times the bound of Lemma 3 at the upper end, {reading}, Example {e}"] = product
    return Evidence(
        method="Upper end of (9) around the middle of the range: inside it alpha times the bound must not exceed one.",
        holds=sound["corrected"],
        quantities=ends,
        as_printed=Evidence(method="U3 as printed.", holds=sound["printed"]),
    )


@THEOREM_1.feasible("conservative", place="Sec. IV-A, after Theorem 1", uses=(*GRIDS, *BRACKETS))
def one_interval_is_conservative(results: Results) -> Evidence:
    """A direct use of Theorem 1 could be conservative, and several elements reduce that."""
    # (9) around the middle leaves part of the range out in both examples, although all of it is stable.
    left_out, elements, several = {}, {}, True
    for e in EXAMPLES:
        (h_l, h_u), found = example(e)["periods"], results[f"grids.{e}"]["intervals"]["corrected, alpha"]
        left_out[e] = max(found["lower"] - h_l, 0.0) + max(h_u - found["upper"], 0.0)
        run = results[f"grids.{e}"]["algorithm"][CORRECT.name]
        elements[e] = run["size"]
        several &= run["end"] == "COVERED" and run["size"] > 1
    stable = all(results[name]["plant_abscissa"] < 0 and results[name]["filter_radius"] < 1 for name in BRACKETS)
    return Evidence(
        method="Part of the range outside (9) around its middle, U3 corrected; exact stability test; Algorithm 1.",
        holds=stable and several and min(left_out.values()) > 0,
        quantities={
            **{f"left out by one element (s), Example {e}": length for e, length in left_out.items()},
            **{f"elements that cover, Example {e}": float(size) for e, size in elements.items()},
        },
    )


def robustly_stable(e: int, results: Results) -> Evidence:
    """Whether the error system is stable over the whole range, by the exact test."""
    r = results[f"bracket.{e}"]
    margin = min(-r["plant_abscissa"], 1 - r["filter_radius"])
    return Evidence(
        method="Exact test: block-triangular with commuting Phi(h), so A Hurwitz and A_f Schur decide.",
        holds=margin > 0,
        margin=margin,
        quantities={"abscissa of A": r["plant_abscissa"], "spectral radius of A_f": r["filter_radius"]},
        note="It holds for every range of sampling periods; a grid is not needed for stability.",
    )


for e in EXAMPLES:
    THEOREM_2.feasible(
        f"stable.{e}",
        place=GAMMA[e].place,
        statement=f"The error system of Example {e} is robustly stable over the whole range.",
        uses=f"bracket.{e}",
    )(partial(robustly_stable, e))


@THEOREM_3.feasible("theorem-3.sizes", place="Theorem 3", erratum="size-of-F", pinned="reproduced after erratum")
def lmi_size_of_f(results: Results) -> Evidence:
    """The sizes of the unknowns of (10)."""
    # F C is added to an n by n block in (10), and B_f = -Y^-1 F has the size of F.
    (n, r), size = sizes()
    return Evidence(
        method="Size of the printed B_f = -Y^-1 F, against n by r.",
        holds=size == (n, r),
        as_printed=Evidence(method="The same against r by n.", holds=size == (r, n)),
    )


@THEOREM_3.feasible("recovery", place="Eq. (11)", uses="identities")
def recovery(results: Results) -> Evidence:
    """The filter by (11) from the unknowns of (10) is the one behind them."""
    return identity(results, "recovery", "Transfer matrices of random filters at one point, before and after (11).")


@THEOREM_3.feasible("congruence", place="Theorem 3, proof", uses="identities")
def congruence(results: Results) -> Evidence:
    """(10) is the congruence of (6) by diag(J_1, I, J_1, I)."""
    return identity(results, "congruence", "J'(6)J against (10) for random storage matrices and filters.")


def literal_run(e: int, results: Results) -> Evidence:
    """Whether Algorithm 1 as the text at hand reads finds a grid, and with the set-minus restored."""
    runs = results[f"grids.{e}"]["algorithm"]
    run, restored = runs[AS_PRINTED.name], runs[WITH_SET_MINUS.name]
    return Evidence(
        method="Algorithm 1 as the text at hand reads: U3 with mu(-A), sqrt(alpha) in step 4, no set-minus there. "
        "The same with a set-minus, whose sign may have been lost on the way to the text.",
        holds="COVERED" in (run["end"], restored["end"]),
        quantities={
            "passes until it stalls": float(run["rounds"]),
            "passes until it stalls, set-minus restored": float(restored["rounds"]),
            "elements": float(run["size"]),
            "elements of the correct algorithm": float(runs[CORRECT.name]["size"]),
        },
        note="The run ends when step 4 leaves the grid as it is although step 3 fails.",
    )


def grid_size(e: int, results: Results) -> Evidence:
    """The number of elements of the grid of the correct algorithm; alone its root covers with one."""
    r = results[f"grids.{e}"]
    run = r["algorithm"][CORRECT.name]
    covering = ", ".join(name for name, found in r["intervals"].items() if found["covers"]) or "none"
    return Evidence(
        method="Algorithm 1 with (9), U3 corrected, alpha in both steps and a set-minus in step 4.",
        value=float(run["size"]),
        cross_check="alpha does not depend on the filter, so the grid does not: Sigma_11 with random filters "
        f"against the plant's part, largest relative residual {results['identities']['sigma 11']:.1e}.",
        quantities={"alpha": r["alpha"], "passes": float(run["rounds"])},
        note=f"Readings of (9) in which the middle alone covers the range: {covering}. That the paper's "
        "one-element grid comes from the root of alpha that step 4 prints is an inference.",
    )


for e in EXAMPLES:
    ALGORITHM_1.feasible(
        f"algorithm.{e}",
        place="Algorithm 1",
        statement=f"Algorithm 1 as the text at hand reads finds a grid in Example {e}.",
        uses=f"grids.{e}",
        pinned="differs",
    )(partial(literal_run, e))
    ALGORITHM_1.value(
        f"grid.{e}",
        DATA[f"grid-size-{e}"],
        statement=f"Algorithm 1 ends with one element in the grid in Example {e}.",
        uses=(f"grids.{e}", "identities"),
        pinned="differs",
    )(partial(grid_size, e))
