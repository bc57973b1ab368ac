"""Misprints of the manuscript, each with the computation behind the correction."""

from papers.shao.printed import DATA, DESIGN
from replication.audit.declare import ROUNDING, contrast
from replication.audit.model import Proof, Results


def feedforward_orders(text: str, results: Results) -> Proof:
    """The corrected feedforward is the inverse of the motor, the printed one is not."""
    gaps = results["motor"]["inverse_gap"]
    words = {form: {f"{form}: largest |P ȳ_d/y_d − 1|": gaps[form]} for form in ("corrected", "printed")}
    return contrast(text, words["corrected"], words["printed"])


def mechanical_speed(text: str, results: Results) -> Proof:
    """The power balance of the motor."""
    ideal, printed = results["motor"]["torque_constant"], float(DATA["torque_constant"])
    return Proof(
        holds=abs(ideal - printed) < ROUNDING, text=text, quantities={"1.5 p Ψ_f": ideal, "printed K_T": printed}
    )


def third_state(text: str, results: Results) -> Proof:
    """The third state by the printed A."""
    state = DESIGN.model.A
    return Proof(
        holds=bool(state[0, 1] == 1 and state[1, 2] == 1 and abs(state[0]).sum() == 1 and abs(state[1]).sum() == 1),
        text=text,
        quantities={"A(2,3)": float(state[1, 2])},
    )


def output_rate(text: str, results: Results) -> Proof:
    """The shapes of C and ẏ."""
    rows, columns = DESIGN.model.C.shape
    return Proof(
        holds=rows != columns,
        text=text.format(rows=rows, columns=columns),
        quantities={"rows of C": rows, "columns of C": columns},
    )


def prediction_error_term(text: str, results: Results) -> Proof:
    """(14) with |e_p| alone over a long period, and with t − t_k too."""
    worst, slow = results["bounds"]["worst"], results["bounds"]["slow"]
    return Proof(
        holds=slow["modulus"] > 1 >= max(worst["14"], slow["14"]),
        text=text,
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
