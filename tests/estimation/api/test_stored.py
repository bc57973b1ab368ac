"""Running observers in files."""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from replication.errors import InvalidInputError
from replication.estimation import load
from replication.estimation.api.results import Bracket
from tests.estimation.api.running_cases import OBSERVERS, kalman, sizes, steps
from tests.estimation.nonuniform.test_stamped_c import observer_of

COUNT = 200
EXACT = 1e-15


def written(name: str, folder: Path) -> Path:
    path = folder / "observer.json"
    path.write_text(OBSERVERS[name]().to_json(), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", OBSERVERS)
def test_a_loaded_observer_takes_the_same_steps(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    loaded, own = load(path), OBSERVERS[name]()
    assert type(loaded) is type(own) and loaded.instant == 0
    assert loaded.signals == own.signals
    assert np.allclose(steps(loaded, COUNT), steps(own, COUNT), rtol=EXACT, atol=EXACT, equal_nan=True)
    assert loaded.missed == own.missed > 0
    # A file that is written again is the same, also by an observer that has run.
    assert loaded.to_json() == path.read_text(encoding="utf-8")


def test_another_number_in_the_file_gives_other_steps(tmp_path: Path) -> None:
    path = written("multirate", tmp_path)
    held = json.loads(path.read_text(encoding="utf-8"))
    held["made_with"]["phases"][0]["fields"]["injection"]["array"][0][0] *= 1 + 1e-9
    path.write_text(json.dumps(held), encoding="utf-8")
    assert not np.allclose(steps(load(path), COUNT), steps(OBSERVERS["multirate"](), COUNT), rtol=EXACT, atol=EXACT)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "gains"}, "no file of a running observer"),
        ({"version": 2}, "version 2; known is version 1"),
        ({"version": None}, "version None"),
        ({"observer": "api.running:vector"}, "no class of this library"),
        ({"observer": "api.running:Mapping"}, "not known"),
        ({"observer": "api.running:np"}, "no class of this library"),
        ({"observer": "api.export:Phase"}, "no running observer"),
        ({"observer": "..files:write_directory"}, "not known"),
        ({"made_with": {}}, "not whole"),
        ({"made_with": {"phases": 3, "expected": 4}}, "not whole"),
        ({"signals": {"states": []}}, "not whole"),
    ],
)
def test_other_files_are_refused(change: dict[str, Any], words: str, tmp_path: Path) -> None:
    path = written("multirate", tmp_path)
    held = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({**held, **change}), encoding="utf-8")
    with pytest.raises(InvalidInputError, match=words):
        load(path)
    path.write_text("{", encoding="utf-8")
    for unread in (path, tmp_path / "none.json"):
        with pytest.raises(InvalidInputError, match="cannot be read as JSON"):
            load(unread)


def test_the_matlab_file_has_the_matrices() -> None:
    observer = OBSERVERS["multirate"]()
    held = scipy.io.loadmat(io.BytesIO(observer.to_mat()))
    for k, phase in enumerate(observer.phases, start=1):
        assert np.array_equal(held[f"transition_{k}"], phase.transition)
        assert np.array_equal(held[f"injection_{k}"], phase.injection)
    assert "A" in scipy.io.loadmat(io.BytesIO(OBSERVERS["nonuniform"]().to_mat()))


@pytest.mark.parametrize("name", OBSERVERS)
def test_signals_by_name_do_the_same(name: str) -> None:
    by_name, in_order = OBSERVERS[name](), OBSERVERS[name]()
    inputs, measurements = sizes(in_order)
    u, y = np.arange(1.0, 1.0 + inputs), np.arange(2.0, 2.0 + measurements)
    known = dict(zip(by_name.signals.inputs, u, strict=True))
    values = dict(zip(by_name.signals.measurements, y, strict=True))
    for one, other in [
        (by_name.step({**values, **known}), in_order.step(u, y)),
        (by_name.step(known), in_order.step(u, None)),
        (by_name.step(u, values), in_order.step(u, y)),
    ]:
        parts = (one, other) if isinstance(one, tuple) else ((one,), (other,))
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(*parts, strict=True))
    assert by_name.missed == in_order.missed


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (({"camara": 1.0, "force": 0.0},), "no signal 'camara'; the signals are force, encoder, camera"),
        (({"encoder": 1.0},), "input 'force' has no value"),
        (({"encoder": 1.0}, None), "no input 'encoder'; the inputs are force"),
        ((0.0, {"force": 1.0}), "no measurement 'force'"),
        ((0.0,), "step takes u and y, or one dict"),
    ],
)
def test_names_that_do_not_fit_are_refused(given: tuple[Any, ...], words: str) -> None:
    for observer in (OBSERVERS["multirate"](), kalman().filter()):
        with pytest.raises(InvalidInputError, match=words):
            observer.step(*given)
        assert observer.instant == 0


@pytest.mark.parametrize("kind", ["filter", "kalman"])
def test_a_filter_with_time_stamps(kind: str, tmp_path: Path) -> None:
    observer, rng = observer_of(kind), np.random.default_rng(2)
    (tmp_path / "observer.json").write_text(observer.to_json(), encoding="utf-8")
    loaded = load(tmp_path / "observer.json")
    for t in np.cumsum(rng.uniform(0.02, 0.4, 40)):
        y = rng.standard_normal(2)
        one, other = (run.step(y, t=t, u=[0.5]) for run in (observer, loaded))
        assert np.array_equal(one, other)


def test_the_width_of_a_bracket_is_a_share_of_its_upper_end() -> None:
    assert Bracket(1.0, 4.0, "m").width == 0.75
    assert Bracket(0.0, 0.0, "m").width == 0.0
