"""Claims of Secs. III-V: the lemmas, the intervals (9), Algorithm 1, the inequalities (10) and (13)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from papers.mustafa import data
from papers.mustafa.claims.levels import solvers
from papers.mustafa.names import BRACKET, CORRECT, EXACT, GRIDS, IDENTITIES, KEY, LITERAL, ROBUST, WITH_SET_MINUS
from replication.audit.model import Claim, Evidence, Kind, Results, Verdict


def identity(name: str, method: str) -> Callable[[Results], Evidence]:
    """An answer: the largest residual of an identity over random cases."""

    def residual(results: Results) -> Evidence:
        worst = results[IDENTITIES][name]
        return Evidence(
            method=method, quantities={"largest relative residual": worst}, **_up_to_rounding(worst),
        )  # fmt: skip

    return residual


def _up_to_rounding(residual: float) -> dict[str, Any]:
    """The fields of the evidence for an identity that holds in exact arithmetic."""
    return {
        "holds": residual <= EXACT,
        "margin": EXACT - residual,
        "threshold": EXACT,
        "threshold_reason": "An identity holds up to the rounding of sums and products, relative to their size.",
    }


def misprinted(names: tuple[str, ...], method: str) -> Callable[[Results], Evidence]:
    """An answer: a formula that holds in the right order, with its least residual over the readings of the print."""

    def corrected(results: Results) -> Evidence:
        r = results[IDENTITIES]
        least = min(r[name] for name in names)
        return Evidence(
            method=method,
            **_up_to_rounding(r["map reordered"]),
            quantities={"largest residual, reordered": r["map reordered"]},
            as_printed=Evidence(
                method="The same, as printed.", quantities={"least residual": least}, **_up_to_rounding(least)
            ),
        )

    return corrected


def one_element(example: int) -> Callable[[Results], Evidence]:
    """An answer: the number of elements of the grid of the correct algorithm; alone its root covers with one."""

    def grid_size(results: Results) -> Evidence:
        r = results[GRIDS[example]]
        run = r["algorithm"][CORRECT]
        names = {name: found["covers"] for name, found in r["intervals"].items()}
        covering = ", ".join(name for name, covers in names.items() if covers) or "none"
        return Evidence(
            method="Algorithm 1 with (9), U3 corrected, alpha in both steps and a set-minus in step 4.",
            value=float(run["size"]),
            cross_check="alpha does not depend on the filter, so the grid does not: Sigma_11 with random filters "
            f"against the plant's part, largest relative residual {results[IDENTITIES]['sigma 11']:.1e}.",
            quantities={"alpha": r["alpha"], "passes": float(run["rounds"])},
            note=f"Readings of (9) in which the middle alone covers the range: {covering}. That the paper's "
            "one-element grid comes from the root of alpha that step 4 prints is an inference.",
        )

    return grid_size


def one_interval_is_conservative(results: Results) -> Evidence:
    """Whether (9) around the middle leaves part of the range out in both examples, although all of it is stable."""
    spans = {1: data.example_1()["periods"], 2: data.example_2()["periods"]}
    left_out, several = {}, True
    for example, (h_l, h_u) in spans.items():
        found = results[GRIDS[example]]["intervals"]["corrected, alpha"]
        left_out[example] = max(found["lower"] - h_l, 0.0) + max(h_u - found["upper"], 0.0)
        run = results[GRIDS[example]]["algorithm"][CORRECT]
        several &= run["end"] == "COVERED" and run["size"] > 1
    stable = all(
        r["plant_abscissa"] < 0 and r["filter_radius"] < 1 for r in (results[BRACKET[example]] for example in spans)
    )
    return Evidence(
        method="Part of the range outside (9) around its middle, U3 corrected; exact stability test; Algorithm 1.",
        holds=stable and several and min(left_out.values()) > 0,
        quantities={
            **{f"left out by one element (s), Example {e}": length for e, length in left_out.items()},
            **{
                f"elements that cover, Example {e}": float(results[GRIDS[e]]["algorithm"][CORRECT]["size"])
                for e in spans
            },
        },
    )


def lower_end_is_sharp(results: Results) -> Evidence:
    """L3: at the lower end of (9) alpha times the bound of Lemma 3 for -A reaches one."""
    centres = {1: sum(data.example_1()["periods"]) / 2, 2: sum(data.example_2()["periods"]) / 2}
    product = {}
    for example, centre in centres.items():
        r = results[GRIDS[example]]
        reach = centre - r["intervals"]["corrected, alpha"]["lower"]
        product[example] = r["alpha"] * math.expm1(r["mu_minus"] * reach) / r["mu_minus"]
    residual = max(abs(value - 1) for value in product.values())
    return Evidence(
        method="Lower end of (9) around the middle of the range: there alpha times the bound must be one.",
        **_up_to_rounding(residual),
        quantities={f"alpha times the bound, Example {e}": value for e, value in product.items()},
    )


def literal_algorithm(example: int) -> Callable[[Results], Evidence]:
    """An answer: whether Algorithm 1 as the text at hand reads finds a grid, and with the set-minus restored."""

    def literal_run(results: Results) -> Evidence:
        runs = results[GRIDS[example]]["algorithm"]
        run, restored = runs[LITERAL], runs[WITH_SET_MINUS]
        return Evidence(
            method="Algorithm 1 as the text at hand reads: U3 with mu(-A), sqrt(alpha) in step 4, no set-minus there. "
            "The same with a set-minus, whose sign may have been lost on the way to the text.",
            holds="COVERED" in (run["end"], restored["end"]),
            quantities={
                "passes until it stalls": float(run["rounds"]),
                "passes until it stalls, set-minus restored": float(restored["rounds"]),
                "elements": float(run["size"]),
                "elements of the correct algorithm": float(runs[CORRECT]["size"]),
            },
            note="The run ends when step 4 leaves the grid as it is although step 3 fails.",
        )

    return literal_run


def u3_covers(results: Results) -> Evidence:
    """U3 with mu(A): the interval holds its own centre, and ends where the bound of Lemma 3 reaches 1/alpha."""
    r = {example: results[GRIDS[example]] for example in (1, 2)}
    spans = {1: data.example_1()["periods"], 2: data.example_2()["periods"]}
    sound = dict.fromkeys(("printed", "corrected"), True)
    ends = {}
    for reading in sound:
        for example, grid in r.items():
            centre, upper = sum(spans[example]) / 2, grid["intervals"][f"{reading}, alpha"]["upper"]
            product = grid["alpha"] * math.expm1(grid["mu"] * (upper - centre)) / grid["mu"]
            sound[reading] &= upper > centre and product <= 1 + EXACT
            ends[f"alpha times the bound of Lemma 3 at the upper end, {reading}, Example {example}"] = product
    return Evidence(
        method="Upper end of (9) around the middle of the range: inside it alpha times the bound must not exceed one.",
        holds=sound["corrected"],
        quantities=ends,
        as_printed=Evidence(method="U3 as printed.", holds=sound["printed"]),
    )


def same_level_for_both(results: Results) -> Evidence:
    """One level for both channels against a free multiplier, on the same cells and in the same coordinates.

    With one level gamma for both channels, gamma is at least the norm of the uncertainty channel: alpha_i, or
    alpha_i delta_i if Delta is first divided by its radius. The smaller of both is taken. A scalar scaling changes
    neither.
    """
    r = {example: results[ROBUST[example]] for example in (1, 2)}
    excess = {
        example: min(found["lmi13_alpha"], found["lmi13_small_gain"]) - found["lmi13"] for example, found in r.items()
    }
    quantities: dict[str, float] = {}
    for example, found in r.items():
        quantities |= {
            f"one level: at least alpha, Example {example}": found["lmi13_alpha"],
            f"one level, Delta divided by its radius: at least, Example {example}": found["lmi13_small_gain"],
            f"free multipliers, Example {example}": found["lmi13"],
            f"alpha times radius with one cell, Example {example}": found["one_cell_small_gain"],
            f"one Lyapunov function over the continuum, guaranteed, Example {example}": found["guaranteed"],
        }
    return Evidence(
        method="Inference: the text omits (13) and its fixed D-scaling, so (13) is reconstructed with one multiplier "
        "per cell. Against it, on the same cells in the same modal coordinates: the least that one level for both "
        "channels forces, with a scalar scaling, in the more favourable of two normalisations of Delta.",
        holds=max(excess.values()) > 0,
        margin=max(excess.values()),
        quantities=quantities,
        solvers=tuple(record for found in r.values() for record in solvers(found)),
        note="The text says that it may: one example is enough. With one cell, as in the paper's grids, alpha times "
        "the radius exceeds one in these coordinates, so the reconstructed (13) has no solution at all.",
    )


def lmi_size_of_f(results: Results) -> Evidence:
    """F C is added to an n by n block in (10), and B_f = -Y^-1 F has the size of F."""
    n, r = len(data.matrix(data.A_F)), len(data.matrix(data.C_2))
    B_f = data.matrix(data.B_F)
    size = (len(B_f), len(B_f[0]))
    return Evidence(
        method="Size of the printed B_f = -Y^-1 F, against n by r.",
        holds=size == (n, r),
        as_printed=Evidence(method="The same against r by n.", holds=size == (r, n)),
    )


def _claim(name: str, place: str, statement: str, answer: Callable[[Results], Evidence], uses: tuple[str, ...],
           erratum: str | None = None, expected: Verdict = Verdict.CONSISTENT) -> Claim:  # fmt: skip
    return Claim(
        id=f"{KEY}.{name}", place=place, kind=Kind.FEASIBLE, statement=statement, answer=answer, uses=uses,
        expected=Verdict.REPRODUCED_AFTER_ERRATUM if erratum else expected,
        erratum=f"{KEY}.{erratum}" if erratum else None,
    )  # fmt: skip


_BOTH = (GRIDS[1], GRIDS[2])

CLAIMS: tuple[Claim, ...] = (
    _claim("lemma-2", "Lemma 2", "The error system at h_0 + theta is that at h_0 with Delta(theta) in a loop.",
           identity("lemma 2", "Both sides for random plants, periods and changes of either sign."), (IDENTITIES,)),
    _claim("lemma-3", "Lemma 3", "The norm of e^{At} is at most e^{mu(A) t}.",
           identity("lemma 3", "Largest excess over the bound for random plants and periods."), (IDENTITIES,)),
    _claim("map", "Sec. III, below (7)", "The map from w to e as a linear fractional transformation.",
           misprinted(("map as printed", "(12) as printed"),
                      "Transfer matrix at one point outside the unit circle, constant Delta; the printed brackets do "
                      "not balance, so both ways to balance them are tried."),
           (IDENTITIES,), "map"),
    _claim("map-12", "Eq. (12)", "The same map in the condition for robust performance.",
           misprinted(("(12) as printed",), "The same."), (IDENTITIES,), "map-12"),
    _claim("congruence", "Theorem 3, proof", "(10) is the congruence of (6) by diag(J_1, I, J_1, I).",
           identity("congruence", "J'(6)J against (10) for random storage matrices and filters."), (IDENTITIES,)),
    _claim("recovery", "Eq. (11)", "The filter by (11) from the unknowns of (10) is the one behind them.",
           identity("recovery", "Transfer matrices of random filters at one point, before and after (11)."),
           (IDENTITIES,)),
    _claim("theorem-3.sizes", "Theorem 3", "The sizes of the unknowns of (10).", lmi_size_of_f,
           (), "size-of-F"),
    _claim("u3", "Theorem 1, case U3", "The upper end of the interval that (8) covers.", u3_covers, _BOTH, "u3"),
    _claim("l3", "Theorem 1, case L3", "The lower end of the interval that (8) covers.", lower_end_is_sharp, _BOTH),
    _claim("conservative", "Sec. IV-A, after Theorem 1",
           "A direct use of Theorem 1 could be conservative, and several elements reduce that.",
           one_interval_is_conservative, (*_BOTH, BRACKET[1], BRACKET[2])),
    *(
        Claim(
            id=f"{KEY}.grid.{example}", place=place, kind=Kind.VALUE, printed=data.GRID_SIZE,
            statement=f"Algorithm 1 ends with one element in the grid in Example {example}.",
            expected=Verdict.DIFFERS, answer=one_element(example), uses=(GRIDS[example], IDENTITIES),
        )
        for example, place in ((1, "Sec. VI-A"), (2, "Sec. VI-B"))
    ),
    *(
        _claim(f"algorithm.{example}", "Algorithm 1",
               f"Algorithm 1 as the text at hand reads finds a grid in Example {example}.",
               literal_algorithm(example), (GRIDS[example],), expected=Verdict.DIFFERS)
        for example in (1, 2)
    ),
    _claim("same-level", "Sec. V-A", "Asking the same level of both channels may lead to conservative results.",
           same_level_for_both, (ROBUST[1], ROBUST[2])),
)  # fmt: skip
