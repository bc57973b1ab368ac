"""Identities of the delay paper in letters: those that hold, and the misprints with which they do not."""

from collections.abc import Callable
from unittest import mock

import pytest
from flint import fmpq
from tampered import delayed as certificate

from replication.verify.algebra.symbolic import NONE, Words, letter, number, one
from replication.verify.delay import identity as delay_identity
from replication.verify.delay.identity import a, canonical
from replication.verify.run import check
from replication.verify.theorem import Refused

BOTH = range(1, 3)


def test_the_dissipation_is_the_form_of_theorem_3_only_as_corrected() -> None:
    theorem = check(certificate("theorem-3-identity"))
    assert theorem.holds is True
    assert "any number of states, signals and delays" in theorem.sentence
    assert all(words in theorem.sentence for words in delay_identity.MISPRINTS.values())
    for count in range(4):
        assert delay_identity.residual(range(1, count + 1), "").is_zero()


def test_a_number_is_its_transpose_and_variables_of_a_double_integral_may_be_exchanged() -> None:
    e, f, late = a("e1(s)"), a("e2(t)"), a("e1(-tau)")
    assert canonical(e.T * a("Q1(s)").T * late - late.T * a("Q1(s)") * e).is_zero()
    assert canonical(late.T * a("S1(0)") * late - (late.T * a("S1(0)") * late).T).is_zero()
    assert not canonical(late.T * a("Q1(0)") * a("e0") - a("e0").T * a("Q1(0)") * late).is_zero()
    other = a("e2(s)").T * a("R21_t(s,t)") * a("e1(t)")
    assert canonical(e.T * a("R12_s(s,t)") * f - other).is_zero()
    assert not canonical(e.T * a("R12_t(s,t)") * f - other).is_zero()
    swapped = a("e2(s)").T * a("C_2").T * a("Z712(s,t)").T * a("e1(t)")
    assert canonical(e.T * a("Z712(s,t)") * a("C_2") * f - swapped).is_zero()


def test_each_misprint_is_what_is_printed() -> None:
    tau, gamma = number("tau"), number("gamma")
    z, v = delay_identity.output(BOTH), a("v")
    square = delay_identity.residual(BOTH, "theorem-1-sign")
    assert (square - canonical((z - v * gamma).T * (z - v * gamma))).is_zero()
    late = [(a(f"e{i}(-tau)"), a(f"S{i}(-tau)")) for i in BOTH]
    ends = sum((e.T * S * e * tau * -2 for e, S in late), NONE)
    assert (delay_identity.residual(BOTH, "d-sign") - canonical(ends)).is_zero()
    steep = sum((a(f"e{i}(s)").T * a(f"S{i}_s(s)") * a(f"e{i}(s)") * tau * -2 for i in BOTH), NONE)
    assert (delay_identity.residual(BOTH, "f-sign") - canonical(steep)).is_zero()
    factor = delay_identity.residual(BOTH, "eq10-factor")
    assert all(("Z" in str(word)) for _, word in factor.terms)


def test_with_scalars_all_misprints_but_the_transposes_show() -> None:
    values = {name: fmpq(1, k + 2) for k, name in enumerate(sorted(_letters("e-transposes")))}
    assert delay_identity.residual(BOTH, "e-transposes").at(values) == 0
    # R_12(s, t) and R_21(t, s) are one number, and so are the two histories of a double integral.
    assert delay_identity.residual(BOTH, "d-sign").at(values | dict.fromkeys(_letters("d-sign"), fmpq(1))) != 0


def _letters(misprint: str) -> set[str]:
    found = delay_identity.residual(BOTH, misprint).terms
    return {name for numbers, word in found for name in (*numbers, *(name for name, _ in word))}


@pytest.mark.parametrize("count", range(delay_identity.MOST + 1))
def test_an_identity_that_fails_with_so_many_delays_alone_is_refused(count: int) -> None:
    with (
        mock.patch.object(delay_identity, "quadratic_form", only(range(1, count + 1))),
        pytest.raises(Refused, match=f"the corrected statement with {count} delays is no identity"),
    ):
        check(certificate("theorem-3-identity"))


def test_a_misprint_is_sought_with_two_delays() -> None:
    with mock.patch.object(delay_identity, "quadratic_form", only(BOTH, "f-sign")):
        delay_identity.require_identity(["f-sign"])


def only(where: range, misprint: str = "") -> Callable[[range, str], Words]:
    """The form without misprints, wrong with these delays and the misprint alone."""
    return lambda delays, given: RIGHT(delays, "") + a("P") * ((delays, given) == (where, misprint))


def test_the_output_of_the_error() -> None:
    """C_0 e_0 + C_1 e_1 + C_2 e_2 with late errors; it is one letter in the identities, which hold for any."""
    letters = ("C0", "e0", "C1", "e1(-tau)", "C2", "e2(-tau)")
    values = {name: fmpq(prime) for name, prime in zip(letters, (2, 3, 5, 7, 11, 13), strict=True)}
    assert delay_identity.output(BOTH).at(values) == 2 * 3 + 5 * 7 + 11 * 13
    assert delay_identity.output(range(1, 1)).at(values) == 2 * 3


def test_a_misprint_that_does_not_matter_is_refused() -> None:
    with (
        mock.patch.object(delay_identity, "quadratic_form", lambda delays, _: RIGHT(delays, "")),
        pytest.raises(Refused, match="the identity holds with the derivative of S_i in F_i as printed"),
    ):
        delay_identity.require_identity(["f-sign"])


RIGHT = delay_identity.quadratic_form


def test_no_other_misprints_are_accepted() -> None:
    given = certificate("theorem-3-identity")
    listed = given["parameters"]["misprints"]
    for misprints, reason in (
        ([], "must be all of"),
        (["none"], "must be all of"),
        # The sentence says that it holds if these are corrected.
        (listed[:-1], "must be all of"),
        ([*listed, "d-sign"], "names one twice"),
    ):
        given["parameters"] = {"misprints": misprints}
        with pytest.raises(Refused, match=f"misprints {reason}"):
            delay_identity.dissipation_identity(given)


def test_theorem_1_needs_a_self_adjoint_operator() -> None:
    delay_identity.require_self_adjoint(fmpq(1))
    with pytest.raises(Refused, match="may vanish"):
        delay_identity.require_self_adjoint(fmpq(0))  # P = I, with which the theorem holds
    # By Schur complements it holds if P P' = (1 + turn^2) I is below 3 I, while A is unstable for a turn above 1/2.
    delay_identity.require_self_adjoint(fmpq(7, 5))
    with pytest.raises(Refused, match="the inequality of Theorem 1"):
        delay_identity.require_self_adjoint(fmpq(3, 2))


@pytest.mark.parametrize("part", delay_identity.PARTS)
def test_inverse_and_gains_hold_only_as_corrected(part: str) -> None:
    theorem = check(certificate(part))
    assert theorem.holds is True
    assert "for any number of states, measurements and delays; as printed it does not" in theorem.sentence
    residuals = delay_identity.PARTS[part][1]
    assert [residual.reduced(delay_identity.rules()).is_zero() for residual in residuals(printed=False)] == [True] * 2


def test_each_rule_is_needed_for_the_inverse_and_true_of_numbers() -> None:
    at = delay_identity.example()
    at |= {"X": 1 / (1 + at["K"] * at["G"]), "W": 1 / (at["K"] * at["H"] ** 2 / at["P"] - 1 - at["K"] * at["G"])}
    rules = delay_identity.rules()
    for left, right in rules.items():
        assert Words({((), left): fmpq(1)}).at(at) == right.at(at)
    for left in [left for left in rules if left != delay_identity.word("P Pi")]:
        fewer = {word: right for word, right in rules.items() if word != left}
        assert not all(one.reduced(fewer).is_zero() for one in delay_identity.inverse_residuals(printed=False))


def test_the_example_is_one_of_constant_functions_with_the_inverses_as_printed() -> None:
    at = delay_identity.example()
    tau, Gamma, image = at["tau"], at["tau"] * at["G"], at["Z"] * at["V"]
    assert (at["K"], at["seen"]) == (tau * image * at["Z"], tau * image * at["chi"])
    assert (at["I_3"], at["I_6"], at["I_7"]) == (tau * at["y"], tau * image * at["W_6"] * at["y"], tau * at["y"])
    assert at["Pi"] * at["P"] == at["X"] * (1 + at["K"] * Gamma) == 1
    assert at["W"] * (at["K"] * at["H"] * at["Pi"] * at["H"] - 1 - at["K"] * Gamma) == 1


def test_the_inverses_of_the_example_are_those_of_its_numbers() -> None:
    with mock.patch.dict(delay_identity.EXAMPLE, {"K": 3, "G": 5, "tau": 7}):
        at = delay_identity.example()
    assert at["X"] * (1 + 3 * 7 * 5) == 1
    assert at["W"] * (3 * at["H"] * at["Pi"] * at["H"] - 1 - 3 * 7 * 5) == 1


def test_with_a_delay_of_one_the_inverse_holds_as_printed() -> None:
    at = delay_identity.example() | {"tau": fmpq(1)}
    at |= {"X": 1 / (1 + at["K"] * at["G"]), "W": 1 / (at["K"] * at["H"] ** 2 / at["P"] - 1 - at["K"] * at["G"])}
    for _, residuals in delay_identity.PARTS.values():
        assert [residual.at(at) for residual in residuals(printed=True)] == [0, 0]


def test_only_a_correction_that_is_needed_is_accepted() -> None:
    g, at = letter("g"), {"g": fmpq(2)}
    zero = g - g
    delay_identity.require_correction([zero, zero], [zero, g], at, "it")
    with pytest.raises(Refused, match="row 1 of it as corrected is no identity"):
        delay_identity.require_correction([zero, g], [g], at, "it")
    with pytest.raises(Refused, match="it holds as printed"):
        delay_identity.require_correction([zero], [zero, g - one() * 2], at, "it")
