"""The dual-rate verifier against floating point, closed forms and known answers; and each way to cheat is told."""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import scipy.linalg
from flint import acb, acb_mat, acb_poly, arb, arb_mat, fmpq, fmpq_mat, fmpq_poly
from tampered import Altered, Certificate, Tamper, check_stated, committed, own, put, refused

from papers.shao.experiments.theorem import theorem_constants
from papers.shao.printed import COUNTEREXAMPLE, DESIGN
from replication.estimation.dualrate.loop import close_loop, monodromy
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign, dual_rate_design, make_plant
from replication.verify.algebra.linear import identity
from replication.verify.dualrate import loop as dualrate_loop
from replication.verify.dualrate import loops as dualrate
from replication.verify.dualrate import lyapunov as dualrate_lyapunov
from replication.verify.dualrate import response as dualrate_response
from replication.verify.dualrate.loop import Loop, Observer
from replication.verify.theorem import Refused


def exact(values: Any) -> fmpq_mat:
    return fmpq_mat([[fmpq(*Fraction(float(entry)).as_integer_ratio()) for entry in row] for row in values])


def loop_of(design: DualRateDesign) -> Loop:
    model = design.model
    matrices = {"A": model.A, "B": model.B_u, "C": model.C, "K": design.feedback, "L": design.injection}
    period = fmpq(*Fraction(design.period).as_integer_ratio())
    return Loop(**{name: exact(value) for name, value in matrices.items()}, T=period, M=design.ratio)


def random_design(seed: int, ratio: int) -> DualRateDesign:
    rng = np.random.default_rng(seed)
    plant = make_plant(rng.normal(size=(2, 2)), rng.normal(size=(2, 1)), rng.normal(size=(1, 2)))
    gains = {"feedback": rng.normal(size=(1, 2)), "injection": rng.normal(size=(2, 1))}
    return dual_rate_design(plant, **gains, period=0.3, ratio=ratio)


def floats(M: arb_mat) -> np.ndarray:
    return np.array([[float(entry.mid()) for entry in row] for row in M.tolist()])


@pytest.mark.parametrize("observer", Observer)
@pytest.mark.parametrize("ratio", [1, 2, 4])
def test_monodromy_has_the_eigenvalues_of_the_loop_with_all_its_memory(observer: Observer, ratio: int) -> None:
    design = random_design(5, ratio)
    ours = floats(dualrate_loop.monodromy(loop_of(design), observer))
    theirs = monodromy(close_loop(design, OBSERVERS[observer]))
    for power in range(1, 5):  # the other eigenvalues of the larger matrix are zero
        traces = [float(np.trace(np.linalg.matrix_power(M, power))) for M in (ours, theirs)]
        assert traces[0] == pytest.approx(traces[1], rel=1e-9)


@pytest.mark.parametrize("ratio", [1, 2, 3, 5])
@pytest.mark.parametrize("period", [fmpq(1, 1000), fmpq(3, 10)])
def test_polynomial_of_the_scalar_loop_is_its_determinant(ratio: int, period: fmpq) -> None:
    scalar = loop_of(COUNTEREXAMPLE)
    loop = Loop(A=scalar.A, B=scalar.B, C=scalar.C, K=scalar.K, L=scalar.L, T=period, M=ratio)
    Phi = dualrate_loop.monodromy(loop, Observer.APO)
    determinant = (arb_mat(identity(2)) - Phi).det()
    growth = arb(period).exp()
    found = sum(arb(c) * (growth - 1) ** k for k, c in enumerate(dualrate_lyapunov.determinant(loop, ratio).coeffs()))
    assert determinant.overlaps(found / growth ** (2 * ratio))
    assert abs(determinant - found / growth ** (2 * ratio)) < arb("1e-12")


@pytest.mark.parametrize("name", ["A", "B", "C", "L"])
def test_polynomial_of_the_scalar_loop_is_for_that_loop_only(name: str) -> None:
    scalar = loop_of(COUNTEREXAMPLE)
    matrices = {entry: getattr(scalar, entry) for entry in "ABCKL"}
    other = Loop(**{**matrices, name: 3 * matrices[name]}, T=scalar.T, M=scalar.M)
    with pytest.raises(Refused, match="A = B = C = 1 and L = 2"):
        dualrate_lyapunov.determinant(other, 5)
    wide = loop_of(random_design(1, 5))
    with pytest.raises(Refused, match="A = B = C = 1 and L = 2"):
        dualrate_lyapunov.determinant(wide, 5)


@pytest.mark.parametrize(
    ("coefficients", "longest", "negative"),
    [
        ([0, 0, -1], 5, True),
        ([0, -2, 1], 1, True),  # h < 2, and e − 1 = 1.718
        ([0, -1.71875, 1], 1, True),
        ([0, -1.718, 1], 1, False),
        ([-2, 1, -5], 1, True),
        ([-1, 1, -5], 1, False),  # negative, but not by the argument
        ([0, 1], 1, False),
        ([0, -3, 1, 1], 1, False),
        ([0, -5, 1, 1], 1, True),
        ([1, -9], 1, False),
        ([], 1, False),
    ],
)
def test_a_polynomial_is_negative_if_its_lowest_coefficient_outweighs_the_rest(
    coefficients: Sequence[float], longest: int, negative: bool
) -> None:
    polynomial = fmpq_poly([fmpq(*Fraction(c).as_integer_ratio()) for c in coefficients])
    if negative:
        dualrate_lyapunov.require_negative(polynomial, fmpq(longest))
    else:
        with pytest.raises(Refused, match=r"not proved negative|vanishes for every period"):
            dualrate_lyapunov.require_negative(polynomial, fmpq(longest))


def lyapunov_of(loop: Loop) -> dualrate_lyapunov.Lyapunov:
    """P to floating point, with its eigenvalues as exact points."""
    joint = floats(arb_mat(dualrate_lyapunov.joint_matrix(loop)))
    P = scipy.linalg.solve_continuous_lyapunov(joint.T, -np.eye(len(joint)))
    P = (P + P.T) / 2
    values = np.linalg.eigvalsh(P)
    return dualrate_lyapunov.Lyapunov(P=exact(P), smallest=arb(values[0]), largest=arb(values[-1]))


def test_norms_are_those_of_rows_and_columns_only() -> None:
    assert dualrate_lyapunov.norm(fmpq_mat([[3, 4]])).contains(5)
    assert dualrate_lyapunov.norm(fmpq_mat([[3], [4]])).contains(5)
    with pytest.raises(Refused, match="row or a column"):
        dualrate_lyapunov.norm(fmpq_mat([[1, 0], [0, 1]]))


MOTOR = loop_of(DESIGN)


def test_excitation_is_the_coefficient_of_the_growing_mode() -> None:
    """C Φⁿ δ of the single-rate loop tends to c λⁿ/ψ(λ), where ψ(λ) is the product of λ less the other eigenvalues."""
    sigma, start = fmpq(3, 2), [fmpq(-1, 2), fmpq(1), fmpq(-1), fmpq(1, 3), fmpq(0), fmpq(2)]
    enclosed = dualrate_loop.monodromy(MOTOR, Observer.SRC)
    Phi = floats(enclosed)
    values = np.linalg.eigvals(Phi)
    root = max(values, key=abs)
    steady = dualrate_response.steady_start(MOTOR, Observer.SRC, acb(0, arb(sigma)))
    offset = np.array(
        [z - float(X.imag.mid()) for z, X in zip((int(z.p) / int(z.q) for z in start), steady, strict=True)]
    )
    growth = (np.linalg.matrix_power(Phi / abs(root), 60) @ offset)[0] / (root / abs(root)) ** 60
    others = np.prod([root - value for value in values if value != root])
    found = dualrate.excitation(MOTOR, Observer.SRC, sigma, acb(root.real, root.imag), start)
    assert complex(float(found.real.mid()), float(found.imag.mid())) == pytest.approx(growth * others, rel=1e-3)


@pytest.mark.parametrize("ratio", [2, 5])
def test_both_sides_of_the_prediction_bound_hold_what_a_simulation_gives(ratio: int) -> None:
    """V, simulated over two fast periods from one start, stays below the V of the bound; the gap is exact."""
    design = DualRateDesign(COUNTEREXAMPLE.model, COUNTEREXAMPLE.feedback, COUNTEREXAMPLE.injection, 0.05, ratio)
    loop = loop_of(design)
    lyapunov, start = lyapunov_of(loop), np.array([0.3, -1.0])
    P, alpha = theorem_constants(design).P, theorem_constants(design).alpha[2]
    gap, bound = dualrate_lyapunov.prediction_sides(loop, lyapunov, exact(start[:, None]), loop.T)
    assert gap.contains(arb(np.exp(0.05)) * arb("1.0"))
    assert gap.lower() > 0.9
    x, xi = start
    zeta, measured, energies = x - xi, x, []
    for _ in range(2):
        u, x0, zeta0 = -2 * zeta, x, zeta
        for time in np.linspace(0, 0.05, 21):
            growth = np.expm1(time)
            x = x0 + growth * (x0 + u)
            zeta = np.exp(-time) * zeta0 - np.expm1(-time) * (u + 2 * measured)
            chi = np.array([x, x - zeta])
            energies.append(chi @ P @ chi)
        measured = np.exp(0.05) * zeta0 + np.expm1(0.05) * u
    needed = alpha * 0.05 * np.sqrt(max(energies))
    assert needed <= float(bound.upper()) <= 2 * needed
    assert max(energies[21:]) > max(energies[:21])


@pytest.mark.parametrize(
    ("coefficients", "left", "right", "below"),
    [
        ([0], -1, 1, True),
        ([1], -1, 1, False),
        ([acb(0, -1)], -1, 1, False),
        ([0, 1], fmpq(-9, 10), fmpq(99, 100), True),
        ([0, 1], fmpq(-9, 10), fmpq(101, 100), False),
        ([0, acb(0, 1)], fmpq(-101, 100), fmpq(9, 10), False),
        ([acb(0, 1 - fmpq(1, 10**9)), 0, acb(0, -1)], -1, 1, True),
        ([1 + fmpq(1, 10**9), 0, -1], -1, 1, False),
        ([fmpq(1, 10), fmpq(35, 10), fmpq(-35, 10)], 0, 1, True),  # 0.975 in the middle
        ([fmpq(1, 10), fmpq(37, 10), fmpq(-37, 10)], 0, 1, False),
        ([fmpq(3, 5), acb(0, fmpq(79, 100))], -1, 1, True),
        ([fmpq(3, 5), acb(0, fmpq(81, 100))], -1, 1, False),
    ],
)
def test_moduli_below_one_on_an_interval(coefficients: Sequence[Any], left: Any, right: Any, below: bool) -> None:
    given = acb_poly(coefficients), arb(1), fmpq(left), fmpq(right)
    if below:
        dualrate_response.require_modulus_below(*given)
    else:
        with pytest.raises(Refused, match="not proved to be below"):
            dualrate_response.require_modulus_below(*given)


def growing() -> dualrate_response.Motion:
    """v' = v, error v: in these weights no bound of the norms is loose."""
    return dualrate_response.Motion(N=acb_mat([[1]]), row=acb_mat([[1]]), scales=[fmpq(3)])


@pytest.mark.parametrize(("terms", "count"), [(1, 1), (2, 1), (3, 2), (6, 4)])
def test_taylor_polynomials_and_their_remainders_enclose_the_error(terms: int, count: int) -> None:
    start, length = acb_mat([[2]]), fmpq(2)
    half = length / (2 * count)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dualrate_response, "TERMS", terms)
        patch.setattr(dualrate_response, "PIECES", count)
        found = list(dualrate_response.pieces(growing(), start, length))
    assert len(found) == count
    for k, ((polynomial, remainder),) in enumerate(found):
        assert len(polynomial.coeffs()) == terms
        middle, exact_gaps = (2 * k + 1) * half, []
        for part in range(-4, 5):
            time = half * part / 4
            value = dualrate_response.error_at(growing(), start, middle + time)
            exact_gaps.append(abs(value - polynomial(acb(time)).real))
        assert all(gap <= remainder for gap in exact_gaps)
        assert remainder < 4 * max(float(gap.mid()) for gap in exact_gaps)


def test_error_is_bounded_where_it_is_largest_and_no_lower() -> None:
    """2 e^t on [0, 2], with few terms too."""
    largest = 2 * float(np.exp(2))
    dualrate_response.require_errors_below(growing(), acb_mat([[2]]), fmpq(2), fmpq(int(largest * 1001) + 1, 1000))
    with pytest.raises(Refused, match="not proved to be below"):
        dualrate_response.require_errors_below(growing(), acb_mat([[2]]), fmpq(2), fmpq(int(largest * 999), 1000))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dualrate_response, "TERMS", 2)
        patch.setattr(dualrate_response, "PIECES", 1)
        with pytest.raises(Refused, match="remainder of the Taylor polynomial exceeds"):
            dualrate_response.require_errors_below(growing(), acb_mat([[2]]), fmpq(2), fmpq(7))


def test_a_peak_between_the_ends_of_a_piece_is_found() -> None:
    """cos(t - c) on [0, 2] with c in the middle of the first piece: below the bound at the ends of all pieces."""
    length = fmpq(2)
    half = length / (2 * dualrate_response.PIECES)
    swinging = dualrate_response.Motion(
        N=acb_mat([[acb(0, 1), 0], [0, acb(0, -1)]]), row=acb_mat([[fmpq(1, 2), fmpq(1, 2)]]), scales=[fmpq(1)] * 2
    )
    start = acb_mat([[acb(0, -arb(half)).exp()], [acb(0, arb(half)).exp()]])
    dualrate_response.require_errors_below(swinging, start, length, fmpq(10001, 10000))
    assert abs(dualrate_response.error_at(swinging, start, 2 * half)) < fmpq(9998, 10000)
    with pytest.raises(Refused, match="not proved to be below"):
        dualrate_response.require_errors_below(swinging, start, length, fmpq(9998, 10000))


def test_the_errors_are_compared_in_both_cases() -> None:
    with patch.object(dualrate_lyapunov, "require_errors") as required:
        dualrate_lyapunov.error_equations.prove()
        dualrate_lyapunov.second_case.prove()
    assert [call.kwargs["case_2"] for call in required.call_args_list] == [False, True, True]


def test_the_estimate_is_the_state_less_its_error() -> None:
    x, xi = 5, 3
    signals = {name: a * x + b * xi for name, (a, b) in dualrate_lyapunov.SIGNALS.items()}
    assert signals == {"x": 5, "zeta": 2}


def test_for_how_long_a_command_is_held() -> None:
    single, other = (Observer.SRC, Observer.SRC_SINGLE), (Observer.PMI, Observer.APO)
    assert [dualrate_loop.held_over(*observers) for observers in (single, other)] == ["M T", "T"]
    assert dualrate_loop.held_over(Observer.SRC, Observer.PMI) == "T, over M T in the single-rate loop"
    assert loop_of(random_design(1, 5)).data == "2 states, M = 5"


def test_a_loop_without_a_start_has_none() -> None:
    one = {"name": "own", **{name: [["1"]] for name in "ABCKL"}, "T": "1", "M": "2"}
    start = dualrate_loop.read_loop(one).start
    assert (start.nrows(), start.ncols()) == (0, 1)


# Certificates of the paper, altered, as those of plants of one's own.


@pytest.mark.parametrize("row", refused("dualrate"), ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("counterexample", put([100], "parameters", "ratios")),
        ("condition-scalar", put("1/600", "plant", "T")),
        ("feedforward", put([20, 1, 2], "parameters", "orders")),
    ],
)
def test_what_holds_no_longer_is_stated_so(name: str, change: Tamper) -> None:
    assert check_stated(own(f"shao/{name}", change)).holds is False


def growing_loop(*changes: Tamper) -> Certificate:
    """That of an error without bound, with the largest eigenvalue of the altered single-rate loop."""
    altered = own("shao/table-src-1", *changes)
    loop = dualrate_loop.read_loop({key: value for key, value in altered["plant"].items() if key != "start"})
    root = max(np.linalg.eigvals(floats(dualrate_loop.monodromy(loop, Observer.SRC))).astype(complex), key=abs)
    altered["witness"]["root"] = [str(Fraction(float(part))) for part in (root.real, root.imag)]
    return altered


def test_growth_is_proved_where_it_is_slow_and_seen() -> None:
    """By 1.352 in a period. Without feedback the estimate grows, by A − L C, and the plant does not follow it."""
    slow = put("1/10", "plant", "T"), put("3", "plant", "M"), put(["zero"], "parameters", "starts")
    assert check_stated(growing_loop(*slow)).holds
    with pytest.raises(Refused, match="not proved to be excited and seen"):
        check_stated(growing_loop(put([["0"] * 3], "plant", "K"), put([["-1"], ["0"], ["0"]], "plant", "L")))


def test_a_ratio_of_2000_is_allowed() -> None:
    assert dualrate_loop.read_loop({**committed("shao/stable-apo")["plant"], "M": "2000"}).M == 2000


def test_of_fewer_frequencies_the_last_one_is_said_again() -> None:
    place: Any = {"phase": 0, "time": fmpq(0), "scales": []}
    found = [dualrate_response.Error(fmpq(low), fmpq(low + 1), **place) for low in (1, 3)]
    most = range(dualrate_response.MOST)
    settings = [dualrate_response._setting(i, {"frequencies": ["1/2", "1"]}) for i in most]
    assert [setting["frequency"] for setting in settings] == ["1/2", *["1"] * (len(most) - 1)]
    bounds = [dualrate_response._bounds(i, {"errors": found}) for i in most]
    assert [bound.upper for bound in bounds] == [2, *[4] * (len(most) - 1)]
