"""Claims on the observer's equations and on the stability theorem."""

from __future__ import annotations

from functools import partial

from papers.shao import data
from papers.shao.claims_motor import residual
from papers.shao.problem import APO, FAST, REPAIRED
from replication.audit.model import Claim, Evidence, Kind, Results, Verdict


def same_estimates(results: Results) -> Evidence:
    """(7) against (3)."""
    gap = max(results["shao.table"]["agreement"][APO])
    return residual("responses by (7) against (3) integrated between the instants, transients included", gap)


def error_equations(results: Results) -> Evidence:
    """(9) against (10)."""
    return residual("(9) minus (10) at random states, relative", results["shao.motor"]["equation_gap"])


def lyapunov_matrix(results: Results) -> Evidence:
    """Positive definiteness of P."""
    smallest = results["shao.theorem"]["motor"]["smallest"]
    return Evidence(
        method="smallest eigenvalue of P in ÃᵀP + P Ã = −I for the printed data",
        holds=smallest > 0,
        margin=smallest,
        quantities={"smallest eigenvalue": smallest},
    )


def example_covered(results: Results) -> Evidence:
    """The left side of (18) for the printed data."""
    motor = results["shao.theorem"]["motor"]
    return Evidence(
        method="α₄ λ_max(P) T with spectral norms and P from its Lyapunov equation",
        holds=motor["condition"] < 1,
        margin=1 - motor["condition"],
        quantities={"left side of (18)": motor["condition"], "α₄": motor["alpha4"]},
        note="The loop is stable all the same: the condition is only sufficient, and far from necessary here.",
    )


def prediction_bound(results: Results) -> Evidence:
    """Both sides of (15) as T goes to zero."""
    theorem = results["shao.theorem"]
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


def step_bounds(names: tuple[str, ...], results: Results) -> Evidence:
    """Left over right side of inequalities of the proof for random loops and states."""
    worst = {name: results["shao.bounds"]["worst"][name] for name in names}
    return Evidence(
        method="largest left over right side for random loops of order two and random states, exact in time",
        holds=max(worst.values()) <= 1,
        margin=1 - max(worst.values()),
        quantities={
            "random loops": results["shao.bounds"]["trials"],
            **{f"({name}), largest left over right": value for name, value in worst.items()},
        },
    )


def contraction(results: Results) -> Evidence:
    """(22) under (18)."""
    margin = results["shao.theorem"]["factor_margin"]
    return Evidence(
        method="smallest (1 − φ)/(1 − e^{−T/(2 λ_max)}) over a grid of T/λ_max and of the left side of (18) below one",
        holds=margin > 0,
        margin=margin,
    )


def stability_theorem(results: Results) -> Evidence:
    """The counter-example, a loop that meets (18) and is unstable."""
    theorem = results["shao.theorem"]
    scalar, radius = theorem["scalar"], theorem["radius"][APO]
    return Evidence(
        method=(
            "counter-example A = B = C = 1, K = −2, L = 2, M = 5: left side of (18) and monodromy radius at "
            f"T = {scalar['period']:g} s"
        ),
        cross_check="det(I − Φ) < 0 for every T that (18) allows, in exact arithmetic: the certificate",
        holds=scalar["condition"] >= 1 or radius < 1,
        margin=1 - radius,
        quantities={
            "radius": radius,
            "left side of (18)": scalar["condition"],
            "largest T allowed by (18), s": scalar["allowed_period"],
            **{f"radius with M = {ratio}": value for ratio, value in scalar["radii"].items()},
            "radius with the repaired predictor": theorem["radius"][REPAIRED],
        },
        note=(
            "As T → 0 the rates of the error tend to eig(A − LC/M), and A − LC/M need not be Hurwitz. "
            "Sec. I promises convergence to a bounded region, Sec. IV to zero; both fail here. Sec. IV takes K and L "
            "as given: it assumes neither stabilisability nor detectability."
        ),
    )


def like_a_fast_sensor(results: Results) -> Evidence:
    """Time constants of the printed observer and of a true fast sensor; the repaired predictor beside them."""
    radius, ratios = results["shao.table"]["radius"], results["shao.table"]["ratios"]
    constants = results["shao.transients"]["time_constants"]
    gaps, noise = results["shao.theorem"]["rate_gap"], results["shao.frequencies"]["noise"]
    return Evidence(
        method="monodromy radius with (6) against that with a true measurement at every fast instant",
        cross_check="limit T → 0: distance of the rates to eig(A − LC/M) and to eig(A − LC)",
        holds=radius[APO] <= radius[FAST],
        margin=radius[FAST] - radius[APO],
        quantities={
            "radius, virtual measurement (6)": radius[APO],
            "radius, true fast sensor": radius[FAST],
            "radius, repaired predictor": radius[REPAIRED],
            "time constant, virtual measurement (6), s": constants[APO],
            "time constant, true fast sensor, s": constants[FAST],
            **{
                f"error against that of a fast sensor, {reference}": own / fast
                for reference, own, fast in zip(data.REFERENCES, ratios[APO], ratios[FAST], strict=True)
            },
            "rates to eig(A − LC/M), 1/s": gaps["printed"][-1],
            "rates to eig(A − LC), 1/s": gaps["printed_full_gain"][-1],
            "noise gain, virtual measurement (6)": noise[APO],
            "noise gain, true fast sensor": noise[FAST],
            "noise gain, repaired predictor": noise[REPAIRED],
        },
        note=(
            "Judged by the transient. In the steady state, the manuscript's own measure, the claim nearly holds except "
            "at the lowest frequency."
        ),
    )


THEORY_CLAIMS = (
    Claim(
        id="shao.theory.discrete-observer",
        place="eqs. (3) and (7)",
        kind=Kind.FEASIBLE,
        statement="The discrete-time observer gives the estimates of the sampled-data observer at the instants.",
        expected=Verdict.CONSISTENT,
        answer=same_estimates,
        uses=("shao.table",),
    ),
    Claim(
        id="shao.theory.error-equations",
        place="eqs. (9) and (10)",
        kind=Kind.FEASIBLE,
        statement="(9) can be written as (10).",
        expected=Verdict.CONSISTENT,
        answer=error_equations,
        uses=("shao.motor",),
    ),
    Claim(
        id="shao.theory.lyapunov",
        place="Sec. IV, above eq. (11)",
        kind=Kind.FEASIBLE,
        statement="The Lyapunov equation has a positive definite solution for the printed data.",
        expected=Verdict.CONSISTENT,
        answer=lyapunov_matrix,
        uses=("shao.theorem",),
    ),
    Claim(
        id="shao.theory.output-bounds",
        place="eqs. (12) and (13)",
        kind=Kind.FEASIBLE,
        statement="The output changes over a fast period by no more than the printed bounds.",
        expected=Verdict.CONSISTENT,
        answer=partial(step_bounds, ("12", "13")),
        uses=("shao.bounds",),
    ),
    Claim(
        id="shao.theory.estimate-bound",
        place="eq. (14)",
        kind=Kind.FEASIBLE,
        statement="The feedback changes over a fast period, up to a second long, by no more than the printed bound.",
        expected=Verdict.CONSISTENT,
        answer=partial(step_bounds, ("14",)),
        uses=("shao.bounds",),
    ),
    Claim(
        id="shao.theory.prediction-bound",
        place="eq. (15)",
        kind=Kind.FEASIBLE,
        statement="The error of the virtual measurement is at most α₃ times the root of V times the time elapsed.",
        expected=Verdict.DIFFERS,
        answer=prediction_bound,
        uses=("shao.theorem",),
    ),
    Claim(
        id="shao.theory.condition",
        place="eq. (18)",
        kind=Kind.FEASIBLE,
        statement="The example meets the condition of the stability theorem.",
        expected=Verdict.DIFFERS,
        answer=example_covered,
        uses=("shao.theorem",),
    ),
    Claim(
        id="shao.theory.contraction",
        place="eq. (22)",
        kind=Kind.FEASIBLE,
        statement="The factor φ is below one whenever (18) holds.",
        expected=Verdict.CONSISTENT,
        answer=contraction,
        uses=("shao.theorem",),
    ),
    Claim(
        id="shao.theory.stability",
        place="Sec. IV, after eq. (22)",
        kind=Kind.FEASIBLE,
        statement="Under (18) the control law stabilises the plant globally.",
        expected=Verdict.DIFFERS,
        answer=stability_theorem,
        uses=("shao.theorem",),
    ),
    Claim(
        id="shao.theory.fast-sensor",
        place="Sec. I",
        kind=Kind.ORDER,
        statement="With the virtual measurement the loop works like one with a sensor as fast as the actuator.",
        expected=Verdict.DIFFERS,
        answer=like_a_fast_sensor,
        uses=("shao.table", "shao.theorem", "shao.frequencies", "shao.transients"),
    ),
)
