"""Claims of Secs. III to V: the observer's equations, the stability result, motor, gains and feedforward."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from msgspec.structs import replace

from papers.shao.printed import APO, DATA, RESTARTED
from replication.audit.declare import Part, positive, rounded
from replication.audit.judge.numerals import short
from replication.audit.model import NO_READING, Evidence, Results
from replication.verify.predicate import term

OBSERVER = Part("Sec. III: observer and its discrete form, eqs. (2) to (8)", reading=NO_READING, figures="lag")
THEOREM = Part("Sec. IV: stability result, eqs. (9) to (22)", reading=NO_READING, figures=("counter-example", "rates"))

MOTOR = Part("Sec. V: motor model, parameters, gains, feedforward", reading=NO_READING)


def residual(method: str, gap: float, as_printed: Evidence | None = None) -> Evidence:
    """Evidence that an identity holds up to rounding."""
    return rounded(gap, method=method, quantities={"residual": gap}, as_printed=as_printed)


RANDOM = "largest left over right side for random loops of order two, from random states, exact at times of a grid"


def step_bounds(names: Sequence[str], results: Results, method: str = RANDOM) -> Evidence:
    """Left over right side of inequalities of the proof for random loops and states."""
    worst = {name: results["bounds"]["worst"][name] for name in names}
    return positive(
        1 - max(worst.values()),
        method=method,
        quantities={
            "random loops": results["bounds"]["trials"],
            **{f"({name}), largest left over right": value for name, value in worst.items()},
        },
    )


def estimate_bound(results: Results) -> Evidence:
    """The feedback changes over a fast period by no more than the bound (14)."""
    corrected, without = step_bounds(("14",), results), results["bounds"]["slow"]["modulus"]
    printed = positive(
        1 - without,
        method="left over right side of (14) with |e_p| and without t − t_k, for a slow loop over two seconds",
        quantities={"left over right": without},
    )
    note = (
        "(14) integrates K ζ', in which K L e_p is constant: the factor t − t_k follows. Put into (16) with (15), the "
        "term of ‖K L‖ has this factor too, and α₄ of (17), which has not, suffices for periods of up to a second. The "
        "bars of |e_p| may have been lost by our copy."
    )
    return replace(corrected, as_printed=printed, note=note)


def prediction_rate(results: Results) -> Evidence:
    """The rate of the virtual output (6) is C A ζ + C B u."""
    theorem = results["theorem"]
    gap = theorem["increment_rate_gap"]
    method = (
        "change of (6) over T less the integral of C A ζ + C B u, over T, for the printed loop at "
        f"T = {theorem['periods'][0]:g} s and the worst unit ζ, u and ȳ; ζ follows (3)"
    )
    evidence = residual(method, gap["estimate"])
    departure = {
        "departure over T with ζ, 1/s": gap["estimate"],
        f"departure over T with ζ at the printed T = {DATA['period']} s, 1/s": gap["estimate, printed period"],
        "departure over T with ζ_p, 1/s": gap["estimate, by the model"],
    }
    note = (
        "Between two fast instants the virtual output follows the model, so that the rate is true of ζ_p in place of "
        "ζ, but then the next sentence has C A (x − ζ_p), and not C A ξ. That sentence needs ζ, so ζ is what was "
        "meant and no misprint. With ζ the changes over T agree up to terms of order T². Apart from this the proof "
        "integrates the rate from an error of zero, but at the start of a period (6) is off by the error C ξ(t_{k−1}) "
        "of the estimate, which (15) drops."
    )
    check = "the same departure by many small steps in time, in the tests"
    return replace(evidence, cross_check=check, quantities=departure, note=note)


def prediction_bound(results: Results) -> Evidence:
    """Left over right side of (15) for the scalar loop, which meets (18), and for the printed one."""
    theorem, scalar = results["theorem"], results["theorem"]["scalar"]
    (left, right), motor = theorem["scalar_gap"], theorem["gap"]["motor"]
    (worst, bound), (restarted, allowed) = motor[-1], theorem["restarted_gap"][-1]
    printed, enough = theorem["printed_gap"]
    smallest = theorem["periods"][-1]
    return positive(
        1 - left / right,
        method="left over right side of (15) at the first instant after a measurement, for the scalar loop of the "
        f"counter-example at T = {scalar['period']:g} s, which meets (18), from the exact "
        "y_p(t_k) − y(t_k) = −C e^{AT} ξ(t_{k−1}), V(χ(t_{k−1})) = 1 and the worst ξ",
        cross_check="the same for the printed loop",
        quantities={
            f"left over right, scalar loop at T = {scalar['period']:g} s": left / right,
            "left side of (18), scalar loop": scalar["condition"],
            f"left over right, printed loop at T = {smallest:g} s": worst / bound,
            f"left over right, printed loop at the printed T = {DATA['period']} s": printed / enough,
            f"restarted predictor, printed loop, left over right at T = {smallest:g} s": restarted / allowed,
            **{
                f"printed loop, {side} at T = {T:g} s": gap[place]
                for place, side in enumerate(("|y_p − y|", "α₃ T"))
                for T, gap in zip(theorem["periods"], motor, strict=True)
            },
        },
        note=f"The scalar loop meets (18), and the left side of (15) is {short(left / right, 3)} times the right. "
        f"For the printed loop it is {short(worst / bound, 3)} times at T = {smallest:g} s, and "
        f"{short(printed / enough, 3)} times at the printed T = {DATA['period']} s; (18) holds at neither. The "
        "left side is an estimation error, which does not vanish with T; the right side does. With the restarted "
        "predictor the right side is the larger at this instant and the smallest T; that does not mend the result, "
        "since (18) has no M. The certificates take the largest V over two fast periods.",
    )


def stability_result(results: Results) -> Evidence:
    """If A + B K and A − L C are Hurwitz and (18) holds, the control law stabilises the plant globally."""
    scalar, radius, longer = results["theorem"]["scalar"], results["theorem"]["radius"], results["longer"]
    (below, above), ratio = longer["radius"], longer["ratio"]
    return Evidence(
        method="counter-example A = B = C = 1, K = −2, L = 2, M = 5: left side of (18) and monodromy radius at "
        f"T = {scalar['period']:g} s, spectral norms; the same with the restarted predictor and a longer M, "
        "bisected",
        cross_check="det(I − Φ) < 0 for every T that (18) allows, in exact arithmetic: the certificate",
        holds=scalar["condition"] >= 1 or max(radius[APO], above) < 1,
        margin=max(scalar["condition"] - 1, 1 - max(radius[APO], above)),
        quantities={
            "T, s": scalar["period"],
            "radius at T": radius[APO],
            "left side of (18) at T, for every M": scalar["condition"],
            "bound below which all T satisfy (18), s": scalar["allowed_period"],
            **{f"radius at T with M = {M}": value for M, value in scalar["radii"].items()},
            "radius at T with the restarted predictor": radius[RESTARTED],
            "least M at which the restarted predictor's loop is unstable at T": ratio,
            f"radius with the restarted predictor, M = {ratio - 1}": below,
            f"radius with the restarted predictor, M = {ratio}": above,
            **{f"radius with the restarted predictor, M = {M}": value for M, value in longer["beyond"].items()},
        },
        note="(18) bounds T and does not contain M, so that it cannot suffice: measured rarely enough, the loop "
        "diverges "
        "with either predictor, as certificates prove for the printed one at four M and for the restarted one at "
        f"M = {ratio}. As T → 0 the rates of the error with (6) tend to eig(A − LC/M), and A − LC/M need not be "
        "Hurwitz. The counter-example converges neither to zero, as Sec. IV has it, nor to a bounded region, as "
        "Sec. I has it under mild conditions that it does not name. The text numbers no theorem: the claim gathers "
        "the conditions and the conclusion of Sec. IV. With it fall (19) and the decrease of V by φ² below (22).",
    )


def inverse_feedforward(results: Results) -> Evidence:
    """The corrected feedforward against the inverse of the motor, and the printed one."""
    gaps = results["motor"]["inverse_gap"]
    method = "largest |P(jσ) ȳ_d/y_d − 1| for 0.5 ≤ σ ≤ 3 rad/s, P the motor"
    return residual(method, gaps["corrected"], as_printed=residual(method, gaps["printed"]))


def hurwitz(which: str, results: Results) -> Evidence:
    """Growth rate of A + B K or of A − L C."""
    growth = results["motor"][f"{which}_margin"]
    return positive(-growth, method="largest real part of the eigenvalues", quantities={"1/s": growth})


def lyapunov_matrix(results: Results) -> Evidence:
    """The smallest eigenvalue of the Lyapunov matrix."""
    smallest = results["theorem"]["motor"]["smallest"]
    method = "smallest eigenvalue of P in ÃᵀP + P Ã = −I for the printed data"
    return positive(smallest, method=method, quantities={"smallest eigenvalue": smallest})


def of_motor(gap: str, method: str, results: Results) -> Evidence:
    """A residual of the experiment on the motor."""
    return residual(method, results["motor"][gap])


@MOTOR.value(
    "motor.torque-constant",
    DATA["torque_constant"],
    ours=True,
    reading="surface-magnets",
    pinned="compatible",
    says=term("torque constant", "parameters"),
)
def torque_constant(results: Results) -> Evidence:
    """The torque constant K_T, N m/A."""
    return Evidence(
        method="K_T = 1.5 p Ψ_f, the torque of a surface-magnet machine",
        value=results["motor"]["torque_constant"],
        note="The manuscript prints K_T among the data and gives no formula for it.",
    )


@MOTOR.value(
    "motor.slow-period",
    DATA["slow_period"],
    tolerance="0.000001",
    tolerance_reason="T, M and T_s are settings in exact decimals and no rounded results: T_s must be M T to rounding.",
    says=term("slow period", "motor"),
)
def slow_period(results: Results) -> Evidence:
    """The sampling period T_s of the sensor, s."""
    return Evidence(method="M T", value=results["motor"]["slow_period"])


AFTER = "reproduced after erratum"
CLAIMS: Sequence[tuple[Part, str, str, str, Callable[[Results], Evidence], Mapping[str, Any]]] = (
    (
        OBSERVER, "theory.discrete-observer", "eqs. (3) and (7)",
        "The discrete-time observer gives the estimates of the sampled-data observer at the instants.",
        lambda results: residual(
            "responses of the printed example by (7) and by (3) integrated between the instants, with transients",
            max(results["table"]["agreement"][APO]),
        ),
        {"says": term("equivalent observers")},
    ),
    (
        THEOREM, "theory.error-equations", "eqs. (9) and (10)", "(9) can be written as (10).",
        partial(of_motor, "equation_gap", "(9) minus (10) at random states, relative"),
        {"says": term("equations (9) and (10)")},
    ),
    (
        THEOREM, "theory.second-case", "Sec. IV, Case 2",
        "Case 2 is Case 1 with the prediction error zero: (10) without its last term.",
        partial(
            of_motor, "case_gap",
            "(9) with ȳ(t_k) = y(t_k) minus (10) without its last term at random states, relative",
        ),
        {"says": term("Case 2")},
    ),
    (
        THEOREM, "theory.lyapunov", "Sec. IV, above eq. (11)",
        "The Lyapunov equation with the printed data has a positive definite solution.",
        lyapunov_matrix, {"says": term("Lyapunov equation", "motor")},
    ),
    (
        THEOREM, "theory.output-bounds", "eqs. (12) and (13)",
        "Over a fast period the rate and the change of the output stay within (12) and (13).",
        partial(step_bounds, ("12", "13")), {"says": term("bounds (12) and (13)")},
    ),
    (
        THEOREM, "theory.estimate-bound", "eq. (14)", "", estimate_bound,
        {"erratum": "prediction-error-term", "pinned": AFTER, "says": term("bound (14)")},
    ),
    (
        THEOREM, "theory.prediction-rate", "Sec. IV, above eq. (15)", "", prediction_rate, {"pinned": "refuted"},
    ),
    (
        THEOREM, "theory.prediction-bound", "eq. (15)",
        "The error of the virtual measurement is at most α₃ T times the root of the largest V.", prediction_bound,
        {"reading": "elapsed-period", "pinned": "refuted", "says": term("bound (15)")},
    ),
    (
        THEOREM, "theory.collected-constant", "eqs. (16) and (17)",
        "The constant α₄ of (17) collects the terms of (16).",
        partial(step_bounds, ("17",), method="terms of (16) over their bound by α₄, the largest of random loops"),
        {"says": term("constant (17)")},
    ),
    (
        THEOREM, "theory.contraction", "eq. (22)", "The factor φ is below one whenever (18) holds.",
        lambda results: residual(
            "1 − φ minus (1 − E)(1 − c) on a grid, with E = e^{−T/(2 λ_max)} < 1 and c the left side of (18)",
            results["theorem"]["factor_gap"],
        ),
        {"says": term("contraction (22)")},
    ),
    (
        THEOREM, "theory.stability", "Sec. IV, after eq. (22)", "", stability_result,
        {"pinned": "refuted", "says": term("stability result"), "consequence": "theorem"},
    ),
    (
        MOTOR, "motor.coordinates", "eq. (23) and the matrices below it",
        "The motor equations are those of A, B and C in position, speed and acceleration.",
        partial(of_motor, "transfer_gap", "θ/u_q from (23) and from A, B, C at random points of the complex plane"),
        {"says": term("coordinates of the motor", "parameters")},
    ),
    *(
        (
            MOTOR, f"motor.hurwitz-{which}", "Sec. V, gains, and Sec. IV, below eq. (10)",
            f"{matrix} is Hurwitz for the printed gains, as Sec. IV supposes.", partial(hurwitz, which),
            {"says": term("Hurwitz", "motor", matrix=which)},
        )
        for which, matrix in (("feedback", "A + B K"), ("observer", "A − L C"))
    ),
    (
        MOTOR, "motor.feedforward", "Sec. V, ȳ_d", "The feedforward inverts the motor.", inverse_feedforward,
        {
            "ours": True, "reading": "inverse-feedforward", "erratum": "feedforward-orders",
            "pinned": "compatible", "says": term("feedforward inverts the motor", "motor", orders=[3, 1, 2]),
        },
    ),
)  # fmt: skip
"""Part, name, place, statement (else the words of the answer), answer, and what else each is declared with."""
for _part, _name, _place, _statement, _answer, _told in CLAIMS:
    _part.feasible(_name, place=_place, statement=_statement, **_told)(_answer)
