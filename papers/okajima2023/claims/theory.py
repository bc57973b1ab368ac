"""Claims about the problem formulation and Theorems 1 and 2, as identities on random data and facts of the designs."""

from __future__ import annotations

from collections.abc import Callable

from papers.okajima2023 import data
from papers.okajima2023.designs import GAIN_SETS, KEY, case, gain_set, pair
from replication.audit.model import Claim, Evidence, Kind, Results, Verdict

IDENTITIES = f"{KEY}.identities"
ORDERS = f"{KEY}.product-orders"
DUAL_RATE = f"{KEY}.schedule.dual-rate"
IDENTITY_TOLERANCE = 1e-12
IDENTITY_REASON = "An identity on random data, relative: rounding alone leaves about a thousandth of it."
ROUTE_TOLERANCE = 1e-8
ROUTE_REASON = "Relative distance of two routes to the same level; an interior-point solver ends about this near."


def schedule(name: str) -> str:
    """Name of the experiment that computes the matrices S_k of one example."""
    return f"{KEY}.schedule.{name}"


def selection(name: str) -> Callable[[Results], Evidence]:
    """An answer: the diagonals of S_0 ... S_{N-1} of one example."""

    def diagonals_of_selection(results: Results) -> Evidence:
        rows = results[schedule(name)]["diagonals"]
        return Evidence(
            method="Schedule rule: sensor i measures at k iff k - θᵢ is a multiple of Nᵢ.",
            value=tuple(tuple(row) for row in rows),
        )

    return diagonals_of_selection


def common_period(results: Results) -> Evidence:
    """The period of the schedule of Sec. IV-A."""
    return Evidence(method="Least common multiple.", value=float(results[schedule("sec-4a")]["period"]))


def identity(residual: str, what: str) -> Callable[[Results], Evidence]:
    """An answer: one of the residuals of the identities on random data."""

    def identity_on_random_data(results: Results) -> Evidence:
        result = results[IDENTITIES]
        return Evidence(
            method=f"{what}, {result['trials']} random problems; largest relative residual.",
            holds=result[residual] < IDENTITY_TOLERANCE,
            margin=IDENTITY_TOLERANCE - result[residual],
            threshold=IDENTITY_TOLERANCE,
            threshold_reason=IDENTITY_REASON,
            quantities={"largest relative residual": result[residual]},
        )

    return identity_on_random_data


def dual_rate_is_special_case(results: Results) -> Evidence:
    """The proposed observer with both sensors at a common period has S_0 = I and no other measurement."""
    first, *others = results[DUAL_RATE]["diagonals"]
    holds = all(value == 1 for value in first) and not any(value for row in others for value in row)
    return Evidence(
        method="Schedule with N₁ = N₂ = 6 and no offset.",
        holds=holds,
        note="That this is the observer of the cited work cannot be checked from this text.",
    )


def theorem1_is_exact(results: Results) -> Evidence:
    """Level that Theorem 1 certifies against the exact norm, for the four printed gain sets."""
    distances = [
        abs(results[gain_set(equation)]["theorem1"] / results[gain_set(equation)]["norm"]["value"] - 1)
        for equation in GAIN_SETS
    ]
    return Evidence(
        method="Relative distance of Theorem 1's smallest level from the exact norm, largest of the four gain sets.",
        holds=max(distances) < ROUTE_TOLERANCE,
        margin=ROUTE_TOLERANCE - max(distances),
        threshold=ROUTE_TOLERANCE,
        threshold_reason=ROUTE_REASON,
        note="The text proves only that the condition is sufficient; it is also tight.",
    )


def gains_attain_level(results: Results) -> Evidence:
    """Exact norm of L_k = P_k^-1 Y_k against the level of Theorem 2, over all designs: never above it."""
    distances = [results[name]["lmi"]["norm"] / results[name]["lmi"]["level"] - 1 for name in _DESIGNS]
    return Evidence(
        method="Exact norm of the gains from the inequality as printed, relative to its level; largest of all designs.",
        holds=max(distances) < ROUTE_TOLERANCE,
        margin=ROUTE_TOLERANCE - max(distances),
        threshold=ROUTE_TOLERANCE,
        threshold_reason=ROUTE_REASON,
    )


def theorem2_is_exact(results: Results) -> Evidence:
    """Level of Theorem 2 against the exact optimum, over all designs."""
    distances = [abs(results[name]["lmi"]["level"] / results[name]["optimum"] - 1) for name in _DESIGNS]
    return Evidence(
        method="Relative distance of Theorem 2's level from the exact optimum, largest of all designs.",
        holds=max(distances) < ROUTE_TOLERANCE,
        margin=ROUTE_TOLERANCE - max(distances),
        threshold=ROUTE_TOLERANCE,
        threshold_reason=ROUTE_REASON,
        quantities={"smallest eigenvalue of all P_k, Sec. IV-A": results[case("proposed")]["smallest_eigenvalue_P"]},
        note=(
            "The text claims sufficiency only; the condition loses nothing. The inequality forces P_k > WᵀW, more than "
            "the P_k > 0 that it is stated with."
        ),
    )


def stabilised(results: Results) -> Evidence:
    """Spectral radius of A_e for the four printed gain sets of the stable plant."""
    radius = max(results[gain_set(equation)]["spectral_radius"] for equation in GAIN_SETS)
    return Evidence(
        method="Spectral radius over one period, largest of the four printed gain sets.",
        holds=radius < 1,
        margin=1 - radius,
    )


def start_of_the_period(results: Results) -> Evidence:
    """Poles of A_e if the product starts at instant 0 or 1, and if its factors are taken in the other order."""
    orders = results[ORDERS]
    shifted = max(abs(a - b) for a, b in zip(orders["descending"], orders["shifted"], strict=True))
    ascending = max(abs(a - b) for a, b in zip(orders["descending"], orders["ascending"], strict=True))
    return Evidence(
        method="Moduli of the eigenvalues of the product over one period, gains (33), for both starts.",
        holds=shifted < IDENTITY_TOLERANCE,
        margin=IDENTITY_TOLERANCE - shifted,
        threshold=IDENTITY_TOLERANCE,
        threshold_reason=IDENTITY_REASON,
        quantities={
            "difference if the product starts at 1 instead of 0": shifted,
            "difference if the factors are taken in the other order": ascending,
        },
        note=(
            "Conditions and printed gains count from 0 to N − 1, the product from 1 to N; its poles are the same. Only "
            "the order that the text spells out in parentheses, later factors to the left, is the one of the error."
        ),
    )


def observable(results: Results) -> Evidence:
    """Rank of the observability matrix of the example plant, by its smallest relative singular value."""
    margin = results[f"{KEY}.observability"]["margin"]
    return Evidence(
        method="Smallest singular value of the observability matrix relative to the largest.",
        holds=margin > 0,
        margin=margin,
    )


_DESIGNS = (
    *(pair(periods) for periods in data.TABLE_1),
    *(case(name) for name in "ABC"),
    *(pair((3, 3), theta) for theta in (1, 2)),
)

_SELECTION_PLACES = {
    "eqs-7-8": "Eqs. (5)-(8)",
    "eqs-11-12": "Eqs. (9)-(12)",
    "sec-4a": "Sec. IV-A, before eq. (33)",
    "case-1": "Sec. IV-B, Case 1",
    "case-2": "Sec. IV-B, Case 2",
    "case-3": "Sec. IV-B, Case 3, eq. (37)",
}


def _selections() -> list[Claim]:
    claims = []
    for name, place in _SELECTION_PLACES.items():
        periods, offsets, diagonals = data.SELECTION[name]
        claims.append(
            Claim(
                id=f"{KEY}.schedule.{name}",
                place=place,
                kind=Kind.MATRIX,
                statement=f"Diagonals of S₀, S₁, … for periods {periods} and offsets {offsets}, one row per instant.",
                expected=Verdict.REPRODUCED,
                answer=selection(name),
                uses=(schedule(name),),
                printed=data.selection_matrix(diagonals),
            )
        )
    return claims


def _identity_claim(name: str, place: str, statement: str, residual: str, what: str) -> Claim:
    return Claim(
        id=f"{KEY}.theory.{name}",
        place=place,
        kind=Kind.FEASIBLE,
        statement=statement,
        expected=Verdict.CONSISTENT,
        answer=identity(residual, what),
        uses=(IDENTITIES,),
    )


def _fact(name: str, place: str, statement: str, answer: Callable[[Results], Evidence], uses: tuple[str, ...]) -> Claim:
    return Claim(
        id=f"{KEY}.theory.{name}",
        place=place,
        kind=Kind.FEASIBLE,
        statement=statement,
        expected=Verdict.CONSISTENT,
        answer=answer,
        uses=uses,
    )


CLAIMS: tuple[Claim, ...] = (
    *_selections(),
    _fact(
        "product",
        "After eq. (16)",
        "A_e is a product over one period, in the order of time.",
        start_of_the_period,
        (ORDERS,),
    ),
    Claim(
        id=f"{KEY}.schedule.common-period",
        place="Sec. IV-A",
        kind=Kind.VALUE,
        statement="The period of the observer for N₁ = 2 and N₂ = 3.",
        expected=Verdict.REPRODUCED,
        answer=common_period,
        uses=(schedule("sec-4a"),),
        printed="6",
    ),
    _fact(
        "observable",
        "Sec. II-A",
        "The pair (C, A) of the example is observable.",
        observable,
        (f"{KEY}.observability",),
    ),
    _identity_claim(
        "error-system",
        "Eq. (16)",
        "The error of the observer (15) obeys the error system (16).",
        "error_system",
        "Plant and observer simulated in their own loops against the error system",
    ),
    _identity_claim(
        "dissipation",
        "Eqs. (20)-(23)",
        "The quadratic form of the matrix (20) is the dissipation of eq. (23).",
        "dissipation",
        "Quadratic form of (20) against the left-hand side of (23)",
    ),
    _identity_claim(
        "schur",
        "Eqs. (30)-(32)",
        "With Y = P L, the inequality (30) is the inequality (19) by a Schur complement.",
        "schur",
        "Schur complement of (30) against (20)",
    ),
    _fact(
        "dual-rate",
        "After eq. (15)",
        "With S₀ = I and no other measurement the observer is a dual-rate observer.",
        dual_rate_is_special_case,
        (DUAL_RATE,),
    ),
    _fact(
        "theorem1",
        "Theorem 1",
        "The matrix inequality of Theorem 1 evaluates the gain of a given observer.",
        theorem1_is_exact,
        tuple(gain_set(equation) for equation in GAIN_SETS),
    ),
    _fact(
        "theorem2",
        "Theorem 2",
        "Minimising the level under Theorem 2 finds the optimal observer.",
        theorem2_is_exact,
        _DESIGNS,
    ),
    _fact(
        "gains-attain",
        "Eq. (31)",
        "The gains P⁻¹Y of eq. (31) achieve the level of Theorem 2.",
        gains_attain_level,
        _DESIGNS,
    ),
    _fact(
        "stable",
        "Theorems 1 and 2, eqs. (33), (38)-(40)",
        "The error system with the printed gains is stable.",
        stabilised,
        tuple(gain_set(equation) for equation in GAIN_SETS),
    ),
)
