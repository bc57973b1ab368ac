"""Identities of the delay paper in symbols: those that hold, and the misprints with which they do not."""

from __future__ import annotations

from unittest import mock

import pytest
from delay_cases import certificate

from replication.verify.algebra.symbolic import Symbolic, symbols, unit
from replication.verify.delay import identity as delay_identity
from replication.verify.delay import inverse as delay_inverse
from replication.verify.run import check
from replication.verify.theorem import Refused


def test_the_adjugate_times_the_matrix_is_the_determinant() -> None:
    for size in (1, 2):
        M = symbols({"M": (size, size)})["M"]
        adjugate, determinant = delay_inverse.adjugate(M)
        assert (adjugate @ M - unit(size, determinant)).vanishes()


@pytest.mark.slow
def test_the_dissipation_is_the_form_of_theorem_3_only_as_corrected() -> None:
    theorem = check(certificate("theorem-3-identity"))
    assert theorem.holds is True
    assert all(words in theorem.sentence for words in delay_identity.MISPRINTS.values())


def test_with_one_state_all_misprints_but_the_transposes_show() -> None:
    given = certificate("theorem-3-identity")
    with mock.patch.object(delay_identity, "STATES", 1):
        given["parameters"] = {"misprints": [name for name in delay_identity.MISPRINTS if name != "e-transposes"]}
        assert delay_identity.dissipation_identity(given).holds is True
        given["parameters"] = {"misprints": ["e-transposes"]}
        with pytest.raises(Refused, match="holds with the transposes in E_i as printed"):
            delay_identity.dissipation_identity(given)


def test_the_polynomials_of_a_case_hold_every_power_once() -> None:
    x = delay_identity.Case(1)
    m, s, t = x.m, x.s, x.t
    assert x.of_s("Q1") == m["Q10"] + m["Q11"] * s
    assert x.e(2) == m["e"] + m["e21"] * s + m["e22"] * (s * s)
    assert x.kernel("R12") == m["R1200"] + m["R1201"] * t + m["R1210"] * s + m["R1211"] * (s * t)
    assert x.R(2, 1) == x.swapped(x.R(1, 2)).T
    assert (delay_identity.STATES, delay_identity.DELAYS) == (2, (1, 2))


def test_the_output_is_that_of_the_delayed_history() -> None:
    x = delay_identity.Case(1)
    (e, C0, tau1, tau2), m = ((x.m[name].entry for name in ("e", "C0", "tau1", "tau2")), x.m)
    history = {i: (m[f"e{i}1"].entry, m[f"e{i}2"].entry) for i in (1, 2)}
    late = [e - slope * tau + bend * tau**2 for (slope, bend), tau in zip(history.values(), (tau1, tau2), strict=True)]
    assert delay_identity.output(x).entry == C0 * e + m["C1"].entry * late[0] + m["C2"].entry * late[1]


def test_each_misprint_is_what_is_printed() -> None:
    x = delay_identity.Case(1)
    m, last, delays = x.m, x.tau[2], delay_identity.DELAYS
    z, v = delay_identity.output(x), m["v"]
    names = ("theorem-1-sign", "eq10-factor", "d-sign", "f-sign")
    corrected, square, factor, ends, slopes = delay_identity.residuals(x, names)
    assert corrected.is_zero()
    assert square == ((z - v * x.gamma).T @ (z - v * x.gamma)).entry
    assert factor.subs({str(last): 1}).is_zero() and not factor.is_zero()
    late = [(x.put(x.e(i), s=-x.tau[i]), x.put(x.of_s(f"S{i}"), s=-x.tau[i])) for i in delays]
    assert ends == sum((e.T @ S @ e * (-2 * last)).entry for e, S in late)
    steep = [x.integral(x.e(i).T @ x.slope(x.of_s(f"S{i}")) @ x.e(i), i) for i in delays]
    assert slopes == sum((part * (-2 * last)).entry for part in steep)


def test_the_printed_transposes_are_those_of_the_blocks_of_e() -> None:
    x = delay_identity.Case(2)
    m, C2, last, Q = x.m, x.m["C_2"], x.tau[2], x.of_s("Q1")
    Z3, Z4, Z5 = (x.of_s(name) @ C2 for name in ("Z31", "Z41", "Z512"))
    at_now = [x.put(x.R(1, k), t=0 * x.s).T for k in (1, 2)]
    block = (m["A0"].T @ Q - x.slope(Q)) * last + at_now[0] + at_now[1]
    assert delay_identity._phi_0(x, 1, "") == block + (Z3 + Z4.T) * last
    assert delay_identity._phi_0(x, 1, "e-transposes") == (block + (Z4 + Z3.T) * last).T
    block = m["A2"].T @ Q * last - x.put(x.R(1, 2), t=-x.tau[2]).T
    assert delay_identity._phi(x, 1, 2, "") == block + Z5.T * last
    assert delay_identity._phi(x, 1, 2, "e-transposes") == (block + Z5 * last).T


def test_an_identity_that_fails_is_refused() -> None:
    given = certificate("theorem-3-identity")
    one = symbols({"g": (1, 1)})["g"].entry ** 0
    given["parameters"] = {"misprints": ["d-sign", "f-sign"]}
    for residuals, reason in (
        ((one, one, one), "the corrected identity fails"),
        ((one - one, one, one - one), "the identity holds with the derivative of S_i in F_i as printed"),
    ):
        patched = mock.patch.object(delay_identity, "residuals", lambda *_, found=residuals: iter(found))
        with patched, pytest.raises(Refused, match=reason):
            delay_identity.dissipation_identity(given)
    every = [*delay_identity.MISPRINTS]
    given["parameters"] = {"misprints": every}
    with mock.patch.object(delay_identity, "residuals", lambda *_: iter([one - one, *[one] * len(every)])):
        assert delay_identity.dissipation_identity(given).holds is True


def test_no_other_misprints_are_accepted() -> None:
    given = certificate("theorem-3-identity")
    for misprints, reason in (([], "must be among"), (["none"], "must be among"), (["d-sign"] * 2, "names one twice")):
        given["parameters"] = {"misprints": misprints}
        with pytest.raises(Refused, match=f"misprints {reason}"):
            delay_identity.dissipation_identity(given)


@pytest.mark.parametrize("part", delay_inverse.PARTS)
def test_inverse_and_gains_hold_only_as_corrected(part: str) -> None:
    theorem = check(certificate(part))
    assert theorem.holds is True
    sizes = {"theorem-4": "2, 2, 1; 1, 2, 3; 2, 2, 2", "lemma-5": "2, 4, 4"}
    assert f"(states, rows of Z, points): {sizes[part]}; as printed it does not, even so." in theorem.sentence


def test_a_part_that_fails_is_refused() -> None:
    g = symbols({"g": (1, 1)})["g"]
    words, _, cases = delay_inverse.PARTS["lemma-5"]
    failing = {"lemma-5": (words, lambda case, *, printed: [g], cases)}
    with mock.patch.dict(delay_inverse.PARTS, failing), pytest.raises(Refused, match="as corrected fails in row 0"):
        delay_inverse.operator_identity(certificate("lemma-5"))


def test_every_delay_of_a_case_has_its_points() -> None:
    for _, widths, delays in delay_inverse.SMALL:
        assert set(delays) == set(range(len(widths)))
    for _, widths, delays in delay_inverse.LARGE:
        assert [delays.count(delay) for delay in range(len(widths))] == [2, 2]


def test_only_a_correction_that_is_needed_is_accepted() -> None:
    g = symbols({"g": (1, 1)})["g"]
    zero = g - g
    delay_inverse.require_correction([zero, zero], [zero, g], "it")
    with pytest.raises(Refused, match="it as corrected fails in row 1"):
        delay_inverse.require_correction([zero, g], [g], "it")
    with pytest.raises(Refused, match="it holds as printed"):
        delay_inverse.require_correction([zero], [zero, zero], "it")


def test_no_other_part_is_accepted() -> None:
    given = certificate("theorem-4") | {"parameters": {"part": "theorem-5"}}
    with pytest.raises(Refused, match=r"parameters\.part must be one of"):
        delay_inverse.operator_identity(given)


def test_with_a_delay_of_one_the_inverse_holds_as_printed() -> None:
    case = (1, (1, 1), (0, 1))
    for residual in (
        *delay_inverse.inverse_residuals(case, printed=True),
        *delay_inverse.gain_residuals(case, printed=True),
    ):
        at_one = residual.each(lambda entry: entry.subs({"tau_0_0": 1}))
        assert at_one.vanishes() and not residual.vanishes()


def test_points_keep_the_rows_of_other_delays_at_zero() -> None:
    q = delay_inverse.points(2, (1, 2), (0, 1), {})
    zero = q.tau - q.tau
    assert q.Z[0].rows[1:] == ((zero, zero), (zero, zero))
    assert q.Z[1].rows[:1] == ((zero, zero),)
    assert q.Z[1].rows[1:] == q.m["Z1"].rows
    integral = q.total(lambda k: Symbolic(((q.tau,),)))
    assert integral.entry == q.tau * (q.weights[0] + q.weights[1])
