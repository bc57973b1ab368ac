"""Claims of Sec. IV-C, the unstable plant: as printed, and with the data that the printed numbers imply."""

from __future__ import annotations

from papers.okajima2023 import data
from papers.okajima2023.designs import KEY
from replication.audit.judge.printed import parse
from replication.audit.model import Claim, Evidence, Kind, Numbers, Results, SolverRecord, Verdict

PRINTED, RECOVERED = f"{KEY}.unstable.as-printed", f"{KEY}.unstable.recovered"
USES = (PRINTED, RECOVERED)
DIAGONAL = f"{KEY}.diagonal-of-a"
SETTING = f"{KEY}.setting-of-4c"


def plant_poles(results: Results) -> Evidence:
    """Poles of A: with the diagonal that reproduces them, and as printed in eq. (41)."""
    return Evidence(
        method="Eigenvalues of A with the recovered diagonal.",
        cross_check=_search_of_the_diagonal(results),
        value=_one_real_one_pair(results[RECOVERED]["state"]["poles_recovered"]),
        as_printed=Evidence(
            method="Eigenvalues of A as printed in eq. (41).",
            value=_one_real_one_pair(results[PRINTED]["poles"]),
        ),
    )


def plant_unstable(results: Results) -> Evidence:
    """Largest modulus of the poles of A: with the recovered diagonal, and as printed."""
    margin = max(map(_modulus, results[RECOVERED]["state"]["poles_recovered"])) - 1
    literal = max(map(_modulus, results[PRINTED]["poles"])) - 1
    return Evidence(
        method="Largest modulus of the eigenvalues of A with the recovered diagonal, minus one.",
        holds=margin > 0,
        margin=margin,
        as_printed=Evidence(method="The same for A as printed.", holds=literal > 0, margin=literal),
    )


def same_setting(results: Results) -> Evidence:
    """Gains (42) with A recovered and C as in Sec. IV-A: they must stabilise if nothing but A changed."""
    radius = max(map(_modulus, results[RECOVERED]["outputs"]["error_poles_printed_C"]))
    return Evidence(
        method="Spectral radius over one period of A_e with the recovered A, the C of Sec. IV-A and the gains (42).",
        holds=radius < 1,
        margin=1 - radius,
        quantities={"spectral radius": radius},
        note="the sentence names no A of its own; the one of eq. (41) is that of Sec. IV-A.",
    )


def error_poles(results: Results) -> Evidence:
    """Poles of A_e with the gains (42): for the recovered plant, and with A and C as printed."""
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


def error_stable(results: Results) -> Evidence:
    """Spectral radius of A_e with the gains (42), for the recovered plant."""
    radius = max(map(_modulus, results[RECOVERED]["outputs"]["error_poles"]))
    literal = max(map(_modulus, results[PRINTED]["error_poles"]))
    return Evidence(
        method="Spectral radius over one period with the gains (42), for the recovered plant.",
        holds=radius < 1,
        margin=1 - radius,
        as_printed=Evidence(
            method="The same with A and C as printed (a stable plant).", holds=literal < 1, margin=1 - literal
        ),
    )


def gains_near_optimal(results: Results) -> Evidence:
    """Excess of the gains (42) over the optimum of the recovered plant, against what rounding them can cost."""
    inputs, achieved = results[RECOVERED]["inputs"], results[RECOVERED]["gains"]
    excess = achieved["norm"]["value"] - achieved["optimum"]
    return Evidence(
        method=(
            "Exact norm of the gains (42) minus the exact optimum, for the recovered plant, against the (linearised) "
            "effect of rounding each entry by half a unit."
        ),
        cross_check=(
            "Nearest analytic centre of the matrix inequality, which interior-point methods follow: largest difference "
            f"of the 15 entries {inputs['largest_gain_difference']:.5f}."
        ),
        holds=excess < achieved["rounding_spread"],
        margin=achieved["rounding_spread"] - excess,
        threshold=achieved["rounding_spread"],
        threshold_reason="What rounding the 15 printed entries to three decimals can cost, linearised.",
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


def designable(results: Results) -> Evidence:
    """Theorem 2 for the recovered unstable plant: solved, and its gains reach the exact optimum."""
    result = results[RECOVERED]["design"]
    excess = result["reduced_lmi"]["norm"] / result["optimum"] - 1
    allowed = 1e-7
    return Evidence(
        method="Exact norm of the gains of Theorem 2 (reduced form) relative to the exact optimum, recovered plant.",
        holds=excess < allowed,
        margin=allowed - excess,
        threshold=allowed,
        threshold_reason="Relative distance from the optimum at which a design counts as optimal.",
        solvers=tuple(SolverRecord(**record) for record in result["solvers"]),
        quantities={"optimum": result["optimum"], "norm of the gains": result["reduced_lmi"]["norm"]},
        note="The plant as printed is stable, so the statement has no printed reading.",
    )


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
        f"{data.bracketed(found['C'])}; "
        f"misfit {found['best_misfit']:.2f} of what rounding allows, the next {found['second_misfit']:.2f}."
    )


def _one_real_one_pair(poles: list[list[float]]) -> Numbers:
    (real, _), (pair, imaginary) = poles[0], poles[1]
    return (real, (pair, abs(imaginary)))


def _modulus(pole: list[float]) -> float:
    return float((pole[0] ** 2 + pole[1] ** 2) ** 0.5)


def _by_stated_order(poles: list[list[float]]) -> Numbers:
    """The real parts of three poles, each beside the stated pole of the same rank by size."""
    stated = [abs(float(entry.value)) for entry in parse(data.POLES_A_E).entries]
    ranked = sorted((pole[0] for pole in poles), key=abs, reverse=True)
    return tuple(ranked[sorted(stated, reverse=True).index(size)] for size in stated)


CLAIMS: tuple[Claim, ...] = (
    Claim(
        id=f"{KEY}.unstable.poles",
        place="Sec. IV-C, after eq. (41)",
        kind=Kind.VALUE,
        statement="The poles of the unstable plant.",
        expected=Verdict.REPRODUCED_AFTER_ERRATUM,
        answer=plant_poles,
        uses=USES,
        printed=data.POLES_A,
        erratum=DIAGONAL,
    ),
    Claim(
        id=f"{KEY}.unstable.is-unstable",
        place="Sec. IV-C, after eq. (41)",
        kind=Kind.FEASIBLE,
        statement="The plant is unstable.",
        expected=Verdict.REPRODUCED_AFTER_ERRATUM,
        answer=plant_unstable,
        uses=USES,
        erratum=DIAGONAL,
    ),
    Claim(
        id=f"{KEY}.unstable.same-setting",
        place="Sec. IV-C, before eq. (41)",
        kind=Kind.FEASIBLE,
        statement="Nothing but the matrix A differs from the setting of Sec. IV-A.",
        expected=Verdict.DIFFERS,
        answer=same_setting,
        uses=USES,
        erratum=DIAGONAL,
    ),
    Claim(
        id=f"{KEY}.unstable.error-poles",
        place="Sec. IV-C, after eq. (42)",
        kind=Kind.VALUE,
        statement="The poles of A_e with the gains (42).",
        expected=Verdict.DIFFERS,
        answer=error_poles,
        uses=USES,
        printed=data.POLES_A_E,
        erratum=SETTING,
    ),
    Claim(
        id=f"{KEY}.unstable.stabilised",
        place="Sec. IV-C, after eq. (42)",
        kind=Kind.FEASIBLE,
        statement="The gains (42) stabilise the error system of the unstable plant.",
        expected=Verdict.REPRODUCED_AFTER_ERRATUM,
        answer=error_stable,
        uses=USES,
        erratum=SETTING,
    ),
    Claim(
        id=f"{KEY}.unstable.gains-optimal",
        place="Eq. (42)",
        kind=Kind.FEASIBLE,
        statement="The gains (42) come from minimising the level under Theorem 2.",
        expected=Verdict.REPRODUCED_AFTER_ERRATUM,
        answer=gains_near_optimal,
        uses=USES,
        erratum=SETTING,
    ),
    Claim(
        id=f"{KEY}.unstable.designable",
        place="Sec. IV-C, last sentence",
        kind=Kind.FEASIBLE,
        statement="Theorem 2 designs an observer for the unstable plant.",
        expected=Verdict.REPRODUCED_AFTER_ERRATUM,
        answer=designable,
        uses=USES,
        erratum=SETTING,
    ),
)
