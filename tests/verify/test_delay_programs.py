"""Certificates of LMI (3) on Padé models, and of the dual of Theorem 3."""

import random
from itertools import product

import pytest
from byhand import own
from flint import fmpq, fmpq_mat
from tampered import Altered, Json, refused
from tampered import delayed as certificate

from papers.peet2019.certificates import least
from replication.certify.delay import dual as dual_maker
from replication.certify.delay import levels as maker
from replication.verify.algebra.linear import identity, zeros
from replication.verify.delay import levels as delay_levels
from replication.verify.delay import plant as delay_plant
from replication.verify.delay import sos as delay_sos
from replication.verify.run import check


@pytest.mark.parametrize("row", refused("delay_programs"), ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


def two_delays() -> Json:
    """Both delays act, the first on one state only; z depends on a late state."""
    return {
        "name": "own",
        "A0": [["-2", "1"], ["1/2", "-3"]],
        "A": [[["1/2", "0"], ["1/4", "0"]], [["0", "1/3"], ["1/5", "1"]]],
        "delays": ["1/2", "3/2"],
        "B": [["1", "0"], ["1", "2"]],
        "C10": [["1", "1"]],
        "C1": [[["0", "0"]], [["1/4", "1/7"]]],
        "C2": [["0", "1"]],
    }


def test_a_pade_model_of_ones_own_is_certified_from_both_sides() -> None:
    theorem = own("delay.pade-upper", plant=two_delays(), parameters={"order": 2})
    upper = {**theorem, **maker.pade_upper(theorem, least)}
    lower = {**theorem, "statement": "delay.pade-lower", **maker.pade_lower(theorem)}
    high, low = check(upper).upper, check(lower).lower
    assert high is not None and low is not None
    assert 0 < high / low - 1 < fmpq(1, 10)


@pytest.mark.parametrize(("rule", "plant"), [("outer", two_delays()), ("inner", certificate("ex2-d1-lower")["plant"])])
def test_both_bounds_with_kernels_in_one_variable_agree(rule: str, plant: Json) -> None:
    """Degree 1 from both sides: squares below the functional would contradict it."""
    theorem = own("delay.narrow-lower", plant=plant, parameters={"degree": 1, "rule": rule})
    upper = {**theorem, "statement": "delay.narrow-upper", **maker.narrow_upper(theorem)}
    lower = {**theorem, "statement": "delay.narrow-lower", **dual_maker.narrow_lower(theorem)}
    high, low = check(upper).upper, check(lower).lower
    assert high is not None and low is not None
    assert 0 <= high / low - 1 < fmpq(1, 50)  # the weighted squares of the lower bound are more


def full(rows: int, columns: int, rng: random.Random) -> fmpq_mat:
    return fmpq_mat(rows, columns, [rng.randint(-3, 3) for _ in range(rows * columns)])


def functional(points: int, functions: int, powers: int) -> delay_levels.Functional:
    rng = random.Random(2)
    square = (functions, functions, rng)
    return delay_levels.Functional(
        delay_sos.Form(
            full(points, points, rng),
            {a: full(points, functions, rng) for a in range(powers)},
            {a: full(*square) for a in range(powers)},
            {(a, b): full(*square) for a, b in product(range(powers), repeat=2)},
        ),
        [full(*square) for _ in range(powers)],
    )


def inner(first: fmpq_mat, second: fmpq_mat) -> fmpq:
    return sum((a * b for a, b in zip(first.entries(), second.entries(), strict=True)), fmpq(0))


def valued(weights: delay_sos.Form, form: delay_sos.Form) -> fmpq:
    """The value on a form by its definition: each coefficient by its weight."""
    pairs = [(weights.P, form.P)]
    for table, parts in ((weights.Q, form.Q), (weights.S, form.S), (weights.R, form.R)):
        pairs += [(table[power], part) for power, part in parts.items()]
    return sum((inner(weight, part) for weight, part in pairs), fmpq(0))


@pytest.mark.parametrize("rule", ["each", "outer", "inner"])
def test_the_matrix_on_squares_gives_the_functional_of_every_square(rule: str) -> None:
    points, functions, degree = 3, 2, 2
    weights = functional(points, functions, 2 * degree + 1).weights
    for weight, order in ((delay_sos.UNIFORM, degree), (delay_sos.BUMP, degree - 1)):
        powers = delay_sos.kernels(order, rule)
        G = delay_levels._on_squares(weights, functions, weight, order, powers)
        size = delay_sos.basis_size(points, functions, order, powers)
        half = full(size, size, random.Random(1))
        M = half + half.transpose()
        assert inner(G, M) == valued(weights, delay_sos.square(M, weight, points, functions, order, powers))
        assert G.transpose() == G


def storage(n: int, width: int, powers: int) -> delay_sos.Form:
    """A form with every coefficient, of which S couples no two delays."""
    rng = random.Random(3)
    P = full(n, n, rng)
    blocks = [full(n, n, rng) for _ in range(powers)]
    pairs = {(a, b): full(width, width, rng) for a in range(powers) for b in range(a, powers)}
    S = {a: delay_plant.repeated(part + part.transpose(), width // n) for a, part in enumerate(blocks)}
    R = {(a, b): part + part.transpose() if a == b else part for (a, b), part in pairs.items()}
    return delay_sos.Form(
        P + P.transpose(),
        {a: full(n, width, rng) for a in range(powers)},
        S,
        {**R, **{(b, a): part.transpose() for (a, b), part in R.items()}},
    )


def test_the_functional_on_the_rate_of_a_storage() -> None:
    plant = delay_plant.measured_last(delay_plant.read_plant(two_delays()), identity(2))
    seen = functional(9, 4, 4)
    of_rate, V = seen.of_rate(plant), storage(2, 4, 4)
    empty = delay_sos.Form(zeros(2, 2), {}, {}, {})
    supply = valued(seen.weights, delay_sos.rate(plant, fmpq(0), empty))
    assert supply == inner(seen.weights.P, delay_sos.supplied(plant, fmpq(0))) != 0
    assert valued(of_rate, V) == valued(seen.weights, delay_sos.rate(plant, fmpq(0), V)) - supply
    across = zeros(4, 4)
    across[0, 2] = across[2, 0] = fmpq(3)
    coupled = delay_sos.Form(empty.P, {}, {1: across}, {})
    assert valued(of_rate, coupled) == 3 * (seen.coupling[1][0, 2] + seen.coupling[1][2, 0])


def test_a_section_of_odd_order_is_accepted() -> None:
    # (2 - s)/(2 + s) = -1 + 4/(s + 2)
    value = {"a": [["-2"]], "b": [["1"]], "c": [["4"]], "d": "-1"}
    assert delay_plant.read_section(value, "section", 1)[3] == -1
