"""Certificates of the dual-rate loops: all that are committed prove their theorem, and each way to cheat is told."""

from fractions import Fraction
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import tampered
from flint import fmpq

from replication.verify.dualrate import lyapunov, response
from replication.verify.dualrate import theory as identities
from replication.verify.dualrate.loop import Observer, monodromy, read_loop
from replication.verify.run import STATEMENTS, check
from replication.verify.subjects import theorems
from replication.verify.theorem import Refused, Theorem

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "certificates" / "shao"
WANTED = theorems("shao")[0]


def committed(name: str) -> dict[str, Any]:
    return tampered.committed(f"shao/{name}")


def own(name: str, **changes: Any) -> dict[str, Any]:
    """The same certificate about a plant of one's own, with the values at paths such as `witness__root__0` changed."""
    tampers = []
    for path, value in changes.items():
        way = [int(step) if step.isdecimal() else step for step in path.split("__")]
        tampers.append(tampered.remove(*way) if value is GONE else tampered.put(value, *way))
    return tampered.own(f"shao/{name}", *tampers)


@cache
def proved(name: str) -> Theorem:
    return check(committed(name))


GONE = object()
FALSE = ("condition", "counterexample", "feedforward-printed", "prediction-bound", "prediction-bound-scalar")


SAID = {
    "condition": ("1123960",),
    "condition-scalar": ("0.63678",),
    "counterexample": ("0.00157039",),
    "errors-pmi": ("held over T, the largest", "27.0928"),
    "estimate-2": ("4.4032 to 4.4033 percent",),
    "estimate-bound": ("with the factors 2 of ‖KÂ‖, 2 of ‖KBK‖, 1 of ‖KLC‖",),
    "lyapunov": ("For the printed data of the plant motor ",),
    "output-bounds": ("with the factors 1 of ‖CA‖, 2 of ‖CBK‖",),
    "prediction-bound": ("0.5605",),
    "radius-motor-apo": ("0.9173784",),
    "radius-motor-src": ("5.5501544",),
    "stable-apo": ("0.9173787",),
    "table-src-1": ("modulus 5.550 or more", "held over M T"),
}
"""Parts of sentences."""
READINGS = {
    # Other readings of DRC-PMI leave DRC-APO as it is.
    "errors-apo": ("literal", "pmi-held", "pmi-one-correction", "pmi-slow-input"),
    "errors-pmi": ("literal",),
    "errors-pmi-fast-instants": ("fast-instants",),
    "errors-pmi-held": ("pmi-held",),
    "radius-motor-slow-input": ("pmi-slow-input",),
}
"""Under which the first export of a theorem holds."""


def stated(certificate: dict[str, Any]) -> Theorem:
    """What the mathematics proves, in the words of the paper even where those are for its certificates only."""
    statement = STATEMENTS[certificate["statement"]]
    return statement({**certificate, "paper": statement.source or None})


def test_the_tables_name_theorems() -> None:
    assert SAID.keys() | READINGS.keys() <= WANTED.keys()


@pytest.mark.parametrize("name", WANTED)
def test_every_wanted_theorem_is_proved(name: str) -> None:
    certificate, theorem = committed(name), proved(name)
    assert theorem.sentence.endswith(".")
    assert [words for words in SAID.get(name, ()) if words not in theorem.sentence] == []
    assert name not in READINGS or theorem.says[0].readings == READINGS[name]
    unasked = bool(certificate["bound"]) or name.startswith("errors-")
    assert theorem.holds is (None if unasked else name not in FALSE)
    assert {side: str(getattr(theorem, side)) for side in certificate["bound"]} == certificate["bound"]


@pytest.mark.parametrize("name", [name for name in WANTED if committed(name)["bound"]])
def test_a_bound_moved_by_a_hundred_thousandth_is_refused(name: str) -> None:
    for side, sign in (("lower", 1), ("upper", -1)):
        moved = Fraction(committed(name)["bound"][side]) * (1 + sign * Fraction(1, 100_000))
        with pytest.raises(Refused, match=r"not proved|not as large|bound that is proved"):
            check(own(name, **{f"bound__{side}": str(moved)}))


@pytest.mark.parametrize("name", WANTED)
def test_a_certificate_of_another_subject_is_refused(name: str) -> None:
    for field in ("claims", "plant", "parameters", "statement"):
        certificate = committed(name)
        certificate[field] = {"claims": ["shao.other"], "plant": {"name": "x"}, "parameters": {"x": 1}}.get(field, "x")
        with pytest.raises(Refused, match=f"{field} is not that of the wanted theorem"):
            check(certificate)


ALONE = {
    "errors-apo": {
        "parameters__frequencies": ["1/2"],
        "witness__errors": committed("errors-apo")["witness"]["errors"][:1],
    }
}
"""One frequency of several."""
UNBOUNDED = """lyapunov estimate-bound prediction-bound condition counterexample hurwitz-observer coordinates
    feedforward contraction discrete-observer second-case estimate-2 errors-apo stable-apo table-src-1"""
PLAIN = "lyapunov condition contraction coordinates torque-constant slow-period discrete-observer"
UNWITNESSED = """estimate-bound discrete-observer torque-constant slow-period feedforward estimate-3 hurwitz-feedback
    coordinates error-equations contraction"""
"""Those without bounds, without parameters, with a witness that is empty or has other fields."""
CHEATS = [
    ("radius-motor-apo", {"witness__root__0": "1/2"}, "eigenvalue is not proved to be at least"),
    ("radius-motor-apo", {"witness__root__1": "1"}, "eigenvalue is not proved to be at least"),
    ("radius-motor-apo", {"parameters__observer": "fast_sensor"}, "not proved"),
    ("radius-motor-apo", {"parameters__observer": "luenberger"}, "parameters.observer must be one of"),
    ("radius-motor-apo", {"bound__lower": GONE}, "bound lacks the field lower"),
    ("radius-motor-apo", {"plant__A__1": ["0", "1"]}, "plant.A must have rows of one length"),
    ("radius-motor-apo", {"plant__A": [["1", "2"]]}, "plant.A must be square"),
    ("radius-motor-apo", {"plant__M": "5/2"}, "plant.M must be whole"),
    ("radius-motor-apo", {"plant__M": "2001"}, "plant.M must be whole and at most 2000"),
    ("radius-motor-apo", {"plant__T": "0"}, "plant.T must be positive"),
    ("radius-motor-apo", {"plant__T": "1/10"}, "not proved"),
    ("stable-apo", {"witness__radius": "9/10"}, "eigenvalues of Φ are not proved to lie inside"),
    ("stable-apo", {"witness__radius": "1"}, "witness.radius must be below one"),
    ("stable-apo", {"parameters__observer": "single_rate"}, "eigenvalues of Φ are not proved to lie inside"),
    ("table-src-1", {"witness__root": ["0", "0"]}, "not proved to lie outside the unit circle"),
    ("table-src-1", {"parameters__observer": "model_interpolation"}, "not proved to lie outside the unit circle"),
    ("table-src-1", {"plant__start": [["0"], ["0"]]}, "plant.start must have 3 entries"),
    ("table-src-1", {"plant__start": GONE}, "plant lacks the field start"),
    ("table-src-1", {"parameters__frequency": "-1"}, "parameters.frequency must be positive"),
    ("errors-apo", {"witness__errors__0__time": "1/10"}, "the error at the given time is not as large"),
    *(
        (
            name,
            {f"parameters__{key}": "single_rate", "plant__T": "1/10", "plant__M": "3", **ALONE.get(name, {})},
            "eigenvalues of Φ are not proved to lie inside the circle of radius 1$",
        )
        for name, key in (("errors-apo", "observer"), ("estimate-2", "than"))  # of radius 1.352
    ),
    ("errors-apo", {"witness__errors__0__time": "0"}, "the error at the given time is not as large"),
    ("errors-apo", {"witness__errors__0__time": "1/5"}, "the error at the given time is not as large"),
    ("errors-apo", {"parameters__frequencies__0": "1" + "0" * 900}, "may excite an eigenvalue of Φ on the unit circle"),
    ("errors-apo", {"plant__M": "100"}, "the error at the given time is not as large"),
    ("counterexample", {"parameters__ratios": [100]}, None),
    ("errors-apo", {"witness__errors__0__phase": 3}, "the error at the given time is not as large"),
    ("errors-apo", {"witness__errors__0__phase": 5}, "lies outside the slow period"),
    ("errors-apo", {"witness__errors__0__time": "1/4"}, "lies outside the slow period"),
    ("errors-apo", {"witness__errors__0__time": "-1/100"}, "lies outside the slow period"),
    ("errors-apo", {"witness__errors__0__scales__0": "0"}, "scales.0. must be positive"),
    ("errors-apo", {"witness__errors__0__scales": ["1"] * 5}, "choose other scales"),
    ("errors-apo", {"witness__errors__0__scales": ["1"] * 4}, "must have 5 entries"),
    ("errors-apo", {"parameters__observer": "model_interpolation"}, "not proved to be below the bound"),
    ("errors-pmi", {"parameters__observer": "alternating_predictive"}, "not as large"),
    ("errors-apo", {"parameters__observer": "single_rate"}, "eigenvalues of Φ are not proved to lie inside"),
    ("errors-apo", {"parameters__frequencies__0": "1"}, "not proved to be below the bound"),
    (
        "errors-apo",
        {
            "plant__A": [["-1"]],
            "plant__B": [["1"]],
            "plant__C": [["1"]],
            "plant__K": [["0"]],
            "plant__L": [["1"]],
            **ALONE["errors-apo"],
            "witness__errors__0__scales": ["1"] * 3,
        },
        "plant of order 3, not 1",
    ),
    *(
        ("errors-apo", {f"plant__{entry}": value}, "position, speed and acceleration")
        for entry, value in {"A__0__1": "2", "A__2__0": "1", "B__0__0": "1", "B__2__0": "0", "C__0__1": "1"}.items()
    ),
    ("errors-apo", {"witness__errors__5__upper": "15"}, "largest error is not proved to be below the bound"),
    ("errors-apo", {"witness__errors__5__lower": "16"}, "not as large, σ = 3"),
    ("errors-apo", {"witness__errors__0": {}}, "lacks the field lower"),
    ("errors-apo", {"parameters__frequencies": []}, "parameters.frequencies is empty"),
    ("errors-apo", {"parameters__frequencies": ["1"] * 7}, "parameters.frequencies has more than 6 entries"),
    ("errors-apo", {"parameters__frequencies": ["1"] * 5}, "witness.errors must have 5 entries"),
    ("errors-apo", {"parameters__feedforward": "corrected"}, "not as large"),
    ("errors-apo", {"parameters__feedforward": "none"}, "must be one of printed, corrected"),
    ("errors-apo", {"parameters__instants": "slow"}, "must be one of all, fast"),
    ("errors-apo", {"parameters__instants": "fast"}, "the given time is not that of a fast instant"),
    ("errors-apo-fast-instants", {"parameters__instants": "all"}, "not proved to be below the bound"),
    ("errors-apo-fast-instants", {"witness__errors__0__upper": "47/10"}, "the largest error is above the bound"),
    ("errors-apo-fast-instants", {"witness__errors__0__lower": "471/100"}, "not as large"),
    ("errors-pmi-held", {"parameters__observer": "model_interpolation"}, "not proved to be below the bound"),
    ("errors-pmi-one-correction", {"parameters__observer": "held_measurement"}, "not proved to be below the bound"),
    ("errors-pmi", {"parameters__observer": "single_correction"}, "not as large"),
    ("table-src-1", {"parameters__starts": []}, "parameters.starts is empty"),
    ("table-src-1", {"parameters__starts": ["zero", "zero"]}, "each once"),
    ("table-src-1", {"parameters__starts": ["half"]}, "must be some of zero, output, true"),
    ("lyapunov", {"witness__P__0__0": "6549"}, "P does not solve the Lyapunov equation"),
    ("lyapunov", {"witness__P__0__1": "0"}, "witness.P must be symmetric"),
    ("lyapunov", {"plant__K__0__0": "20"}, "P does not solve the Lyapunov equation"),
    ("condition", {"witness__lyapunov__low": "1/100"}, "P − low I is not positive definite"),
    ("condition", {"witness__lyapunov__high": "13256"}, "high I − P is not positive definite"),
    ("condition", {"witness__lyapunov__low": "0"}, "witness.lyapunov.low must be positive"),
    ("condition", {"witness__lyapunov__least": [["0"]] * 6}, "a vector of the witness is zero"),
    ("condition-scalar", {"plant__T": "1/600"}, None),
    ("condition-scalar", {"witness__lyapunov__low": "1/10", "witness__lyapunov__high": "2"}, "not decided"),
    ("prediction-bound", {"parameters__longest": "1/10"}, "not proved to fail for all periods"),
    ("prediction-bound", {"witness__chi": [["1"], *[["0"]] * 5]}, "not proved to fail for all periods"),
    ("prediction-bound", {"plant__M": "1"}, "no virtual measurement"),
    ("counterexample", {"parameters__longest": "1/1000"}, "may allow periods above 1/1000 s"),
    ("counterexample", {"parameters__longest": "1"}, "not proved negative for all periods up to 1 s"),
    ("counterexample", {"parameters__ratios": []}, "parameters.ratios is empty"),
    ("counterexample", {"parameters__ratios": [2, 101]}, "ratio above 100"),
    ("counterexample", {"parameters__ratios": [1]}, "must be at least 2"),
    ("counterexample", {"parameters__ratios": [3, 3]}, "parameters.ratios must increase"),
    ("counterexample", {"parameters__ratios": [5, 2]}, "parameters.ratios must increase"),
    ("counterexample", {"plant__L": [["3"]]}, "P does not solve"),
    ("output-bounds", {"parameters__weights__CBK": "7/5"}, "the weight 7/5 of zeta is not positive semidefinite"),
    ("output-bounds", {"parameters__weights__CA": "9/10"}, "the weight 9/10 of x is not positive semidefinite"),
    ("output-bounds", {"parameters__weights__CA": "-1"}, "must be positive"),
    ("estimate-bound", {"parameters__weights__KÂ": "7/5"}, "the weight 7/5 of zeta"),
    ("estimate-bound", {"parameters__weights__KBK": "7/5"}, "the weight 7/5 of zeta"),
    ("estimate-bound", {"parameters__weights__KLC": "9/10"}, "the weight 9/10 of x"),
    ("estimate-bound", {"parameters__weights": {"KA": "2", "KBK": "2", "KLC": "1"}}, "lacks the field KÂ"),
    ("estimate-bound", {"parameters__quantity": ["feedback"]}, "parameters.quantity must be a string"),
    ("table-src-1", {"plant__A__2__0": "1"}, "position, speed and acceleration"),
    ("table-src-1", {"plant": []}, "plant must be an object"),
    ("estimate-bound", {"parameters__quantity": "input"}, "parameters.quantity must be one of output, feedback"),
    ("hurwitz-feedback", {"plant__K__0__0": "20"}, "A \\+ B K is not Hurwitz"),
    ("hurwitz-observer", {"plant__L__0__0": "-9"}, "A − L C is not Hurwitz"),
    ("hurwitz-feedback", {"parameters__matrix": "plant"}, "parameters.matrix must be one of feedback, observer"),
    ("coordinates", {"plant__KT": "3"}, "A is not that of"),
    ("coordinates", {"plant__B__2__0": "1"}, "B is not that of"),
    ("coordinates", {"plant__C__0": ["0", "1", "0"]}, "C does not read the position"),
    ("torque-constant", {"plant__Psi": "3/5"}, "the lower bound that is proved is 18/5"),
    ("torque-constant", {"plant__R": "-1"}, "plant.R must be positive"),
    ("slow-period", {"plant__T": "1/4"}, "the lower bound that is proved is 5/4"),
    ("feedforward", {"parameters__orders": [3, 1]}, "must have 3 entries"),
    ("feedforward", {"parameters__orders": [1, 999_999_999, 2]}, "must be at most 20, got 999999999"),
    ("feedforward", {"parameters__orders": [21, 1, 2]}, "must be at most 20, got 21"),
    ("hurwitz-feedback", {"plant__A": [["1"] * 51] * 51}, "plant.A has 51 states, more than 50"),
    (
        "feedforward",
        {"plant__A": [["-1"]], "plant__B": [["1"]], "plant__C": [["1"]], "plant__K": [["0"]], "plant__L": [["1"]]},
        "plant of order 3, not 1",
    ),
    *((name, {"bound": {"upper": "1"}}, "bound has the unknown field upper") for name in UNBOUNDED.split()),
    *((name, {"parameters": {"x": "1"}}, "parameters has the unknown field x") for name in PLAIN.split()),
    *((name, {"witness": {"x": "1"}}, "witness (has the unknown field|lacks)") for name in UNWITNESSED.split()),
    ("estimate-2", {"parameters__than": "fast_sensor"}, "the estimation errors are"),
    ("estimate-2", {"parameters__than": "alternating_predictive"}, "the estimation errors are"),
    ("estimate-2", {"parameters__than": "single_rate"}, "eigenvalues of Φ are not proved to lie inside"),
    ("estimate-2", {"plant__A__0__0": "1"}, "position, speed and acceleration"),
    ("feedforward", {"plant__B__2__0": "0"}, "position, speed and acceleration"),
    ("error-equations", {"bound": {"lower": "1"}}, "bound has the unknown field lower"),
]


@pytest.mark.parametrize(("name", "changes", "reason"), CHEATS)
def test_a_tampered_certificate_is_refused(name: str, changes: dict[str, Any], reason: str | None) -> None:
    if reason is None:
        assert stated(own(name, **changes)).holds is False
        return
    with pytest.raises(Refused, match=reason):
        check(own(name, **changes))


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("stable-apo", {"witness__radius": "99/100"}),
        ("output-bounds", {"parameters__weights__CBK": "3/2"}),
        ("estimate-bound", {"parameters__weights__KLC": "2"}),
        ("counterexample", {"parameters__ratios": [5]}),
    ],
)
def test_a_weaker_certificate_proves_too(name: str, changes: dict[str, Any]) -> None:
    assert stated(own(name, **changes)).holds is proved(name).holds


def test_bounds_of_errors_are_exported_under_the_reading_of_their_certificate() -> None:
    says = proved("errors-apo-corrected").says
    assert {one.readings for one in says} == {("corrected-feedforward",)}
    assert [one.of.setting["frequency"] for one in says] == ["1/2", "1", "3/2", "2", "5/2", "3"]
    given = committed("errors-apo-corrected")["witness"]["errors"]
    assert [one.items for one in says] == [((error["lower"], error["upper"]),) for error in given]


def test_a_better_estimate_is_exported_both_ways() -> None:
    better, worse = proved("estimate-2-one-correction").says
    assert (better.holds, worse.holds) == (True, False)
    assert (better.of.setting["observer"], worse.of.setting["than"]) == ("single_correction",) * 2
    assert better.readings == worse.readings == ("estimate-pmi-one-correction",)


def root_of(certificate: dict[str, Any]) -> list[str]:
    """The largest eigenvalue of the single-rate loop, in floating point."""
    loop = read_loop({key: value for key, value in certificate["plant"].items() if key != "start"})
    Phi = np.array([[float(entry.mid()) for entry in row] for row in monodromy(loop, Observer.SRC).tolist()])
    root = max(np.linalg.eigvals(Phi).astype(complex), key=abs)
    return [str(Fraction(float(root.real))), str(Fraction(float(root.imag)))]


def test_slow_growth_from_one_start_is_proved() -> None:
    """The spectral radius is 1.352."""
    slower = own("table-src-1", plant__T="1/10", plant__M="3", parameters__starts=["zero"])
    slower["witness"]["root"] = root_of(slower)
    assert check(slower).holds


def test_growth_that_the_error_does_not_show_is_no_proof() -> None:
    """Without feedback the estimate grows by an eigenvalue of A − L C, and the plant does not follow it."""
    unseen = own("table-src-1", plant__K=[["0", "0", "0"]], plant__L=[["-1"], ["0"], ["0"]])
    unseen["witness"]["root"] = root_of(unseen)
    with pytest.raises(Refused, match="not proved to be excited and seen"):
        check(unseen)


@pytest.mark.parametrize(
    ("name", "module", "step"),
    [
        ("output-bounds", identities, "require_rates"),
        ("lyapunov", lyapunov, "require_solution"),
    ],
)
def test_a_theorem_needs_its_step(name: str, module: ModuleType, step: str) -> None:
    def refuse(*arguments: Any) -> None:
        raise Refused("as planted")

    with pytest.MonkeyPatch.context() as patch, pytest.raises(Refused, match="as planted"):
        patch.setattr(module, step, refuse)
        check(committed(name))


def test_an_own_plant_is_not_said_to_be_printed() -> None:
    assert check(own("lyapunov")).sentence.startswith("For this plant ")


def test_a_ratio_of_2000_is_allowed() -> None:
    assert read_loop({**committed("stable-apo")["plant"], "M": "2000"}).M == 2000


def test_derivatives_of_order_20_are_allowed() -> None:
    assert check(own("feedforward", parameters__orders=[20, 1, 2])).holds is False


def test_of_fewer_frequencies_the_last_one_is_said_again() -> None:
    place: Any = {"phase": 0, "time": fmpq(0), "scales": []}
    frequencies = ["1/2", "1"]
    found = [response.Error(fmpq(low), fmpq(low + 1), **place) for low in (1, 3)]
    settings = [response._setting(i, {"frequencies": frequencies}) for i in range(response.MOST)]
    assert [setting["frequency"] for setting in settings] == ["1/2", *["1"] * (response.MOST - 1)]
    bounds = [response._bounds(i, {"errors": found}) for i in range(response.MOST)]
    assert [bound.upper for bound in bounds] == [2, *[4] * (response.MOST - 1)]
