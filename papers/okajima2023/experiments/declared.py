"""Which observers the paper designs, and all experiments: their names, functions and inputs."""

from typing import Any

from papers._common import INPUTS
from papers.okajima2023.experiments import designs, simulations, unstable
from papers.okajima2023.method.recovery import HALF_UNIT_GAIN, HALF_UNIT_POLE
from papers.okajima2023.printed import DATA, GAINS, PLANT, PRINTED_PLANT, SCHEDULES, TABLE_1, poles
from replication.audit.declare import experiment, number

Json = dict[str, Any]

SEEDS, SEED = 2000, 20230302
"""Draws for the distribution of g_sim, and the seed of all simulations."""
DIAGONAL_STEP, LARGEST_ENTRY, WIDER = 0.01, 3, 5
"""Grids of the search behind Sec. IV-C: step of the diagonal of A, largest entry of C, and of its possible rivals."""
SECOND_DECIMALS = 6
"""Of the second diagonal with the stated poles, in the theorem on it."""
ENTRY_DECIMALS = 4
"""Of an A all of whose entries may differ from the printed ones: with so many it still has the stated poles."""

PERIOD_TABLE, DRAWS = "period-table", "g-sim"
"""The optimum for all periods up to the largest, and the draws of g_sim."""


def both(periods: tuple[int, ...], second_offset: int = 0) -> Json:
    """The observer of both sensors, the second of them `second_offset` instants late."""
    return {"periods": list(periods), "offsets": [0, second_offset], "sensors": [0, 1]}


def pair(periods: tuple[int, ...], second_offset: int = 0) -> str:
    """The experiment that designs the two-sensor observer for these periods and theta_2."""
    return f"design.{periods[0]}-{periods[1]}" + (f"-theta{second_offset}" if second_offset else "")


def case(name: str) -> str:
    """The experiment that designs one of `CASES`."""
    return pair((2, 3)) if name == "proposed" else f"design.case-{name.lower()}"


def gain_set(equation: str) -> str:
    """The experiment that evaluates the gains printed in an equation."""
    return f"gains.{equation}"


def table_claim(periods: tuple[int, ...]) -> str:
    """The claim on one column of Table 1."""
    return f"table1.n{periods[0]}{periods[1]}"


CASES: dict[str, Json] = {
    "proposed": both((2, 3)),
    "A": {"periods": [2], "offsets": [0], "sensors": [0]},
    "B": {"periods": [3], "offsets": [0], "sensors": [1]},
    "C": both((6, 6)),
}
"""Sec. IV-A: the multi-rate observer, y_1 alone, y_2 alone, and both at their common period."""
DESIGNS: dict[str, Json] = {
    **{pair(periods): both(periods) for periods in TABLE_1},
    **{pair((3, 3), theta): both((3, 3), theta) for theta in (1, 2)},
    **{case(name): CASES[name] for name in "ABC"},
}
"""Inputs by experiment: the columns of Table 1, the timings, Cases A-C."""
TIMINGS = tuple(pair((3, 3), theta) for theta in range(3))
GAIN_SETS = {"33": both((2, 3)), **{str(38 + theta): both((3, 3), theta) for theta in range(3)}}
"""The observers whose gains are printed for the stable plant, by equation."""

_PROPOSED = {**CASES["proposed"], "gains": GAINS["33"]}
_SIMULATED = {**CASES, "proposed": _PROPOSED}
_TIMED = {f"timing-{n}": {**both((3, 3), n - 1), "gains": GAINS[str(37 + n)]} for n in (1, 2, 3)}
_NOISE = {"sigma": float(DATA["sigma"]), "noisy": DATA["last-noise"], "last": DATA["last-summed"]}
_GAINS_OF = {name: {**inputs, "gains": GAINS[name]} for name, inputs in GAIN_SETS.items()}
_SUMMED = {"slack": 0.05, "draws": 20, "last": 59, "seed": SEED}
"""The steps (26)-(28): level over the smallest one of Theorem 1, relative; random noises; last instant of each."""
_STATED = {
    "A": number(DATA["unstable-A"]),
    "C": PLANT["C"],
    "gains": GAINS["42"],
    "poles": poles(DATA["poles"]),
    "error_poles": [pole[0] for pole in poles(DATA["error-poles"])],
}
_DECIMALS = {"diagonal_decimals": SECOND_DECIMALS, "decimals": ENTRY_DECIMALS}
TRIED: Json = {"stated": _STATED, "step": DIAGONAL_STEP, **_DECIMALS}
"""What finds each A with the stated poles that is tried."""
_INPUTS = {name: PLANT[name] for name in ("B_d", "D")}
_SEARCHED = {"half_unit": HALF_UNIT_GAIN, "step": DIAGONAL_STEP, "bound": LARGEST_ENTRY, "wider_bound": WIDER}
_ROUNDING = {"rounding": HALF_UNIT_GAIN}
_ROUNDED = [
    *({**both(periods), "claims": [table_claim(periods)]} for periods in TABLE_1),
    *({**CASES[name], "claims": [f"gamma.case-{name.lower()}"]} for name in "ABC"),
    *({**both((3, 3), n - 1), "claims": [f"timing.case-{n}"]} for n in (2, 3)),
]
"""The designs whose level is printed, each with the claims on it."""


def times(inputs: Json) -> Json:
    """Periods and offsets of a schedule."""
    return {name: inputs[name] for name in ("periods", "offsets")}


EXPERIMENTS = (
    *(experiment(name, designs.design, plant=PLANT, **inputs) for name, inputs in DESIGNS.items()),
    *(
        experiment(gain_set(name), designs.norm_of_gains, plant=PLANT, **times(inputs), gains=GAINS[name], **_ROUNDING)
        for name, inputs in GAIN_SETS.items()
    ),
    experiment("common", designs.on_common_plant, **INPUTS),
    experiment("sensitivity", designs.rounded_levels, plant=PRINTED_PLANT, designs=_ROUNDED),
    *(experiment(f"schedule.{name}", designs.selections, **times(schedule)) for name, schedule in SCHEDULES.items()),
    experiment("schedule.dual-rate", designs.selections, **times(CASES["C"])),
    experiment(PERIOD_TABLE, designs.period_table, plant=PLANT, largest=6),
    experiment("constant-matrix", designs.constant_matrix, plant=PLANT, **times(both((2, 1))), analysed=_GAINS_OF),
    experiment("identities", simulations.identities, trials=50, seed=SEED),
    experiment("summation", simulations.summation, plant=PLANT, **_PROPOSED, **_SUMMED),
    experiment("observability", simulations.observability, plant=PLANT),
    experiment("product-orders", simulations.product_orders, plant=PLANT, **times(_PROPOSED), gains=GAINS["33"]),
    experiment("responses", simulations.response, plant=PLANT, cases=_SIMULATED | _TIMED, **_NOISE, seed=SEED),
    experiment(DRAWS, simulations.draws, plant=PLANT, cases=_SIMULATED, **_NOISE, seeds=SEEDS, seed=SEED),
    experiment("timing-draws", simulations.timing_draws, plant=PLANT, cases=_TIMED, **_NOISE, seeds=SEEDS, seed=SEED),
    experiment("worst-disturbance", simulations.worst_disturbance, plant=PLANT, case=_PROPOSED, horizon=300, seed=SEED),
    experiment("unstable.as-printed", unstable.as_printed, stated=_STATED),
    experiment("unstable.diagonals", unstable.diagonals, stated=_STATED, half_unit=HALF_UNIT_POLE, bound=LARGEST_ENTRY),
    experiment("unstable.any-entries", unstable.any_entries, stated=_STATED, decimals=ENTRY_DECIMALS),
    experiment("unstable.stated-designs", unstable.stated_designs, inputs=_INPUTS, **TRIED),
    experiment("unstable.recovered", unstable.recovered, stated=_STATED, inputs=_INPUTS, **_SEARCHED),
)
