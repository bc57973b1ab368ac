"""Multi-rate statements: the verifier proves what was made, refuses what was tampered with, and computes exactly."""

import json
from fractions import Fraction
from typing import Any
from unittest.mock import patch

import pytest
from byhand import own as theorem_of
from byhand import phased
from flint import fmpq, fmpq_mat
from tampered import Altered, Certificate, own, refused
from tampered import check_stated as check

from replication.certify.own import certificate
from replication.errors import InvalidInputError
from replication.estimation.multirate import MultiratePlant, design, losses
from replication.verify.algebra.linear import identity
from replication.verify.multirate.recovered import reading_of
from replication.verify.multirate.sensing import (
    Sensing,
    attained,
    recurrent,
    require_turn,
    schedule,
    unseen_for_long,
    unseen_forever,
)
from replication.verify.theorem import Refused, Theorem


def third_sensor(certificate: Certificate) -> None:
    """One without a gain, and shorter periods of which two pairs of three have no common factor."""
    certificate["parameters"] = {"sensors": [0, 1, 2], "shorter": [2, 3, 4], "longer": [6, 6, 6]}
    certificate["plant"]["C"].append(["0", "0", "1"])
    certificate["plant"]["D"] = [[*row, "0"] for row in certificate["plant"]["D"]] + [["0", "0", "1"]]
    for gain in certificate["witness"]["Y"]:
        for row in gain:
            row.append("0")


@pytest.mark.parametrize("row", refused("multirate") + refused("multirate_losses"), ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


def test_of_three_periods_each_two_are_compared() -> None:
    with pytest.raises(Refused, match=r"\[2, 3, 4\] have a common factor"):
        check(own("okajima2023/shorter-periods", third_sensor))


def q(number: Any) -> fmpq:
    fraction = Fraction(number)
    return fmpq(fraction.numerator, fraction.denominator)


def column(*entries: Any) -> fmpq_mat:
    return fmpq_mat(len(entries), 1, [q(entry) for entry in entries])


def row(*entries: Any) -> fmpq_mat:
    return column(*entries).transpose()


ONE = column(1)


def test_resonance_and_instability_have_no_ratio() -> None:
    with pytest.raises(Refused, match="resonance"):
        recurrent(ONE, ONE, ONE)
    with pytest.raises(Refused, match="the poles of the error system are not proved to lie inside"):
        attained([row(1, 1)], ONE, ONE, [ONE])
    with pytest.raises(Refused, match="the poles of the plant are not proved to lie inside"):
        unseen_forever(sensor(ONE), ONE, [ONE])
    with pytest.raises(Refused, match="of order 1 or 2"):
        require_turn(identity(3))
    require_turn(identity(2))


def sensor(A: fmpq_mat, measured: list[list[int]] | None = None) -> Sensing:
    """One state, disturbed by d, measured with noise 2 w; W = 3."""
    return Sensing(A, ONE, column(3), ONE, column(2), measured or [[0]])


def test_what_no_sensor_shows_forever_is_exact() -> None:
    # x = 2 at z = 1, z = 6, w = -1: 36 / (1 + 1).
    assert unseen_forever(sensor(column("1/2")), ONE, [ONE]) == 18
    # Two phases, measured at the second only: x = 2 at both, w = 0 and -1.
    assert unseen_forever(sensor(column("1/2"), [[], [0]]), ONE, [ONE, ONE]) == q("72/3")
    # d = 1, 0: x_0 = 2/3 (from x_1 / 2) and x_1 = 4/3; measured at the first, w = -1/3.
    assert unseen_forever(sensor(column("1/2"), [[0], []]), ONE, [ONE, column(0)]) == 20 / q("10/9")


def test_what_no_sensor_shows_for_long_is_exact() -> None:
    # From x = 0 with d = 1, 2 and A = 2: x = 1, 4 with z = 3, 12; w = 0 and -1/2.
    plant = sensor(column(2))
    assert unseen_for_long(plant, 0, [ONE, column(2)]) == 153 / q("21/4")
    # Measured at every second phase: with the start at 1 the second instant is measured, with 0 it is not.
    slow = sensor(column(2), [[0], []])
    assert unseen_for_long(slow, 1, [ONE, column(2)]) == 153 / q("21/4")
    assert unseen_for_long(slow, 0, [ONE, column(2)]) == q("153/5")
    third = sensor(column(2), [[], [], [0]])
    assert unseen_for_long(third, 1, [ONE, column(2)]) == 153 / q("21/4")
    assert unseen_for_long(third, 2, [ONE, column(2)]) == q("153/5")
    with pytest.raises(Refused, match="the disturbance is zero"):
        unseen_for_long(plant, 0, [column(0)])


def test_the_smallest_concealing_noise() -> None:
    wide = Sensing(identity(1), ONE, ONE, ONE, row(1, 2), [[0]])
    assert wide.concealing(0, ONE) == column("-1/5", "-2/5")


def test_schedules() -> None:
    assert schedule([2, 3], [0, 0]) == [[0, 1], [], [0], [1], [0], []]
    assert schedule([3, 3], [0, 2]) == [[0], [], [1]]
    assert schedule([1], [5]) == [[0]]
    assert len(schedule([1000], [0])) == 1000
    with pytest.raises(Refused, match="repeats after more than 1000 instants"):
        schedule([1001], [0])
    assert len(schedule([1000, *[1] * 39], [0] * 40)) == 1000
    with pytest.raises(Refused, match="1000 instants x 41 sensors, more than 40000"):
        schedule([1000, *[1] * 40], [0] * 41)
    with pytest.raises(Refused, match="names no sensor"):
        schedule([], [])
    with pytest.raises(Refused, match="repeats after more than 1000 instants"):
        schedule(list(range(10**8, 10**8 + 2000)), [0] * 2000)


def computed(statement: str, parameters: dict[str, Any], plant: dict[str, Any] | None = None) -> Any:
    return check(
        theorem_of(f"multirate.{statement}", plant=plant or {"name": ""}, parameters=parameters, bound={}, witness={})
    )


def times(*periods: int) -> dict[str, Any]:
    return {"periods": list(periods), "offsets": [0] * len(periods)}


def test_counts() -> None:
    assert computed("common-period", times(4, 6)).lower == 12
    assert computed("common-period", times(1)).lower == 1
    assert computed("idle-instants", times(4, 6)).upper == 3
    # The longest wait runs over the end of the period.
    assert computed("idle-instants", {"periods": [5], "offsets": [2]}).upper == 4
    assert computed("idle-instants", {"periods": [2], "offsets": [1]}).upper == 1
    assert computed("idle-instants", {"periods": [2], "offsets": [1]}).sentence.endswith(" is 1 instant.")
    assert computed("idle-instants", times(1, 2)).lower == 0
    assert computed("dual-rate", times(2, 2)).holds
    assert computed("dual-rate", times(2, 2)).sentence.startswith("All sensors")
    assert computed("dual-rate", times(2, 4)).sentence.startswith("It is not so that all sensors")
    assert computed("dual-rate", times(2, 4)).holds is False
    for counting in ("dual-rate", "idle-instants", "common-period", "selection"):
        with pytest.raises(Refused, match="names no sensor"):
            computed(counting, times())
    assert not computed("dual-rate", {"periods": [2, 2], "offsets": [0, 1]}).holds
    assert not computed("dual-rate", {"periods": [2], "offsets": [1]}).holds
    plant = {"name": "", "A": [["0", "1"], ["0", "0"]], "B_d": [["1", "0", "0"]] * 2, "D": [["1"]], "C": [["1", "0"]]}
    assert computed("variables", times(2), plant).upper == 2 * 3 + 2 * 2 + 1
    assert computed("rows", times(2), plant).upper == 2 + 2 + 3 + 1
    assert computed("cyclic-rows", times(2), plant).upper == 2 * (2 + 2 + 3 + 1)
    noisy = {**plant, "D": [["1", "2"]]}
    assert computed("cyclic-rows", times(2), noisy).upper == 2 * (2 + 2 + 3 + 2)
    assert computed("variables", times(2), noisy).upper == 2 * 3 + 2 * 2 + 1
    for counting in ("cyclic-rows", "variables"):
        with pytest.raises(Refused, match="must have one for each sensor"):
            computed(counting, times(2, 2), noisy)
    larger = {"name": "", "A": [["0"] * 3] * 3, "B_d": [["1"]] * 3, "D": [["1"]], "C": [["1"] * 3]}
    assert computed("rows", times(2), larger).upper == 3 + 3 + 1 + 1
    assert computed("observable", times(2), plant).holds
    assert not computed("observable", times(2), {**plant, "C": [["0", "1"]]}).holds
    assert [str(low) for low, high in computed("selection", times(1, 2)).items if low == high] == ["1", "1", "1", "0"]


def section_4c(statement: str, printed: list[list[str]], poles: list[list[str]], **more: Any) -> Theorem:
    """One sensor C and one phase; the gain is L."""
    plant = {"name": "", "A": printed, "C": [["1", "0"]], "L": [more.pop("L", [["0"], ["0"]])]}
    plant |= {"poles": poles, "half_unit": more.pop("half_unit", "1/8"), "error_poles": ["0", "1/4"]}
    proof = {name: more.pop(name, {}) for name in ("bound", "witness")}
    return check(theorem_of(f"multirate.{statement}", plant=plant, parameters={**times(1), **more}, **proof))


DIAGONAL = [["9", "0"], ["0", "9"]]


def test_poles_are_matched_with_the_stated_ones() -> None:
    theorem = section_4c("recovered-poles", DIAGONAL, [["1/2", "0"], ["2", "0"]], diagonal=["2", "1/2"])
    assert theorem.items == ((q("1/2"), q("1/2")), (q(2), q(2)))
    pair = section_4c("recovered-poles", [["9", "2"], ["-2", "9"]], [["1", "2"]], diagonal=["1", "1"])
    assert [low <= value <= high for (low, high), value in zip(pair.items, (1, 2), strict=True)] == [True, True]
    # Half a unit away is near enough, and no more.
    section_4c("recovered-poles", DIAGONAL, [["2", "0"], ["5/8", "0"]], diagonal=["2", "1/2"])
    for poles in ([["2", "0"], ["51/80", "0"]], [["2", "0"], ["2", "0"]], [["2", "1"], ["1/2", "0"]]):
        with pytest.raises(Refused, match="A has not the stated pole"):
            section_4c("recovered-poles", DIAGONAL, poles, diagonal=["2", "1/2"])
    for one in ("1", "-1", "1/2"):
        with pytest.raises(Refused, match="no pole of A is proved to be outside"):
            section_4c("recovered-poles", DIAGONAL, [[one, "0"], ["0", "0"]], diagonal=[one, "0"])


def test_a_design_is_for_an_unstable_plant_and_error_poles_are_real() -> None:
    proof = {"bound": {"upper": "9"}, "witness": {"P": [[["1", "0"], ["0", "1"]]], "Y": [[["0"], ["0"]]]}}
    given = {"A": [["1/2", "0"], ["0", "0"]], "B_d": [["1"], ["1"]], "D": [["1"]], **proof}
    with pytest.raises(Refused, match="no pole of A is proved to be outside"):
        section_4c("stated-design", DIAGONAL, [["1/2", "0"], ["0", "0"]], **given)
    stated, coupled = [["1/2", "0"], ["2", "0"]], [["9", "1"], ["0", "9"]]
    with pytest.raises(Refused, match="the poles of A_e are not all real"):
        section_4c("recovered-error-poles", coupled, stated, diagonal=["2", "1/2"], C=[["1", "0"]], L=[["2"], ["4"]])


def test_gains_that_leave_an_unstable_pole() -> None:
    stated = [["1/2", "0"], ["2", "0"]]
    theorem = section_4c("same-setting", DIAGONAL, stated, diagonal=["2", "1/2"], L=[["1/2"], ["0"]])
    assert theorem.holds is False and "1.5" in theorem.sentence
    for gain in ("1", "3", "7/4"):
        with pytest.raises(Refused, match="no pole of A_e is proved to be outside"):
            section_4c("same-setting", DIAGONAL, stated, diagonal=["2", "1/2"], L=[[gain], ["0"]])
    with pytest.raises(Refused, match="no pole of A_e is proved to be outside"):
        section_4c("same-setting", DIAGONAL, [["2", "0"], ["0", "0"]], diagonal=["2", "0"], L=[["1"], ["0"]])


def test_a_column_is_zero_if_all_of_it_is() -> None:
    plant = {"name": "", "A": [["1", "0"], ["0", "1"]], "L": [[["1"], ["2"]], [["0"], ["3"]]]}
    assert computed("unmeasured", times(2), plant).holds is False


def test_the_order_of_the_product_matters_unless_the_factors_commute() -> None:
    plant = {"name": "", "A": [["1", "1"], ["0", "1"]], "C": [["1", "0"], ["0", "1"]]}
    gains = [[["1", "2"], ["0", "1"]], [["0", "1"], ["1", "0"]], [["2", "0"], ["1", "1"]]]
    commuting = computed("product", {"periods": [1, 1], "offsets": [0, 0]}, {**plant, "L": gains[:1]})
    assert commuting.holds is False and commuting.sentence.endswith("in the other order it has the same one.")
    theorem = computed("product", {"periods": [1, 3], "offsets": [0, 1]}, {**plant, "L": gains})
    assert theorem.holds and theorem.sentence.endswith("in the other order it has another one.")
    assert "has the same characteristic polynomial" in theorem.sentence
    with pytest.raises(Refused, match="C must have a row for each period"):
        computed(
            "product", {"periods": [1, 3], "offsets": [0, 1]}, {**plant, "C": [*plant["C"], ["1", "1"]], "L": gains}
        )


def test_one_longer_entry_makes_it_the_other_diagonal() -> None:
    assert reading_of({"diagonal": ["6/5", "1/3", "1"]}) == ("the other real diagonal",)


# Gains under losses.


DRIFT = MultiratePlant(A=[[1.05]], B_d=[[0.2]], C=[[1]], D=[[0.1]])
"""It is unstable, and seen by one sensor."""


def small(model: losses.InARow) -> Certificate:
    """Of a plant with one state, which is soon checked."""
    best = design(DRIFT, periods=(2,))
    return json.loads(json.dumps(certificate(losses.design(best, model), "drift")))


def test_an_unstable_plant_under_losses() -> None:
    theorem = check(small(losses.InARow(1)))
    lower, upper = (Fraction(str(end)) for end in (theorem.lower, theorem.upper))
    assert lower < upper < lower * Fraction(101, 100)
    assert "at most [1] samples of each sensor in a row" in theorem.sentence
    assert "at most [1] packets in a row" in check(small(losses.InARow(1, together=True))).sentence


def test_what_no_statement_fits_says_so() -> None:
    best = design(DRIFT, periods=(2,))
    with pytest.raises(InvalidInputError, match="no statement on mean errors"):
        certificate(losses.analyse(best, losses.Independent(0.1)))


def test_there_are_as_many_cases_as_are_allowed_and_no_more() -> None:
    one = own("okajima2023/lost-samples-2-3")
    count = len(one["witness"]["L"])
    with patch("replication.verify.multirate.levels.MOST_CASES", count):
        check(one)
    with patch("replication.verify.multirate.levels.MOST_CASES", count - 1), pytest.raises(Refused, match="more than"):
        check(one)
    one["parameters"] |= {"periods": [16, 17], "misses": [6, 6]}
    with pytest.raises(Refused, match="more than 2000 cases"):
        check(one)


def test_the_cases_follow_the_schedule() -> None:
    assert check(phased()).holds
