"""Claims of Secs. III and IV: the observer's equations and the stability theorem."""

from __future__ import annotations

from papers.shao.problem import APO, REPAIRED
from replication.audit.declare import Part, below, positive
from replication.audit.model import Evidence, Results

OBSERVER = Part("Sec. III: observer and its discrete form, eqs. (1) to (8)", figures="lag")
THEOREM = Part("Sec. IV: stability theorem, eqs. (9) to (22)", figures=("rates", "motor-eigenvalues"))

ROUND_OFF = 1e-9
"""A residual below this is rounding."""


def residual(method: str, gap: float, as_printed: Evidence | None = None) -> Evidence:
    """Evidence that an identity holds up to rounding."""
    return below(
        gap,
        ROUND_OFF,
        "An identity holds up to rounding, relative to the size of its terms.",
        method=method,
        quantities={"residual": gap},
        as_printed=as_printed,
    )


@OBSERVER.feasible("theory.discrete-observer", place="eqs. (3) and (7)", uses="table")
def same_estimates(results: Results) -> Evidence:
    """The discrete-time observer gives the estimates of the sampled-data observer at the instants."""
    gap = max(results["table"]["agreement"][APO])
    return residual("responses by (7) against (3) integrated between the instants, transients included", gap)


@THEOREM.feasible("theory.error-equations", place="eqs. (9) and (10)", uses="motor")
def error_equations(results: Results) -> Evidence:
    """(9) can be written as (10)."""
    return residual("(9) minus (10) at random states, relative", results["motor"]["equation_gap"])


@THEOREM.feasible("theory.lyapunov", place="Sec. IV, above eq. (11)", uses="theorem")
def lyapunov_matrix(results: Results) -> Evidence:
    """The Lyapunov equation has a positive definite solution for the printed data."""
    smallest = results["theorem"]["motor"]["smallest"]
    return positive(
        smallest,
        method="smallest eigenvalue of P in ÃᵀP + P Ã = −I for the printed data",
        quantities={"smallest eigenvalue": smallest},
    )


def step_bounds(results: Results, *names: str) -> Evidence:
    """Left over right side of inequalities of the proof for random loops and states."""
    worst = {name: results["bounds"]["worst"][name] for name in names}
    return Evidence(
        method="largest left over right side for random loops of order two and random states, exact in time",
        holds=max(worst.values()) <= 1,
        margin=1 - max(worst.values()),
        quantities={
            "random loops": results["bounds"]["trials"],
            **{f"({name}), largest left over right": value for name, value in worst.items()},
        },
    )


@THEOREM.feasible("theory.output-bounds", place="eqs. (12) and (13)", uses="bounds")
def output_bounds(results: Results) -> Evidence:
    """The output changes over a fast period by no more than the printed bounds."""
    return step_bounds(results, "12", "13")


@THEOREM.feasible("theory.estimate-bound", place="eq. (14)", uses="bounds")
def estimate_bound(results: Results) -> Evidence:
    """The feedback changes over a fast period, up to a second long, by no more than the printed bound."""
    return step_bounds(results, "14")


@THEOREM.feasible("theory.prediction-bound", place="eq. (15)", uses="theorem", pinned="differs")
def prediction_bound(results: Results) -> Evidence:
    """The error of the virtual measurement is at most α₃ times the root of V times the time elapsed."""
    theorem = results["theorem"]
    gaps = theorem["gap"]["motor"]
    worst, bound = gaps[-1]
    return Evidence(
        method="both sides of (15) for V = 1 and T → 0, from the exact y_p(t_k) − y(t_k) = −C e^{AT} ξ(t_{k−1})",
        cross_check="the same for the scalar loop of the counter-example",
        holds=worst <= bound,
        margin=bound - worst,
        quantities={
            **{f"|y_p − y| at T = {T:g} s": gap[0] for T, gap in zip(theorem["periods"], gaps, strict=True)},
            **{f"α₃ T at T = {T:g} s": gap[1] for T, gap in zip(theorem["periods"], gaps, strict=True)},
            "scalar loop, |y_p − y| at the smallest T": theorem["gap"]["scalar"][-1][0],
            "scalar loop, α₃ T at the smallest T": theorem["gap"]["scalar"][-1][1],
        },
        note="The left side is an estimation error, which does not vanish with T; the right side does.",
    )


@THEOREM.feasible("theory.condition", place="eq. (18)", uses="theorem", pinned="differs")
def example_covered(results: Results) -> Evidence:
    """The example meets the condition of the stability theorem."""
    motor = results["theorem"]["motor"]
    return positive(
        1 - motor["condition"],
        method="α₄ λ_max(P) T with spectral norms and P from its Lyapunov equation",
        quantities={"left side of (18)": motor["condition"], "α₄": motor["alpha4"]},
        note="The loop is stable all the same: the condition is only sufficient, and far from necessary here.",
    )


@THEOREM.feasible("theory.contraction", place="eq. (22)", uses="theorem")
def contraction(results: Results) -> Evidence:
    """The factor φ is below one whenever (18) holds."""
    return positive(
        results["theorem"]["factor_margin"],
        method="smallest (1 − φ)/(1 − e^{−T/(2 λ_max)}) over a grid of T/λ_max and of the left side of (18) below one",
    )


@THEOREM.feasible("theory.stability", place="Sec. IV, after eq. (22)", uses="theorem", pinned="differs")
def stability_theorem(results: Results) -> Evidence:
    """Under (18) the control law stabilises the plant globally."""
    scalar, radius = results["theorem"]["scalar"], results["theorem"]["radius"]
    return Evidence(
        method=(
            "counter-example A = B = C = 1, K = −2, L = 2, M = 5: left side of (18) and monodromy radius at "
            f"T = {scalar['period']:g} s"
        ),
        cross_check="det(I − Φ) < 0 for every T that (18) allows, in exact arithmetic: the certificate",
        holds=scalar["condition"] >= 1 or radius[APO] < 1,
        margin=1 - radius[APO],
        quantities={
            "radius": radius[APO],
            "left side of (18)": scalar["condition"],
            "largest T allowed by (18), s": scalar["allowed_period"],
            **{f"radius with M = {ratio}": value for ratio, value in scalar["radii"].items()},
            "radius with the repaired predictor": radius[REPAIRED],
        },
        note=(
            "As T → 0 the rates of the error tend to eig(A − LC/M), and A − LC/M need not be Hurwitz. "
            "Sec. I promises convergence to a bounded region, Sec. IV to zero; both fail here. Sec. IV takes K and L "
            "as given: it assumes neither stabilisability nor detectability."
        ),
    )
