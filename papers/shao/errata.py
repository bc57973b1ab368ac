"""Misprints of the manuscript, each with the computation behind the correction."""

from __future__ import annotations

from papers.shao.claims.theory import ROUND_OFF
from papers.shao.printed import DATA, DESIGN
from replication.audit.declare import contrast
from replication.audit.model import Proof, Results

CONVERSION = "Our copy is a conversion, which may have misread a letter or its dots."


def feedforward_orders(results: Results) -> Proof:
    """The corrected feedforward is the inverse of the motor, the printed one is not."""
    gaps = results["motor"]["inverse_gap"]
    words = {form: {f"{form}: largest |P ȳ_d/y_d − 1|": gaps[form]} for form in ("corrected", "printed")}
    text = (
        "Only with the orders raised in the first and the last term is the feedforward the inverse of the motor. "
        f"{CONVERSION}"
    )
    return contrast(text, words["corrected"], words["printed"], zero=ROUND_OFF)


def mechanical_speed(results: Results) -> Proof:
    """The power balance of the motor."""
    ideal, printed = results["motor"]["torque_constant"], float(DATA["torque_constant"])
    return Proof(
        holds=abs(ideal - printed) < ROUND_OFF,
        text=(
            "The printed K_T is 1.5 p Ψ_f, which the text does not say. Then the torque K_T i_q times the mechanical "
            "speed equals the electrical power 1.5 (p Ψ_f ω) i_q of the back-EMF in (23) only if ω is that speed."
        ),
        quantities={"1.5 p Ψ_f": ideal, "printed K_T": printed},
    )


def third_state(results: Results) -> Proof:
    """The third state by the printed A."""
    state = DESIGN.model.A
    return Proof(
        holds=bool(state[0, 1] == 1 and state[1, 2] == 1 and abs(state[0]).sum() == 1 and abs(state[1]).sum() == 1),
        text=(
            "The text defines x with dω/dt as its third entry, and the printed A makes the third state the first "
            f"derivative of the second. {CONVERSION}"
        ),
        quantities={"A(2,3)": float(state[1, 2])},
    )


def output_rate(results: Results) -> Proof:
    """The shapes of C and ẏ."""
    rows, columns = DESIGN.model.C.shape
    return Proof(
        holds=rows != columns,
        text=(
            "C multiplies states, and ẏ has as many entries as C has rows. In the printed example C is "
            f"{rows} × {columns} and ẏ a scalar, so that C ẏ has no meaning as a product; |C ẋ| is the same as |ẏ|. "
            f"{CONVERSION}"
        ),
        quantities={"rows of C": rows, "columns of C": columns},
    )


def prediction_error_term(results: Results) -> Proof:
    """(14) with |e_p| alone over a long period, and with t − t_k too."""
    worst, slow = results["bounds"]["worst"], results["bounds"]["slow"]
    return Proof(
        holds=slow["modulus"] > 1 >= max(worst["14"], slow["14"]),
        text=(
            "The factor t − t_k is missing: the integral of K ζ' has the term K L e_p (t − t_k). The bars of |e_p| may "
            "have been lost by our copy. With |e_p| alone (14) fails for a slow loop at two seconds; with "
            "‖K L‖ |e_p| (t − t_k) it holds for every loop and period. (16) repeats the want of the factor."
        ),
        quantities={
            "slow loop, with |e_p|: left over right": slow["modulus"],
            "slow loop, with |e_p| and t − t_k: left over right": slow["14"],
            "with |e_p| and t − t_k: largest left over right": worst["14"],
        },
    )


PROOFS = {
    "feedforward-orders": feedforward_orders,
    "mechanical-speed": mechanical_speed,
    "third-state": third_state,
    "output-rate": output_rate,
    "prediction-error-term": prediction_error_term,
}
"""By the errata of told.toml."""
