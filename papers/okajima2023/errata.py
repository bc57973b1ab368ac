"""Misprints of the multi-rate paper: what is printed, what must be meant, and the computation that shows it."""

from papers.okajima2023.claims.simulation import ALL_NOISE, AS_PRINTED, G_SIM, READING_OF, all_draws
from papers.okajima2023.claims.unstable import ALL_DIAGONALS, PRINTED, RECOVERED, radius_of
from papers.okajima2023.method.recovery import DIAGONAL_RANGE
from papers.okajima2023.printed import PLANT
from replication.audit.judge.verdict import SMALLEST_PROBABILITY
from replication.audit.model import Proof, Results


def denominator(text: str, results: Results) -> Proof:
    """Which readings of the denominator of eq. (34) make all four printed values possible."""
    record = all_draws(results)
    cases = record["cases"]
    least = {what: min(case["readings"][what]["probability"] for case in cases.values()) for what in READING_OF}
    possible = [what for what, probability in least.items() if probability >= SMALLEST_PROBABILITY]
    return Proof(
        holds=possible == [ALL_NOISE]
        and all(case["readings"][AS_PRINTED]["percentiles"]["0.0"] > G_SIM[name] for name, case in cases.items()),
        text=text.format(draws=record["seeds"], readings=len(READING_OF)),
        quantities={f"least probability of the four, {what}": probability for what, probability in least.items()},
    )


def diagonal(text: str, results: Results) -> Proof:
    """The diagonals of A that have the stated poles: one on a grid, and all real ones that have them exactly."""
    state = results[RECOVERED]["state"]
    _, second = results[ALL_DIAGONALS]["found"]
    literal = results[PRINTED]["poles"]
    return Proof(
        holds=len(state["fits"]) == 1 and not second["fits"],
        text=text.format(
            tried=state["tried"],
            step=state["step"],
            low=DIAGONAL_RANGE[0],
            high=DIAGONAL_RANGE[1],
            fit=tuple(state["fits"][0]),
            other=", ".join(f"{entry:.4f}" for entry in second["diagonal"]),
            bound=results[ALL_DIAGONALS]["bound"],
        ),
        quantities={
            **{f"modulus of pole {i + 1} of A as printed": abs(complex(*pole)) for i, pole in enumerate(literal)},
            "growth of the error per six instants, A as printed and gains (42)": radius_of(
                results[PRINTED]["error_poles"]
            ),
        },
    )


def sensor_index(text: str, results: Results) -> Proof:
    """S_k C needs as many rows and columns in S_k as there are sensors; the example has fewer sensors than states."""
    columns = len(results["schedule.sec-4a"]["diagonals"][0])
    states, sensors = len(PLANT["A"]), len(PLANT["C"])
    return Proof(
        holds=columns == sensors and columns != states,
        text=text,
        quantities={"sensors": sensors, "states": states, "entries of the diagonal of S_k in Sec. IV-A": columns},
    )


def noise_index(text: str, results: Results) -> Proof:
    """The second diagonal entry of D has the indices (2, 2); the entry (1, 2) of the example's D is zero."""
    D = PLANT["D"]
    return Proof(
        holds=D[0][1] == 0 and D[1][1] != 0,
        text=text,
        quantities={"entry (1, 2) of D in Sec. IV-A": D[0][1], "entry (2, 2)": D[1][1]},
    )


PROOFS = {
    "denominator": denominator,
    "diagonal-of-a": diagonal,
    "sensor-index": sensor_index,
    "noise-index": noise_index,
}
"""By the errata of told.toml."""
