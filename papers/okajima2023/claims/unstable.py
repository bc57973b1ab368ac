"""Sec. IV-C, the unstable plant: as printed, and with the data that the printed numbers imply."""

from __future__ import annotations

from typing import Any

from papers.okajima2023.claims.levels import solvers_of
from papers.okajima2023.experiments.declared import HALF_UNIT_OF_POLES
from papers.okajima2023.method.recovery import DIAGONAL_RANGE
from papers.okajima2023.printed import DATA, bracketed, poles
from papers.okajima2023.readings import FREE_A, RECOVERED_A, RECOVERED_PLANT, SECOND_A, UNROUNDED_GAINS
from replication.audit.declare import Part, below, positive
from replication.audit.model import Evidence, Numbers, Outcome, Results
from replication.verify.predicate import Predicate, Term, term
from replication.verify.subjects import theorems

UNSTABLE = Part("Sec. IV-C, unstable plant, gains (42)", reading=RECOVERED_PLANT)

PRINTED, RECOVERED, ALL_DIAGONALS = "unstable.as-printed", "unstable.recovered", "unstable.diagonals"
ANY_ENTRIES, STATED_DESIGNS = "unstable.any-entries", "unstable.stated-designs"
USES = (PRINTED, RECOVERED)
DIAGONAL, SETTING = "diagonal-of-a", "setting-of-4c"
AFTER: dict[str, Any] = {"uses": USES, "pinned": "compatible"}
TIMES = ("periods", "offsets")
FOUND, _ = theorems("okajima2023")
"""With the plants that the search finds, in exact numbers; the certificates are made only if it finds them again."""


def recovered(quantity: str, *given: str, of: str = "section-4c-error-poles") -> Term:
    """A number of the plant of Sec. IV-C, with these parts of it as the search for a theorem finds them."""
    return term(quantity, "section-4c", **{name: FOUND[of].parameters[name] for name in given})


def _search_of_the_diagonal(results: Results) -> str:
    state = results[RECOVERED]["state"]
    return (
        f"The diagonal was chosen to have these poles: of {state['tried']} in steps of {state['step']} from "
        f"{DIAGONAL_RANGE[0]} to {DIAGONAL_RANGE[1]}, {len(state['fits'])} has them, {tuple(state['fits'][0])}."
    )


def _search_of_the_outputs(results: Results) -> str:
    found = results[RECOVERED]["outputs"]
    return (
        f"C was chosen to have these poles: of {found['tried']} integer matrices with entries of size up to "
        f"{found['bound']}, {found['fits']} has them within rounding, {bracketed(found['C'])}; "
        f"misfit {found['best_misfit']:.2f} of what rounding allows, the next {found['second_misfit']:.2f}."
    )


def _one_real_one_pair(found: list[list[float]]) -> Numbers:
    (real, _), (pair, imaginary) = found
    return (real, (pair, abs(imaginary)))


def radius_of(found: list[list[float]]) -> float:
    """The largest modulus of some poles."""
    return max(float((real**2 + imaginary**2) ** 0.5) for real, imaginary in found)


def _by_stated_order(found: list[list[float]]) -> Numbers:
    """The real parts of three poles, each beside the stated pole of the same rank by size."""
    stated = [abs(real) for real, _ in poles(DATA["error-poles"])]
    ranked = sorted((pole[0] for pole in found), key=abs, reverse=True)
    return tuple(ranked[sorted(stated, reverse=True).index(size)] for size in stated)


@UNSTABLE.feasible(
    "unstable.same-setting",
    place="Sec. IV-C, before eq. (41)",
    uses=(PRINTED, ANY_ENTRIES),
    erratum=DIAGONAL,
    pinned="compatible",
    reading=FREE_A,
    says=recovered("stable error system", *TIMES, "A", of="section-4c-free-setting"),
)
def same_setting(results: Results) -> Evidence:
    """With some A that has the stated poles, and all else as in Sec. IV-A, the gains (42) stabilise A_e."""
    free, printed = results[ANY_ENTRIES], radius_of(results[PRINTED]["error_poles"])
    fits = _rounds_to(free["poles"], poles(DATA["poles"]), HALF_UNIT_OF_POLES)
    return Evidence(
        method="Spectral radius over one period of A_e with such an A, the C of Sec. IV-A and the gains (42).",
        holds=fits and free["radius"] < 1,
        margin=1 - free["radius"] if fits else None,
        as_printed=positive(1 - printed, method="The same with A as printed."),
        quantities={
            "other entries free, spectral radius": free["radius"],
            "other entries free, furthest entry of A from its print": free["furthest"],
            **{
                f"other entries free, pole of A_e {i + 1}, before A is rounded": pole[0]
                for i, pole in enumerate(free["error_poles"])
            },
            "spectral radius, A as printed": printed,
        },
        note=f"The text excepts A and says no more. A = {bracketed(free['rounded'])} has the stated poles and is "
        "stabilised; there A_e has the stated poles too, before A is rounded. It is one of many, found for the "
        "purpose, and no proposal of what was meant.",
    )


@UNSTABLE.feasible(
    "unstable.diagonal-alone",
    place="Sec. IV-C, before eq. (41)",
    uses=(RECOVERED, ALL_DIAGONALS),
    reading=RECOVERED_A,
    ours=True,
    says=[
        Predicate(of=recovered("stable error system", *TIMES, "diagonal", of=name), relation="fails", reading=reading)
        for reading, name in ((RECOVERED_A, "section-4c-same-setting"), (SECOND_A, "section-4c-second-setting"))
    ],
)
def diagonal_alone(results: Results) -> Evidence:
    """The gains (42) stabilise no plant of which A differs from Sec. IV-A on its diagonal alone and has the stated
    poles, C as there."""
    radius = radius_of(results[RECOVERED]["outputs"]["error_poles_printed_C"])
    found = results[ALL_DIAGONALS]
    least = [row["least_radius"] for row in found["found"]]
    sizes = (radius, *(row["radius"] for row in found["found"][1:]))
    return Evidence(
        method="Spectral radius over one period of A_e with each such diagonal, the C of Sec. IV-A and the gains (42).",
        holds=min(sizes) > 1,
        margin=min(sizes) - 1,
        cross_check=(
            f"{len(least)} real diagonals have the stated poles exactly; at {found['moved']} points of the rounding of "
            f"these poles the radius is never below {min(least):.3f}."
        ),
        outcomes=tuple(
            Outcome(reading=name, holds=size > 1, margin=size - 1)
            for name, size in zip((RECOVERED_A, SECOND_A), sizes, strict=True)
        ),
        note="Proved for two diagonals, and so at the points tried of the rounding.",
    )


def _rounds_to(found: list[list[float]], stated: list[list[float]], half_unit: float) -> bool:
    """Whether poles, one of each pair, are the stated ones within half a unit of each part; in the same order."""
    pairs = zip(found, stated, strict=True)
    return all(abs(a - b) <= half_unit for pole, other in pairs for a, b in zip(pole, other, strict=True))


@UNSTABLE.value(
    "unstable.poles",
    DATA["poles"],
    erratum=DIAGONAL,
    reading=RECOVERED_A,
    says=recovered("poles", "diagonal"),
    **AFTER,
)
def plant_poles(results: Results) -> Evidence:
    """The poles of the matrix A of Sec. IV-C, with the diagonal that was chosen to have them."""
    return Evidence(
        method="Eigenvalues of A with the recovered diagonal.",
        cross_check=_search_of_the_diagonal(results),
        value=_one_real_one_pair(results[RECOVERED]["state"]["poles_recovered"]),
        as_printed=Evidence(
            method="Eigenvalues of A as printed in eq. (41).",
            value=_one_real_one_pair(results[PRINTED]["poles"]),
        ),
    )


@UNSTABLE.feasible(
    "unstable.is-unstable",
    place="Sec. IV-C, after eq. (41)",
    erratum=DIAGONAL,
    reading=RECOVERED_A,
    says=recovered("unstable plant", "diagonal"),
    **AFTER,
)
def plant_unstable(results: Results) -> Evidence:
    """The matrix A of Sec. IV-C has a pole outside the unit circle."""
    return positive(
        radius_of(results[RECOVERED]["state"]["poles_recovered"]) - 1,
        method="Largest modulus of the eigenvalues of A with the recovered diagonal, minus one.",
        note="The diagonal was chosen to have the stated poles, of which this follows.",
        as_printed=positive(radius_of(results[PRINTED]["poles"]) - 1, method="The same for A as printed."),
    )


@UNSTABLE.feasible("unstable.gains-optimal", place="Eq. (42)", erratum=SETTING, **AFTER)
def gains_near_optimal(results: Results) -> Evidence:
    """For the recovered plant, the gains (42) exceed the smallest level by less than rounding them can cost, to first
    order."""
    inputs, achieved = results[RECOVERED]["inputs"], results[RECOVERED]["gains"]
    return below(
        achieved["norm"]["value"] - achieved["optimum"],
        achieved["rounding_spread"],
        "What rounding the 15 printed entries to three decimals can cost, linearised.",
        method=(
            "Exact norm of the gains (42) minus the exact optimum, for the recovered plant, against the (linearised) "
            "effect of rounding each entry by half a unit."
        ),
        cross_check=(
            "Nearest analytic centre of the matrix inequality, which interior-point methods follow: largest difference "
            f"of the 15 entries {inputs['largest_gain_difference']:.5f}, where rounding explains "
            f"{results[RECOVERED]['attained']['half_unit']:g}."
        ),
        quantities={
            "norm of the printed gains": achieved["norm"]["value"],
            "optimum": achieved["optimum"],
            "relative excess, best of all B_d and D tried": inputs["best_excess"],
            "relative excess, second best": inputs["second_excess"],
            "pairs of B_d and D tried": inputs["tried"],
        },
        as_printed=positive(
            1 - radius_of(results[PRINTED]["error_poles"]),
            method="Stability of A_e with A and C as printed, without which the gains have no finite level.",
        ),
        note=(
            "The text prints no level for this plant. B_d and D were chosen to make this excess least among those "
            "tried, so it bears the choice out and does not test it; only their ratio is identifiable, up to a sign."
        ),
    )


@UNSTABLE.value(
    "unstable.error-poles",
    DATA["error-poles"],
    erratum=SETTING,
    uses=USES,
    pinned="compatible",
    says=[
        Predicate(
            of=recovered("error poles", *TIMES, "diagonal", "C"),
            relation="is",
            to=str(DATA["error-poles"]),
            reading=reading,
        )
        for reading in (RECOVERED_PLANT, UNROUNDED_GAINS)
    ],
)
def error_poles(results: Results) -> Evidence:
    """The poles of A_e with the gains (42), for an A and a C that were chosen to have them: no independent evidence."""
    attained = results[RECOVERED]["attained"]
    return Evidence(
        method="Eigenvalues of A_e with the gains (42) as printed, for the recovered A and C.",
        cross_check=_search_of_the_outputs(results),
        value=_by_stated_order(results[RECOVERED]["outputs"]["error_poles"]),
        quantities={
            "change of the gains that gives the stated poles": attained["largest_change"],
            "half a unit in the last place of the gains": attained["half_unit"],
        },
        as_printed=Evidence(
            method="The same with A and C as printed.", value=_by_stated_order(results[PRINTED]["error_poles"])
        ),
        outcomes=(
            Outcome(reading=RECOVERED_PLANT, value=_by_stated_order(results[RECOVERED]["outputs"]["error_poles"])),
            Outcome(reading=UNROUNDED_GAINS, value=_by_stated_order(attained["error_poles"])),
        ),
        note=(
            "C and the unrounded gains were chosen to have these poles. Changing the gains by at most "
            f"{attained['largest_change']:.2g}, less than half a unit of their last place "
            f"({attained['half_unit']:g}), gives the stated poles, so the rounding of the printed gains contains the "
            "print."
        ),
    )


@UNSTABLE.feasible(
    "unstable.stabilised",
    place="Sec. IV-C, after eq. (42)",
    erratum=SETTING,
    says=recovered("stable error system", *TIMES, "diagonal", "C"),
    **AFTER,
)
def error_stable(results: Results) -> Evidence:
    """The gains (42) stabilise the error system of the recovered plant."""
    return positive(
        1 - radius_of(results[RECOVERED]["outputs"]["error_poles"]),
        method="Spectral radius over one period with the gains (42), for the recovered plant.",
        as_printed=positive(
            1 - radius_of(results[PRINTED]["error_poles"]), method="The same with A and C as printed (a stable plant)."
        ),
    )


@UNSTABLE.feasible(
    "unstable.designable",
    place="Sec. IV-C, last sentence",
    uses=STATED_DESIGNS,
    erratum=DIAGONAL,
    pinned="compatible",
    reading=FREE_A,
    says=[
        said
        for name in ("section-4c-design", "section-4c-second-design", "section-4c-free-design")
        for said in (
            recovered("design by Theorem 2", *TIMES, "A", "B_d", "D", of=name),
            recovered("unstable plant", "A", of=name),
        )
    ],
)
def designable(results: Results) -> Evidence:
    """Theorem 2 designs an observer for each unstable A tried that has the stated poles, all else as in Sec. IV-A."""
    found, stated = results[STATED_DESIGNS], poles(DATA["poles"])
    excess = max(one["reduced_lmi"]["norm"] / one["optimum"] - 1 for one in found.values())
    fit = all(_rounds_to(one["poles"], stated, HALF_UNIT_OF_POLES) for one in found.values())
    least = min(radius_of(one["poles"]) for one in found.values())
    return below(
        excess if fit and least > 1 else 1.0,
        1e-7,
        "Relative distance from the optimum at which a design counts as optimal.",
        method="Exact norm of the gains of Theorem 2 (reduced form) relative to the exact optimum, for each A tried: "
        "both diagonals with the stated poles, and an A that differs elsewhere. Largest.",
        solvers=tuple(record for one in found.values() for record in solvers_of(one)),
        quantities={f"optimum, {name}": one["optimum"] for name, one in found.items()},
        note="The A that our copy prints is stable: a design for it would not bear the sentence out.",
    )
