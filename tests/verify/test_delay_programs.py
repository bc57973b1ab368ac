"""Certificates of LMI (3) on Padé models, and of the dual of Theorem 3."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import product
from math import factorial
from typing import Any

import numpy as np
import pytest
from byhand import own
from flint import acb, fmpq, fmpq_mat
from tampered import Json, Tamper, at, put, refusal, scaled
from tampered import delayed as certificate
from tampered import own as altered

from papers.peet2019.certificates import least
from replication.certify.delay import dual as dual_maker
from replication.certify.delay import levels as maker
from replication.certify.rounding import exact, floats, rational
from replication.verify.algebra.linear import identity, zeros
from replication.verify.delay import dual as delay_dual
from replication.verify.delay import pade as delay_pade
from replication.verify.delay import plant as delay_plant
from replication.verify.delay import sos as delay_sos
from replication.verify.run import check

SMALL = Fraction(1, 100_000)


def plus_one(*path: Any) -> Tamper:
    return lambda given: put(str(Fraction(at(given, *path)[0][path[-1]]) + 1), *path)(given)


def unscaled(given: Json) -> None:
    """A storage that ignores one state of the section, which is not left out of the inequality."""
    for i in range(12):
        given["witness"]["P"][i][2] = given["witness"]["P"][2][i] = "1000" if i == 2 else "0"


def cropped(size: int) -> Tamper:
    return lambda given: put([row[:size] for row in given["witness"]["P"][:size]], "witness", "P")(given)


def coupled(given: Json) -> None:
    coupling = given["witness"]["functional"]["coupling"]
    coupling[0][0][2] = coupling[0][2][0] = "5"


def zeroed(given: Json) -> None:
    def zero(value: Any) -> Any:
        return [zero(entry) for entry in value] if isinstance(value, list) else "0"

    given["witness"]["functional"] = {key: zero(value) for key, value in given["witness"]["functional"].items()}


def weighed(value: str, *path: Any) -> Tamper:
    return put(value, "witness", "functional", *path)


LESS, MORE, SECTION = str(1 - SMALL), str(1 + SMALL), ("witness", "section")
NOT_POSITIVE = "not positive on |w|^2 + |v|^2"
ALTERED: list[tuple[str, Tamper, str]] = [
    ("ex1-pade-upper", scaled(LESS, "bound", "upper"), "minus LMI (3)"),
    ("ex1-pade-lower", scaled(MORE, "bound", "lower"), "not proved to reach"),
    *(
        (f"ex1-pade-{side}", put(order, "parameters", "order"), f"must be at most 50, got {order}")
        for side in ("lower", "upper")
        for order in (999_999_999, 51)
    ),
    ("ex1-pade-upper", put(8, "parameters", "order"), "must have 8 entries"),
    ("ex1-pade-upper", put(0, "parameters", "order"), "at least 1"),
    ("ex1-pade-upper", put("-1", "witness", "P", -1, -1), "witness.P is not positive definite"),
    *(("ex1-pade-upper", cropped(size), f"witness.P must have 12 rows, got {size}") for size in (1, 11)),
    ("ex1-pade-upper", unscaled, "minus LMI (3)"),
    ("ex1-pade-upper", plus_one(*SECTION, "a", 0, 0), "the poles of witness.section"),
    ("ex1-pade-upper", plus_one(*SECTION, "b", 0, 0), "the numerator"),
    ("ex1-pade-upper", plus_one(*SECTION, "c", 0, 0), "the numerator"),
    ("ex1-pade-upper", plus_one(*SECTION, "d"), "the numerator"),
    ("ex2-d1-lower", scaled(MORE, "bound", "lower"), "the functional gives 2.3327"),
    ("ex2-d1-lower", zeroed, NOT_POSITIVE),
    ("ex2-d1-lower", weighed("-2", "P", 0, 0), NOT_POSITIVE),
    ("ex2-d1-lower", weighed("-1/2", "P", 1, 1), "the functional on N of degree 1"),
    ("ex2-d1-lower", weighed("100", "P", 2, 3), "must be symmetric"),
    ("ex2-d1-lower", weighed("1", "P", 4, 4), "sees what Z cancels in P: entry (4, 4)"),
    ("ex2-d1-lower", weighed("1", "P", 6, 6), "the functional on dV/dt of degree 1"),
    ("ex2-d1-lower", weighed("1", "Q", 1, 3, 1), "sees what Z cancels in Q, power 1: entry (3, 1)"),
    ("ex2-d1-lower", weighed("1", "S", 2, 1, 1), "sees what Z cancels in S, power 2: entry (1, 1)"),
    ("ex2-d1-lower", weighed("-1", "S", 0, 0, 0), "the functional on"),
    ("ex2-d1-lower", weighed("1", "R", 0, 1, 1, 0), "sees what Z cancels in R, powers (0, 1): entry (1, 0)"),
    ("ex2-d1-lower", weighed("-100", "R", 0, 0, 0, 0), "the functional on N of degree"),
    # Larger moments of the plain weight help there, and hurt where the weight is -s(s+1).
    ("ex2-d1-lower", weighed("40", "S", 2, 0, 0), "of degree 0 is not positive semidefinite"),
    ("ex3-d1-lower", coupled, "the functional on dV/dt of degree 1"),
    ("ex2-d1-lower", put(2, "parameters", "degree"), "must have 5 entries"),
    ("ex2-d1-lower", put(0, "parameters", "degree"), "at least 1"),
    *(
        (f"{name}-lower", tamper, reason)
        for name, other, degree in (("ex2-outer", "inner", 3), ("ex3-inner", "outer", 2))
        for tamper, reason in (
            (scaled(str(1 + 10 * SMALL), "bound", "lower"), "the functional gives"),
            (put(other, "parameters", "rule"), "positive semidefinite"),
            (put("each", "parameters", "rule"), "parameters.rule must be"),
            (put(degree - 1, "parameters", "degree"), f"must have {2 * degree + 1} entries"),
        )
    ),
]


@pytest.mark.parametrize(("name", "tamper", "reason"), ALTERED)
def test_an_altered_certificate_is_refused(name: str, tamper: Tamper, reason: str) -> None:
    assert reason in refusal(altered(f"peet2019/{name}", tamper))


def test_the_pade_model_of_the_largest_order_is_read() -> None:
    assert check(altered("peet2019/ex1-pade-lower", put(50, "parameters", "order"))).lower is not None


@pytest.mark.parametrize(("example", "digits"), [("ex1", "0.235702"), ("ex2", "2.32700"), ("ex3", "1.35009")])
def test_the_level_of_the_pade_model_is_bracketed(example: str, digits: str) -> None:
    theorems = [check(certificate(f"{example}-pade-{side}")) for side in ("lower", "upper")]
    low, high = theorems[0].lower, theorems[1].upper
    assert low is not None and high is not None
    assert theorems[0].upper is theorems[1].lower is None
    assert 0 < high / low - 1 < fmpq(1, 100_000)
    assert all(digits in theorem.sentence for theorem in theorems)


@pytest.mark.parametrize(("order", "error"), [(2, 2e-3), (4, 1e-6)])
def test_the_approximant_agrees_with_the_exponential(order: int, error: float) -> None:
    # q(-s) = exp(-s) q(s) up to the power 2 N.
    q = delay_pade.denominator(order).coeffs()
    for power in range(2 * order + 1):
        terms = (q[k] * fmpq((-1) ** (power - k), factorial(power - k)) for k in range(min(power, order) + 1))
        assert sum(terms, fmpq(0)) == (q[power] * (-1) ** power if power <= order else 0)
    value = delay_pade.lag(order, acb(0, 1))
    exact = (-acb(0, 1)).exp()
    assert abs(complex(value) - complex(exact)) < error
    assert abs(abs(complex(value)) - 1.0) < 1e-12


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


def test_the_model_is_that_of_a_second_construction() -> None:
    plant, part = two_delays(), maker.section(4)
    A, B, C = delay_pade.model(delay_plant.read_plant(plant), (part.a, part.b, part.c, part.d))
    expected = maker._model(maker.floating(plant), part)
    for found, wanted in zip((A, B, C), expected, strict=True):
        np.testing.assert_allclose(floats(found), wanted, rtol=1e-13, atol=1e-13)
    assert A.nrows() == 2 + 3 * 4


def test_a_pade_model_of_ones_own_is_certified_from_both_sides() -> None:
    theorem = own("delay.pade-upper", plant=two_delays(), parameters={"order": 2})
    upper = {**theorem, **maker.pade_upper(theorem, least)}
    lower = {**theorem, "statement": "delay.pade-lower", **maker.pade_lower(theorem)}
    high, low = check(upper).upper, check(lower).lower
    assert high is not None and low is not None
    assert 0 < high / low - 1 < fmpq(1, 10)


@pytest.mark.parametrize(("example", "digits"), [("ex2", "2.3327"), ("ex3", "1.35115")])
def test_the_level_at_degree_one_is_bounded_below(example: str, digits: str) -> None:
    given = certificate(f"{example}-d1-lower")
    theorem = check(given)
    assert str(theorem.lower) == given["bound"]["lower"]
    assert theorem.upper is None and theorem.holds is None
    assert digits in theorem.sentence
    upper = Fraction(certificate(f"{example}-d1-upper")["bound"]["upper"])
    assert 1 < upper / Fraction(given["bound"]["lower"]) < 1 + 2 * SMALL


@pytest.mark.parametrize(("name", "rule", "degree"), [("ex2-outer", "outer", 3), ("ex3-inner", "inner", 2)])
def test_the_level_with_kernels_in_one_variable_is_bounded_below(name: str, rule: str, degree: int) -> None:
    given = certificate(f"{name}-lower")
    theorem = check(given)
    said = {one.of.setting["degree"]: one.readings for one in theorem.says}
    assert said == {d: (f"z2-{rule}",) if d <= degree else () for d in (1, 2, 3, 4)}
    assert theorem.upper is None and theorem.holds is None


@pytest.mark.parametrize("rule", ["outer", "inner"])
def test_both_bounds_with_kernels_in_one_variable_agree(rule: str) -> None:
    """Degree 1 of Example 2 from both sides: squares below the functional would contradict it."""
    theorem = {**certificate("ex2-d1-lower"), "name": "own", "paper": None, "claims": []}
    theorem["parameters"] = {"degree": 1, "rule": rule}
    upper = {**theorem, "statement": "delay.narrow-upper", **maker.narrow_upper(theorem)}
    lower = {**theorem, "statement": "delay.narrow-lower", **dual_maker.narrow_lower(theorem)}
    high, low = check(upper).upper, check(lower).lower
    assert high is not None and low is not None
    assert 0 <= high / low - 1 < fmpq(1, 50)  # the weighted squares of the lower bound are more


def full(rows: int, columns: int, rng: random.Random) -> fmpq_mat:
    return fmpq_mat(rows, columns, [rng.randint(-3, 3) for _ in range(rows * columns)])


def functional(points: int, functions: int, powers: int) -> delay_dual.Functional:
    rng = random.Random(2)
    square = (functions, functions, rng)
    return delay_dual.Functional(
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
        G = delay_dual._on_squares(weights, functions, weight, order, powers)
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


def test_matrices_of_one_shape_are_weighed() -> None:
    with pytest.raises(ValueError, match="zip"):
        delay_dual._inner(zeros(2, 2), zeros(1, 1))


def test_a_section_of_odd_order_is_accepted() -> None:
    # (2 - s)/(2 + s) = -1 + 4/(s + 2)
    value = {"a": [["-2"]], "b": [["1"]], "c": [["4"]], "d": "-1"}
    assert delay_pade.read_section(value, "section", 1)[3] == -1


def test_the_functional_is_weakly_dual() -> None:
    """On the certificate from above of the same degree, the identity turns into level times value minus value <= 0."""
    plant = delay_plant.measured_last(delay_plant.read_plant(certificate("ex2-d1-upper")["plant"]), identity(2))
    given = certificate("ex2-d1-lower")["witness"]["functional"]
    points, functions = plant.points, 2
    assert points == 7
    weights = delay_dual.read_functional(given, "functional", plant, 3).weights
    grams = certificate("ex2-d1-upper")["witness"]
    forms = []
    for kind, count in (("storage", 2), ("dissipation", points)):
        parts = [
            delay_sos.square(exact(gram), weight, count, functions, order)
            for gram, weight, order in zip(grams[kind], (delay_sos.UNIFORM, delay_sos.BUMP), (1, 0), strict=True)
        ]
        forms.append(delay_sos.total(*parts))
    gamma = rational(certificate("ex2-d1-upper")["bound"]["upper"])
    whole = delay_sos.total(delay_sos.rate(plant, gamma, forms[0]), forms[1])
    assert valued(weights, whole) == 0
    assert valued(weights, forms[1]) > 0
