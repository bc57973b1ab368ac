"""Claims of Sec. V on the motor, its gains and its feedforward."""

from __future__ import annotations

from functools import partial

from papers.shao.claims.theory import residual
from papers.shao.printed import DATA
from replication.audit.declare import Part, positive
from replication.audit.model import NO_READING, Evidence, Results
from replication.verify.predicate import term

MOTOR = Part("Sec. V: motor model, parameters, gains, feedforward", reading=NO_READING)


@MOTOR.value(
    "motor.torque-constant",
    DATA["torque_constant"],
    uses="motor",
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


@MOTOR.feasible(
    "motor.coordinates",
    place="eq. (23) and the matrices below it",
    uses="motor",
    says=term("coordinates of the motor", "parameters"),
)
def position_coordinates(results: Results) -> Evidence:
    """The motor equations are those of A, B and C in position, speed and acceleration."""
    gap = results["motor"]["transfer_gap"]
    return residual("θ/u_q from (23) and from A, B, C at random points of the complex plane", gap)


def hurwitz(which: str, results: Results) -> Evidence:
    """Growth rate of A + B K or of A − L C."""
    growth = results["motor"][f"{which}_margin"]
    return positive(-growth, method="largest real part of the eigenvalues", quantities={"1/s": growth})


for which, matrix in (("feedback", "A + B K"), ("observer", "A − L C")):
    MOTOR.feasible(
        f"motor.hurwitz-{which}",
        place="Sec. V, gains, and Sec. IV, below eq. (10)",
        statement=f"{matrix} is Hurwitz for the printed gains, as Sec. IV supposes.",
        uses="motor",
        says=term("Hurwitz", "motor", matrix=which),
    )(partial(hurwitz, which))


@MOTOR.value(
    "motor.slow-period",
    DATA["slow_period"],
    uses="motor",
    tolerance="0.000001",
    tolerance_reason="T, M and T_s are settings in exact decimals and no rounded results: T_s must be M T to rounding.",
    says=term("slow period", "motor"),
)
def slow_period(results: Results) -> Evidence:
    """The sampling period T_s of the sensor, s."""
    return Evidence(method="M T", value=results["motor"]["slow_period"])


@MOTOR.feasible(
    "motor.feedforward",
    place="Sec. V, ȳ_d",
    uses="motor",
    reading="inverse-feedforward",
    erratum="feedforward-orders",
    pinned="compatible",
    says=term("feedforward inverts the motor", "motor", orders=[3, 1, 2]),
)
def inverse_feedforward(results: Results) -> Evidence:
    """The feedforward inverts the motor."""
    gaps = results["motor"]["inverse_gap"]
    method = "largest |P(jσ) ȳ_d/y_d − 1| for 0.5 ≤ σ ≤ 3 rad/s, P the motor"
    return residual(method, gaps["corrected"], as_printed=residual(method, gaps["printed"]))
