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
from tampered import Altered, refused

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


def stated(certificate: dict[str, Any]) -> Theorem:
    """What the mathematics proves, in the words of the paper even where those are for its certificates only."""
    statement = STATEMENTS[certificate["statement"]]
    return statement({**certificate, "paper": statement.source or None})


@pytest.mark.parametrize("name", [name for name in WANTED if committed(name)["bound"]])
def test_a_bound_moved_by_a_hundred_thousandth_is_refused(name: str) -> None:
    for side, sign in (("lower", 1), ("upper", -1)):
        moved = Fraction(committed(name)["bound"][side]) * (1 + sign * Fraction(1, 100_000))
        with pytest.raises(Refused, match=r"not proved|not as large|bound that is proved"):
            check(own(name, **{f"bound__{side}": str(moved)}))


@pytest.mark.parametrize("row", refused("dualrate"), ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


@pytest.mark.parametrize(
    ("name", "changes"),
    [("counterexample", {"parameters__ratios": [100]}), ("condition-scalar", {"plant__T": "1/600"})],
)
def test_what_holds_no_longer_is_stated_so(name: str, changes: dict[str, Any]) -> None:
    assert stated(own(name, **changes)).holds is False


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
    [("output-bounds", identities, "require_rates"), ("lyapunov", lyapunov, "require_solution")],
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
