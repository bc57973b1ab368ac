"""Claims of Secs. III-V: the lemmas, the intervals (9), Algorithm 1, the inequalities (10) and (13)."""

from __future__ import annotations

import math
from collections.abc import Callable

from papers.mustafa import data
from papers.mustafa.claims.levels import solvers
from papers.mustafa.names import CORRECT, EXACT, GRIDS, IDENTITIES, KEY, LITERAL, ROBUST
from replication.audit.model import Claim, Evidence, Kind, Results, Verdict


def identity(name: str, method: str) -> Callable[[Results], Evidence]:
    """An answer: the largest residual of an identity over random cases."""

    def residual(results: Results) -> Evidence:
        worst = results[IDENTITIES][name]
        return Evidence(
            method=method, holds=worst <= EXACT, quantities={"largest relative residual": worst},
        )  # fmt: skip

    return residual


def misprinted(name: str, method: str) -> Callable[[Results], Evidence]:
    """An answer: a formula that holds in the right order, with its residual as printed."""

    def corrected(results: Results) -> Evidence:
        r = results[IDENTITIES]
        right = Evidence(
            method=method,
            holds=r["map reordered"] <= EXACT,
            quantities={"largest residual, reordered": r["map reordered"]},
            as_printed=Evidence(
                method="The same, as printed.", holds=r[name] <= EXACT, quantities={"least residual": r[name]}
            ),
        )
        return right

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
            quantities={"alpha": r["alpha"], "passes": float(run["rounds"])},
            note=f"Readings of (9) in which the middle alone covers the range: {covering}.",
        )

    return grid_size


def root_covers(results: Results) -> Evidence:
    """Whether H(h_0, sqrt(alpha)) with U3 corrected covers the range in both examples."""
    found = [results[GRIDS[example]]["intervals"]["corrected, root"] for example in (1, 2)]
    spans = [data.example_1()["periods"], data.example_2()["periods"]]
    margin = min(item["upper"] - span[1] for item, span in zip(found, spans, strict=True))
    return Evidence(
        method="Interval (9) around the middle with sqrt(alpha) for alpha, as in step 4, U3 corrected.",
        holds=all(item["covers"] for item in found),
        margin=margin,
        note="The one-element grids of both examples come from the root, which (8) does not allow: an inference.",
    )


def literal_algorithm(example: int) -> Callable[[Results], Evidence]:
    """An answer: whether Algorithm 1 as printed finds a grid."""

    def literal_run(results: Results) -> Evidence:
        runs = results[GRIDS[example]]["algorithm"]
        run = runs[LITERAL]
        return Evidence(
            method="Algorithm 1 as printed: U3 with mu(-A), sqrt(alpha) in step 4, a union in place of a set-minus.",
            holds=run["end"] == "COVERED",
            quantities={
                "passes until it stalls": float(run["rounds"]),
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
    """One level for both channels bounds alpha from above, so it is far above what a free multiplier reaches."""
    r = results[ROBUST[1]]
    return Evidence(
        method="With one level for both channels (13) forces gamma >= alpha; with one free multiplier per cell it does "
        "not (reconstructed, since the text omits the inequality).",
        holds=r["alpha"] > r["lmi13"],
        margin=r["alpha"] - r["lmi13"],
        quantities={
            "alpha": r["alpha"],
            "reconstructed (13)": r["lmi13"],
            "one Lyapunov function over the continuum": r["exchange"],
        },
        solvers=solvers(r),
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
           misprinted("map as printed", "Transfer matrix at one point outside the unit circle, constant Delta."),
           (IDENTITIES,), "map"),
    _claim("map-12", "Eq. (12)", "The same map in the condition for robust performance.",
           misprinted("(12) as printed", "The same."), (IDENTITIES,), "map-12"),
    _claim("congruence", "Theorem 3, proof", "(10) is the congruence of (6) by diag(J_1, I, J_1, I).",
           identity("congruence", "J'(6)J against (10) for random storage matrices and filters."), (IDENTITIES,)),
    _claim("theorem-3.sizes", "Theorem 3", "The sizes of the unknowns of (10).", lmi_size_of_f,
           (), "size-of-F"),
    _claim("u3", "Theorem 1, case U3", "The upper end of the interval that (8) covers.", u3_covers, _BOTH, "u3"),
    *(
        Claim(
            id=f"{KEY}.grid.{example}", place=place, kind=Kind.VALUE, printed=data.GRID_SIZE,
            statement=f"Algorithm 1 ends with one element in the grid in Example {example}.",
            expected=Verdict.DIFFERS, answer=one_element(example), uses=(GRIDS[example],),
        )
        for example, place in ((1, "Sec. VI-A"), (2, "Sec. VI-B"))
    ),
    _claim("grid.root", "Algorithm 1, step 4; Sec. VI",
           "With the root of alpha that step 4 prints, the middle of the range alone covers it in both examples.",
           root_covers, _BOTH),
    *(
        _claim(f"algorithm.{example}", "Algorithm 1", f"Algorithm 1 as printed finds a grid in Example {example}.",
               literal_algorithm(example), (GRIDS[example],), expected=Verdict.DIFFERS)
        for example in (1, 2)
    ),
    _claim("same-level", "Sec. V-A", "The same level for both channels leads to conservative results.",
           same_level_for_both, (ROBUST[1],)),
)  # fmt: skip
