"""Sec. IV-C, the unstable plant: as printed, and with the data that the printed numbers imply."""

from __future__ import annotations

from typing import Any

from papers.okajima2023.claims.levels import solvers_of
from papers.okajima2023.printed import DATA, bracketed, poles
from replication.audit.declare import Part, below, positive
from replication.audit.model import Evidence, Numbers, Results

UNSTABLE = Part("Sec. IV-C, unstable plant, gains (42)")

PRINTED, RECOVERED = "unstable.as-printed", "unstable.recovered"
USES = (PRINTED, RECOVERED)
DIAGONAL, SETTING = "diagonal-of-a", "setting-of-4c"
AFTER: dict[str, Any] = {"uses": USES, "pinned": "reproduced after erratum"}


def _search_of_the_diagonal(results: Results) -> str:
    state = results[RECOVERED]["state"]
    return (
        f"Of {state['tried']} diagonals on a grid of {state['step']}, {len(state['fits'])} gives the stated poles: "
        f"{tuple(state['fits'][0])}."
    )


def _search_of_the_outputs(results: Results) -> str:
    found = results[RECOVERED]["outputs"]
    return (
        f"Of {found['tried']} integer matrices C, {found['fits']} explains the stated poles by rounding: "
        f"{bracketed(found['C'])}; "
        f"misfit {found['best_misfit']:.2f} of what rounding allows, the next {found['second_misfit']:.2f}."
    )


def _one_real_one_pair(found: list[list[float]]) -> Numbers:
    (real, _), (pair, imaginary) = found
    return (real, (pair, abs(imaginary)))


def _radius(found: list[list[float]]) -> float:
    """The largest modulus of some poles."""
    return max(float((real**2 + imaginary**2) ** 0.5) for real, imaginary in found)


def _by_stated_order(found: list[list[float]]) -> Numbers:
    """The real parts of three poles, each beside the stated pole of the same rank by size."""
    stated = [abs(real) for real, _ in poles(DATA["error-poles"])]
    ranked = sorted((pole[0] for pole in found), key=abs, reverse=True)
    return tuple(ranked[sorted(stated, reverse=True).index(size)] for size in stated)


@UNSTABLE.feasible(
    "unstable.same-setting", place="Sec. IV-C, before eq. (41)", erratum=DIAGONAL, uses=USES, pinned="differs"
)
def same_setting(results: Results) -> Evidence:
    """Nothing but the matrix A differs from the setting of Sec. IV-A."""
    radius = _radius(results[RECOVERED]["outputs"]["error_poles_printed_C"])
    return positive(
        1 - radius,
        method="Spectral radius over one period of A_e with the recovered A, the C of Sec. IV-A and the gains (42).",
        quantities={"spectral radius": radius},
        note="the sentence names no A of its own; the one of eq. (41) is that of Sec. IV-A.",
    )


@UNSTABLE.value("unstable.poles", DATA["poles"], erratum=DIAGONAL, **AFTER)
def plant_poles(results: Results) -> Evidence:
    """The poles of the unstable plant."""
    return Evidence(
        method="Eigenvalues of A with the recovered diagonal.",
        cross_check=_search_of_the_diagonal(results),
        value=_one_real_one_pair(results[RECOVERED]["state"]["poles_recovered"]),
        as_printed=Evidence(
            method="Eigenvalues of A as printed in eq. (41).",
            value=_one_real_one_pair(results[PRINTED]["poles"]),
        ),
    )


@UNSTABLE.feasible("unstable.is-unstable", place="Sec. IV-C, after eq. (41)", erratum=DIAGONAL, **AFTER)
def plant_unstable(results: Results) -> Evidence:
    """The plant is unstable."""
    return positive(
        _radius(results[RECOVERED]["state"]["poles_recovered"]) - 1,
        method="Largest modulus of the eigenvalues of A with the recovered diagonal, minus one.",
        as_printed=positive(_radius(results[PRINTED]["poles"]) - 1, method="The same for A as printed."),
    )


@UNSTABLE.feasible("unstable.gains-optimal", place="Eq. (42)", erratum=SETTING, **AFTER)
def gains_near_optimal(results: Results) -> Evidence:
    """The gains (42) come from minimising the level under Theorem 2."""
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
            f"of the 15 entries {inputs['largest_gain_difference']:.5f}."
        ),
        quantities={
            "norm of the printed gains": achieved["norm"]["value"],
            "optimum": achieved["optimum"],
            "relative excess, best of all B_d and D tried": inputs["best_excess"],
            "relative excess, second best": inputs["second_excess"],
            "pairs of B_d and D tried": inputs["tried"],
        },
        note=(
            "The text prints no level for this plant. Only the ratio of B_d to D is identifiable, and not the sign of "
            "B_d."
        ),
    )


@UNSTABLE.value("unstable.error-poles", DATA["error-poles"], erratum=SETTING, uses=USES, pinned="differs")
def error_poles(results: Results) -> Evidence:
    """The poles of A_e with the gains (42)."""
    attained = results[RECOVERED]["attained"]
    return Evidence(
        method="Eigenvalues of A_e with the gains (42) as printed, for the recovered plant.",
        cross_check=_search_of_the_outputs(results),
        value=_by_stated_order(results[RECOVERED]["outputs"]["error_poles"]),
        quantities={
            "change of the gains that gives the stated poles": attained["largest_change"],
            "half a unit in the last place of the gains": attained["half_unit"],
        },
        as_printed=Evidence(
            method="The same with A and C as printed.", value=_by_stated_order(results[PRINTED]["error_poles"])
        ),
        note=(
            f"The gains are printed to three decimals. Changing them by at most {attained['largest_change']:.2g}, less "
            f"than half a unit ({attained['half_unit']:g}), gives exactly the stated poles, so rounding explains the "
            "difference; the poles come out to their digits only with gains that are not printed."
        ),
    )


@UNSTABLE.feasible("unstable.stabilised", place="Sec. IV-C, after eq. (42)", erratum=SETTING, **AFTER)
def error_stable(results: Results) -> Evidence:
    """The gains (42) stabilise the error system of the unstable plant."""
    return positive(
        1 - _radius(results[RECOVERED]["outputs"]["error_poles"]),
        method="Spectral radius over one period with the gains (42), for the recovered plant.",
        as_printed=positive(
            1 - _radius(results[PRINTED]["error_poles"]), method="The same with A and C as printed (a stable plant)."
        ),
    )


@UNSTABLE.feasible("unstable.designable", place="Sec. IV-C, last sentence", erratum=SETTING, **AFTER)
def designable(results: Results) -> Evidence:
    """Theorem 2 designs an observer for the unstable plant."""
    result = results[RECOVERED]["design"]
    return below(
        result["reduced_lmi"]["norm"] / result["optimum"] - 1,
        1e-7,
        "Relative distance from the optimum at which a design counts as optimal.",
        method="Exact norm of the gains of Theorem 2 (reduced form) relative to the exact optimum, recovered plant.",
        solvers=solvers_of(result),
        quantities={"optimum": result["optimum"], "norm of the gains": result["reduced_lmi"]["norm"]},
        note="The plant as printed is stable, so the statement has no printed reading.",
    )
