"""The small program: its inequalities against integrals on polynomial histories, its gains, its solver."""

from __future__ import annotations

import numpy as np
import pytest

from replication.errors import InvalidInputError, SolverError
from replication.estimation.conic.interior import Block, Point, solve
from replication.estimation.conic.program import ALMOST, Inequalities, program_under, solve_clarabel, symmetric_basis
from replication.estimation.delay.general.cone import (
    LineForm,
    Rates,
    Storage,
    dissipation,
    injection,
    line_form,
    multiplier,
    positivity,
    rates,
    scalars_of,
    storage_of,
)
from replication.estimation.delay.sos import legendre
from replication.estimation.validation import Array
from tests.estimation.delay.plants import averaged, delayed_output, two_late
from tests.tolerances import ROUNDING

DEGREE = 4
PLANTS = [averaged, delayed_output, two_late]


def random_storage(over: Rates, seed: int = 3) -> Storage:
    """Positive matrices."""
    rng = np.random.default_rng(seed)

    def positive(order: int) -> Array:
        root = rng.normal(size=(order, order))
        return np.asarray(root @ root.T / order + 0.3 * np.eye(order))

    widths = [len(line.entry) for line in over.lines]
    s, t = (tuple(positive(width) for width in widths) for _ in range(2))
    return Storage(positive(len(over.u)), s, t, 1.7)


def history(form: LineForm, over: Rates, seed: int) -> Array:
    """zeta of a history of degree below DEGREE that fits what enters: psi_i(0) = E_i [e; w], psi_i(-1) its end."""
    rng = np.random.default_rng(seed)
    zeta = rng.normal(size=over.rate.shape[1])
    first, last = legendre.evaluate(DEGREE, 0.0)[0], legendre.evaluate(DEGREE, -1.0)[0]
    start, far = form.states, len(over.u)
    for line in over.lines:
        m = len(line.entry)
        part = slice(start, start + DEGREE * m)
        moments = zeta[part].reshape(DEGREE, m)
        moments = moments + np.outer(first, line.entry @ zeta - first @ moments) / (first @ first)
        zeta[part], zeta[far : far + m] = moments.ravel(), last @ moments
        start, far = part.stop, far + m
    return zeta


def storage_rate(form: LineForm, over: Rates, storage: Storage, zeta: Array) -> float:
    """dV/dt without injection, by quadrature of the histories and of their derivatives."""
    points, weights = legendre.gauss(3 * DEGREE)
    basis, slope = legendre.evaluate(DEGREE, points), legendre.derivative(DEGREE)
    u = over.u @ zeta
    moving = over.rate[: form.states] @ zeta
    rate, energy, start = [moving], 0.0, form.states
    w = storage.plus.copy()
    for line, s, t in zip(over.lines, storage.s, storage.t, strict=True):
        m = len(line.entry)
        part = slice(start, start + DEGREE * m)
        moments = u[part].reshape(DEGREE, m)
        psi, derivative = basis @ moments, basis @ (slope @ moments) / line.delay
        rate.append(np.einsum("x,xc,xm->cm", weights, basis, derivative).ravel())
        weight = s + (1.0 + points)[:, None, None] * t
        energy += 2.0 * np.einsum("x,xm,xmn,xn->", weights, psi, weight, derivative)
        w[part, part] -= np.kron(np.eye(DEGREE), s)
        start = part.stop
    return float(2.0 * u @ w @ np.concatenate(rate) + energy)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("seed", range(3))
def test_the_inequality_is_the_dissipation(plant, seed: int) -> None:  # type: ignore[no-untyped-def]
    form = line_form(plant())
    over = rates(form, DEGREE)
    storage = random_storage(over)
    zeta = history(form, over, seed)
    v = np.random.default_rng(seed + 9).normal(size=form.outputs)
    block = dissipation(over, np.eye(len(zeta)), outputs=form.outputs)
    c = np.concatenate([zeta, v])
    found = c @ block.at(storage.plus, scalars_of(storage)) @ c
    w = over.w @ zeta
    expected = storage.level * (w @ w + v @ v) - 2.0 * v @ (over.z @ zeta) - storage_rate(form, over, storage, zeta)
    assert found == pytest.approx(expected, rel=1e-9)
    perturbed = storage_rate(form, over, random_storage(over, 4), zeta)
    assert abs(perturbed - storage_rate(form, over, storage, zeta)) > 1e-3


@pytest.mark.parametrize("plant", PLANTS)
def test_the_injection_has_the_gradient_of_the_program(plant) -> None:  # type: ignore[no-untyped-def]
    """The derivative of V along (L_0, L_i) eps is 2 u'Z eps, by quadrature on a random polynomial history."""
    form = line_form(plant())
    over = rates(form, DEGREE)
    storage = random_storage(over)
    storage = Storage(storage.plus, storage.s, storage.t, 1e3)  # N is positive enough for a Z
    z, _ = multiplier(over, storage)
    l0, _, kernels = injection(form, over, storage)
    points, weights = legendre.gauss(120)
    basis = legendre.evaluate(DEGREE, points)
    u = np.random.default_rng(5).normal(size=len(over.u))
    moments, local, start = [l0], np.zeros(z.shape[1]), form.states
    w = storage.plus.copy()
    for kernel, s, t in zip(kernels, storage.s, storage.t, strict=True):
        m = len(s)
        part = slice(start, start + DEGREE * m)
        values = np.tensordot(legendre.evaluate(len(kernel), points), kernel, axes=1)
        psi = basis @ u[part].reshape(DEGREE, m)
        local = local + np.einsum(
            "x,xm,xmn,xnq->q", weights, psi, s + (1.0 + points)[:, None, None] * t, values, optimize=True
        )
        moments.append(np.einsum("x,xc,xmq->cmq", weights, basis, values).reshape(DEGREE * m, -1))
        w[part, part] -= np.kron(np.eye(DEGREE), s)
        start = part.stop
    found = u @ w @ np.vstack(moments) + local
    assert found == pytest.approx(u @ z, rel=1e-8, abs=1e-8)


def by_clarabel(blocks: tuple[Block, ...], order: int) -> float:
    """The least of the last scalar by a general solver, each unknown as a matrix of coefficients."""
    scalars = len(blocks[0].others)
    units = symmetric_basis(order)
    count = len(units) + scalars
    groups = []
    for block in blocks:
        w = [block.linear(unit, np.zeros(scalars)) for unit in units]
        coefficients = np.concatenate([w, block.others])[None]
        groups.append(Inequalities(block.constant[None], coefficients, np.arange(count)[None]))
    cost = np.zeros(count)
    cost[-1] = 1.0
    return float(solve_clarabel(program_under(cost, *groups), accept=ALMOST).multipliers[-1])


def solved(form: LineForm, over: Rates) -> tuple[tuple[Block, ...], Point]:
    """The blocks of the least level, and their solution."""
    blocks = (
        *positivity(over),
        dissipation(over, over.without_innovation(), outputs=form.outputs),
        dissipation(over, over.without_state(), outputs=0),
    )
    cost = np.zeros(len(blocks[0].others))
    cost[-1] = -1.0
    return blocks, solve(blocks, len(over.u), cost)


@pytest.mark.parametrize(("plant", "degree"), [(delayed_output, 2), (averaged, 2), (delayed_output, 3)])
def test_the_least_level_is_that_of_another_solver(plant, degree: int) -> None:  # type: ignore[no-untyped-def]
    form = line_form(plant())
    over = rates(form, degree)
    blocks, found = solved(form, over)
    assert -found.value == pytest.approx(by_clarabel(blocks, len(over.u)), rel=1e-6)


def test_z_makes_the_whole_inequality_positive() -> None:
    """With Z and L_z put in, N of a feasible storage is positive in all coordinates."""
    form = line_form(delayed_output())
    over = rates(form, DEGREE)
    _, point = solved(form, over)
    storage = storage_of(over, point.w, point.y)
    storage = Storage(storage.plus, storage.s, storage.t, 1.05 * storage.level)
    z, lz = multiplier(over, storage)
    whole = dissipation(over, np.eye(over.rate.shape[1]), outputs=form.outputs).at(storage.plus, scalars_of(storage))
    k, p = len(over.u), form.outputs
    left = np.zeros((len(whole), form.measurements))
    left[:k], left[-p:] = z, lz
    eps = np.hstack([over.y, np.zeros((form.measurements, p))])
    assert np.linalg.eigvalsh(whole)[0] < -1e-3
    assert np.linalg.eigvalsh(whole + left @ eps + eps.T @ left.T)[0] > -ROUNDING


def test_measurements_without_noise_are_refused() -> None:
    form = line_form(two_late())
    now = form.now.copy()
    now[-1, form.states :] = 0.0
    lines = tuple(
        type(line)(line.delay, line.carry, np.vstack([line.end[:-1], 0.0 * line.end[-1:]]), line.moments)
        for line in form.lines
    )
    with pytest.raises(InvalidInputError, match=r"free of noise.*add noise to row 0 of d21"):
        rates(LineForm(form.states, form.outputs, now, lines), 2).without_innovation()
    with pytest.raises(InvalidInputError, match="degree must be at least 2"):
        rates(line_form(averaged()), 1)


def test_the_solver_on_a_program_with_a_known_answer() -> None:
    """Least t with [[t, w'], [w, W]] >= 0 and W <= diag: max over W of a linear cost has a closed form."""
    a = np.array([[2.0, 0.3], [0.3, 1.0]])
    eye = np.eye(2)
    # t I - W >= 0, W - a >= 0: the least t is the largest eigenvalue of a.
    upper = Block(np.zeros((2, 2)), eye[None], -eye / 2.0, eye)
    lower = Block(-a, np.zeros((1, 2, 2)), eye / 2.0, eye)
    point = solve((upper, lower), 2, np.array([-1.0]))
    assert point.y[0] == pytest.approx(np.linalg.eigvalsh(a)[-1], abs=1e-7)
    assert np.linalg.eigvalsh(upper.at(point.w, point.y))[0] > 0.0
    # Besides t <= 1, which is below that eigenvalue: nothing is feasible.
    cap = Block(np.ones((1, 1)), -np.ones((1, 1, 1)))
    with pytest.raises(SolverError, match="found no point"):
        solve((upper, lower, cap), 2, np.array([-1.0]))
