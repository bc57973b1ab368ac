"""Claims on the motor, its gains and its feedforward."""

from __future__ import annotations

from functools import partial

from papers.shao import data
from replication.audit.model import Claim, Evidence, Kind, Results, Verdict

ROUND_OFF = 1e-9
"""A residual below this is rounding."""


def residual(method: str, gap: float, as_printed: Evidence | None = None) -> Evidence:
    """Evidence that an identity holds up to rounding."""
    return Evidence(
        method=method,
        holds=gap < ROUND_OFF,
        margin=ROUND_OFF - gap,
        threshold=ROUND_OFF,
        threshold_reason="An identity holds up to rounding, relative to the size of its terms.",
        quantities={"residual": gap},
        as_printed=as_printed,
    )


def torque_constant(results: Results) -> Evidence:
    """K_T from pole pairs and flux."""
    return Evidence(
        method="K_T = 1.5 p Ψ_f, the torque of a surface-magnet machine", value=results["shao.motor"]["torque_constant"]
    )


def position_coordinates(results: Results) -> Evidence:
    """(23) against the printed matrices."""
    gap = results["shao.motor"]["transfer_gap"]
    return residual("θ/u_q from (23) and from A, B, C at random points of the complex plane", gap)


def hurwitz(which: str, results: Results) -> Evidence:
    """Growth rate of A + B K or of A − L C."""
    margin = results["shao.motor"][f"{which}_margin"]
    return Evidence(
        method="largest real part of the eigenvalues", holds=margin < 0, margin=-margin, quantities={"1/s": margin}
    )


def slow_period(results: Results) -> Evidence:
    """M times T."""
    return Evidence(method="M T", value=results["shao.motor"]["slow_period"])


def inverse_feedforward(results: Results) -> Evidence:
    """What the corrected and the printed feedforward leave of the inverse of the motor."""
    gaps = results["shao.motor"]["inverse_gap"]
    method = "largest |P(jσ) ȳ_d/y_d − 1| for 0.5 ≤ σ ≤ 3 rad/s, P the motor"
    return residual(method, gaps["corrected"], as_printed=residual(method, gaps["printed"]))


MOTOR_CLAIMS = (
    Claim(
        id="shao.motor.torque-constant",
        place="Sec. V, parameters",
        kind=Kind.VALUE,
        statement="The torque constant K_T, N m/A.",
        expected=Verdict.REPRODUCED,
        answer=torque_constant,
        uses=("shao.motor",),
        printed=data.TORQUE_CONSTANT,
    ),
    Claim(
        id="shao.motor.coordinates",
        place="eq. (23) and the matrices below it",
        kind=Kind.FEASIBLE,
        statement="The motor equations are those of A, B and C in position, speed and acceleration.",
        expected=Verdict.CONSISTENT,
        answer=position_coordinates,
        uses=("shao.motor",),
    ),
    *(
        Claim(
            id=f"shao.motor.hurwitz-{which}",
            place="Sec. IV, below eq. (10)",
            kind=Kind.FEASIBLE,
            statement=f"{matrix} is Hurwitz for the printed gains.",
            expected=Verdict.CONSISTENT,
            answer=partial(hurwitz, which),
            uses=("shao.motor",),
        )
        for which, matrix in (("feedback", "A + B K"), ("observer", "A − L C"))
    ),
    Claim(
        id="shao.motor.slow-period",
        place="Sec. V, parameters",
        kind=Kind.VALUE,
        statement="The sampling period T_s of the sensor, s.",
        expected=Verdict.REPRODUCED,
        answer=slow_period,
        uses=("shao.motor",),
        printed=data.SLOW_PERIOD,
    ),
    Claim(
        id="shao.motor.feedforward",
        place="Sec. V, ȳ_d",
        kind=Kind.FEASIBLE,
        statement="The feedforward inverts the motor: our inference of its purpose, which the text does not state.",
        expected=Verdict.REPRODUCED_AFTER_ERRATUM,
        answer=inverse_feedforward,
        uses=("shao.motor",),
        erratum="shao.feedforward-orders",
    ),
)
