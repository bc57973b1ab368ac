"""What a stranger may try with the public functions: plants of all kinds, and mistakes that must be named."""

from collections.abc import Callable
from typing import Any
from unittest.mock import Mock

import control
import numpy as np
import pytest
from scipy.sparse.linalg import ArpackNoConvergence

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation import delay, dualrate, multirate, nonuniform
from replication.estimation.nonuniform import worst_case
from tests.estimation.api.api_cases import CART, CARTS, CASES, PIPE, SERVO, SPRING, TANKS, TIMES, WAVES, result_of

SAME = 1e-9


@pytest.mark.parametrize("method", CASES)
def test_names_of_the_plant_are_kept(method: str) -> None:
    signals = result_of(method).signals
    assert (signals.states, signals.inputs, signals.measurements, signals.outputs) == CASES[method].names


def test_arrays_give_what_a_statespace_gives() -> None:
    cart = multirate.MultiratePlant(
        A=CART.A, B_d=CART.B[:, :1], B_u=CART.B[:, 1:], C=CART.C, D=np.diag([0.5, 0.1]), dt=0.1
    )
    pairs = [
        (multirate.design(cart, periods=(1, 4), offsets=(0, 2)), "multirate"),
        (
            nonuniform.design(
                nonuniform.SampledPlant(SPRING.A, SPRING.B, SPRING.C[:1], SPRING.D[:1], SPRING.C[1:]),
                periods=nonuniform.PeriodRange(0.05, 0.2),
                leaves=2,
                horizon=50,
            ),
            "nonuniform",
        ),
        (dualrate.design(dualrate.make_plant(SERVO.A, SERVO.B, SERVO.C), period=0.02, ratio=10), "dualrate"),
        (delay.design(delay.delay_system(TANKS.A, PIPE, [0.4], TANKS.B, TANKS.C[1:], TANKS.C[:1]), order=12), "delay"),
    ]
    for given, method in pairs:
        assert given.bracket == result_of(method).bracket
        assert given.signals.states == ("x[0]", "x[1]")


def test_the_observer_of_one_period_is_a_statespace_with_the_names_of_the_plant() -> None:
    result = multirate.design(CART, periods=(1, 1), noise=[0.5, 0.1], disturbances=["wind"])
    system = result.to_statespace()
    assert (system.dt, list(system.state_labels)) == (0.1, ["position", "speed"])
    assert list(system.input_labels) == ["force", "encoder", "camera"]
    assert list(system.output_labels) == ["estimate of position", "estimate of speed"]
    lifted = result_of("multirate").to_statespace()
    assert lifted.dt == pytest.approx(0.4) and lifted.input_labels[:3] == ["force@0", "encoder@0", "camera@0"]


def test_other_statespaces_have_names_and_the_gain_of_the_bracket() -> None:
    filter_ = result_of("nonuniform").to_statespace()
    assert filter_.dt is True and list(filter_.input_labels) == ["gauge"]
    constant = nonuniform.analyse(SPRING, filter_, periods=(0.1, 0.1), measured=1, leaves=1, horizon=50)
    assert constant.to_statespace().dt == 0.1
    stamped, h = result_of("stamped"), 0.1
    at, same = stamped.to_statespace(h), stamped.constant(h)
    assert at.dt == h and np.array_equal(np.vstack([at.A, at.C]), np.vstack([same.A, same.C]))
    loop = result_of("dualrate")
    lifted = loop.to_statespace()
    assert lifted.dt == pytest.approx(0.2) and lifted.output_labels[-1] == "camera@9"
    peak = max(np.linalg.norm(lifted(np.exp(1j * angle)), 2) for angle in np.linspace(0, np.pi, 50)) / np.sqrt(10)
    assert peak == pytest.approx(loop.bracket.lower, rel=SAME)  # it lies at angle zero
    error = result_of("delay").to_statespace()
    assert list(error.output_labels) == ["error of deep"]
    frequency = result_of("delay").fact("lower end attained at").value
    assert np.linalg.norm(error(1j * frequency), 2) == pytest.approx(result_of("delay").bracket.lower, rel=SAME)


def test_analysing_a_design_gives_its_bracket() -> None:
    designed = result_of("multirate")
    assert multirate.analyse(CART, designed.gains["L"], offsets=(0, 2), **CARTS).bracket == designed.bracket
    robust = result_of("nonuniform")
    given = {"periods": (0.05, 0.2), "measured": 1, "leaves": 2, "horizon": 50}
    assert nonuniform.analyse(SPRING, robust.to_statespace(), **given).bracket == robust.bracket
    loop = result_of("dualrate")
    gains = {"feedback": loop.gains["K"], "injection": loop.gains["L"]}
    assert dualrate.analyse(SERVO, **gains, period=0.02, ratio=10).bracket == loop.bracket
    assert dualrate.compare(loop)["running_prediction"] == loop.fact("monodromy radius").value
    alone = delay.analyse(TANKS, delayed=PIPE, delays=[0.4], measured=1)
    told = {one["what"]: one["value"] for one in alone.to_dict()["evidence"]}
    assert told["gain from w to z"] >= result_of("delay").bracket.lower
    assert "rightmost root" in str(alone) and len(alone.plot().axes) == 1


def test_simulations_take_arrays_and_seeds() -> None:
    result = result_of("multirate")
    drawn = [multirate.simulate(result, 30, disturbance="white", rng=np.random.default_rng(3)) for _ in range(2)]
    assert np.array_equal(drawn[0].signals["error"], drawn[1].signals["error"])
    again = multirate.simulate(result, 30, disturbance=drawn[0].signals["disturbance"])
    assert again.ratio == drawn[0].ratio
    free = multirate.simulate(result, 30, initial_error=[1.0, 0.0])
    assert free.ratio is None and free.signals["error"][0].tolist() == [1.0, 0.0]
    periods = np.full(20, 0.1)
    filter_ = result_of("nonuniform")
    worst = nonuniform.simulate(filter_, periods)
    calm = nonuniform.simulate(filter_, periods, disturbance=np.ones((20, 2)))
    assert calm.ratio < worst.ratio <= filter_.value


FITTING: dict[str, tuple[Any, dict[str, Any]]] = {
    "multirate": (CART, {"periods": (1, 4), "noise": [1, 1]}),
    "nonuniform": (SPRING, {"periods": (0.1, 0.2), "measured": 1}),
    "dualrate": (SERVO, {"period": 0.1, "ratio": 2}),
    "delay": (TANKS, {"delayed": PIPE, "delays": [0.4], "measured": 1}),
}
SCALAR = multirate.MultiratePlant(A=[[0.5]], B_d=[[1]], C=[[1]], D=[[1]])
LEFT_OUT = object()
DOORS: dict[str, Any] = {"multirate": multirate, "nonuniform": nonuniform, "dualrate": dualrate, "delay": delay}


@pytest.mark.parametrize(
    ("method", "changes", "message"),
    [
        ("multirate", {"offsets": (0, 4)}, "from 0 to 3"),
        ("multirate", {"weight": [1, 0]}, r"write a row as \[\[1, 0\]\]"),
        ("multirate", {"noise": [-1, 0.1]}, "noise must be .* not negative"),
        ("multirate", {"plant": SCALAR, "periods": (1,), "noise": [1]}, "belong to a control.StateSpace"),
        ("nonuniform", {"measured": LEFT_OUT}, "give the measured outputs"),
        ("nonuniform", {"measured": 2}, "leave at least one to be estimated"),
        ("nonuniform", {"measured": ["gage"]}, "no output 'gage'; the outputs are gauge, velocity"),
        ("nonuniform", {"periods": (0.2, 0.1)}, "swap them"),
        ("nonuniform", {"periods": (10, 100)}, "if milliseconds were meant, divide by 1000"),
        ("nonuniform", {"periods": 0.1}, "must be \\(h_l, h_u\\)"),
        ("nonuniform", {"periods": (1, 2, 3)}, "must be \\(h_l, h_u\\)"),
        ("nonuniform", {"plant": CART}, "continuous-time"),
        ("nonuniform", {"goal": np.array([])}, 'goal must be "robust" or "nominal"'),
        ("nonuniform", {"goal": "best"}, 'goal must be "robust" or "nominal"'),
        ("dualrate", {"observer": ["fast_sensor"]}, "observer must be one of single_rate"),
        ("dualrate", {"process_noise": [[-1, 0], [0, 1]]}, "process_noise must be symmetric and positive semidefinite"),
        *(
            ("dualrate", {"plant": plant}, r"a plant must be a control\.StateSpace or made by make_plant")
            for plant in ("servo", np.eye(2), control.tf([1], [1, 1]), None)
        ),
        ("delay", dict.fromkeys(("delayed", "delays", "measured"), LEFT_OUT), "needs delayed="),
        ("delay", {"delayed": PIPE * 2, "delays": [0.4, 0.2]}, "must increase strictly"),
        ("delay", {"rule": "cubic"}, "rule must be one of"),
        ("delay", {"plant": 3, **dict.fromkeys(("delayed", "delays", "measured"), LEFT_OUT)}, "must be a delay_system"),
    ],
)
def test_mistakes_in_a_design_are_named(method: str, changes: dict[str, Any], message: str) -> None:
    plant, fitting = FITTING[method]
    given = {"plant": plant, **fitting, **changes}
    with pytest.raises(InvalidInputError, match=message):
        DOORS[method].design(
            given.pop("plant"), **{name: value for name, value in given.items() if value is not LEFT_OUT}
        )


OTHER = "result must be a {}Result, as design gives it, got {}"
CALLS: list[tuple[Callable[[Any], Any], str, str]] = [
    (lambda result: multirate.simulate(result, 5, disturbance="white"), "multirate", "needs `rng`"),
    (lambda result: multirate.simulate(result, 5, disturbance="white", rng=3), "multirate", "needs `rng`"),
    (lambda result: multirate.simulate(result, 5, disturbance="pink"), "multirate", "must be"),
    (lambda result: multirate.simulate(result, 5, disturbance=np.zeros((4, 3))), "multirate", "must have 5 rows"),
    (lambda result: multirate.simulate(result, 5), "dualrate", OTHER.format("Multirate", "DualRateResult")),
    (lambda result: nonuniform.simulate(result, [0.1, 0.3]), "nonuniform", "must lie in \\[0.05, 0.2\\]"),
    (lambda _: nonuniform.analyse(SPRING, [[1]], periods=(0.1, 0.2), measured=1), "", "filter_ must be Filter"),
    (
        lambda _: nonuniform.analyse(SPRING, control.ss([[-0.5]], [[1]], [[1]], 0), periods=(0.1, 0.2), measured=1),
        "",
        "runs from sample to sample",
    ),
    (lambda _: nonuniform.simulate(3), "", "result must be a NonuniformResult"),
    (lambda _: dualrate.compare(None), "", "result must be a DualRateResult"),
    (lambda _: dualrate.simulate(SERVO, [1.0, 0.0], slow_periods=2), "", OTHER.format("DualRate", "StateSpace")),
    (lambda result: dualrate.simulate(result, [1.0], slow_periods=2), "dualrate", "x\\(0\\) must be"),
    (lambda result: delay.simulate(result, TIMES, 0 * WAVES), "delay", "must not vanish"),
]
"""What is called, with the result of which method, and what it says."""


@pytest.mark.parametrize(("call", "method", "message"), CALLS)
def test_other_mistakes_are_named(call: Callable[[Any], Any], method: str, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        call(result_of(method) if method else None)


def test_an_unstable_loop_is_refused_with_what_would_be_stable() -> None:
    with pytest.raises(InfeasibleError, match=r"monodromy radius .* full state .* shorter period"):
        dualrate.analyse(SERVO, feedback=[[1.0, 0.0]], injection=[[1.0], [0.0]], period=0.1, ratio=2)
    gains = {"feedback": [[-20.0, -8.0]], "injection": [[1.0], [20.0]], "period": 0.02, "ratio": 20}
    with pytest.raises(InfeasibleError, match="one of the observers") as caught:
        dualrate.analyse(SERVO, **gains, observer="held_measurement")
    for name in str(caught.value).partition("the observers ")[2].removesuffix(", or another gain L").split(", "):
        assert dualrate.analyse(SERVO, **gains, observer=name).fact("monodromy radius").value < 1


def test_measurements_that_reveal_the_disturbance_are_named() -> None:
    plant = delay.delay_system([[0, 1], [-2, -0.3]], [[[0, 0], [0.5, 0.2]]], [0.4], [[0], [1]], np.eye(2), [[1, 0]])
    with pytest.raises((InfeasibleError, SolverError), match="y has no noise and may reveal w"):
        delay.design(plant)


def test_a_search_that_does_not_settle_is_a_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worst_case, "DENSE", 0)
    lost = Mock(side_effect=ArpackNoConvergence("no convergence", [], []))
    monkeypatch.setattr(worst_case.scipy.sparse.linalg, "eigsh", lost)
    with pytest.raises(SolverError, match=r"no worst disturbance over 50 samples .* change `horizon`"):
        nonuniform.design(SPRING, periods=(0.1, 0.1), measured=1, leaves=1, horizon=50)


def test_no_stabilising_gain_is_named() -> None:
    plant = dualrate.make_plant([[1.0, 0], [0, 2.0]], [[1.0], [0.0]], [[1.0, 1.0]])
    with pytest.raises(InfeasibleError, match="no stabilising solution"):
        dualrate.design(plant, period=0.1, ratio=2)


def test_delays_beyond_what_ends_are_refused_by_name() -> None:
    tanks = {"delayed": PIPE, "delays": [0.4], "measured": 1}
    for extreme in ({"degree": 50}, {"order": 10**6}):
        with pytest.raises(InvalidInputError, match=f"{next(iter(extreme))} must be at most"):
            delay.design(TANKS, **tanks, **extreme)
    with pytest.raises(InvalidInputError, match="dt must be at least"):
        result_of("delay").observer(1e-12)
    with pytest.raises(InvalidInputError):
        delay.simulate(3, [0.0, 1.0], [[1.0], [1.0]])
