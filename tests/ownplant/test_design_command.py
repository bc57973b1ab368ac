"""`replication design`: what is printed and written, all or nothing, and the exit codes."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import pickle
import re
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import html5lib
import numpy as np
import pytest
import scipy.io

from replication.cli import main
from replication.errors import InvalidInputError
from replication.estimation import load
from replication.estimation.multirate import MultiratePlant, design, search_timing
from replication.ownplant import writing
from replication.ownplant.methods import METHODS
from replication.ownplant.reading import read_plant
from replication.ownplant.searching import FEW, every_core
from replication.ownplant.writing import FILES, RUNNING
from tests.patience import wait_for

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
CASES = {
    "multirate": ("cart.toml", "--periods", "1,4", "--offsets", "0,2"),
    "nonuniform": ("spring.toml", "--periods", "0.05,0.2", "--leaves", "2", "--horizon", "50"),
    "dualrate": ("servo.toml", "--period", "0.02", "--ratio", "10"),
    "delay": ("tanks.toml", "--order", "12"),
}


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(method: str, *more: str) -> int:
    file, *options = CASES[method]
    return main(["design", method, str(EXAMPLES / file), *options, *more])


@pytest.mark.parametrize("method", CASES)
def test_a_design_is_printed_and_written(method: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(method) == 0
    printed = capsys.readouterr().out.splitlines()
    (made,) = here.iterdir()
    assert printed[-1] == f"written: {made.name}"
    assert sorted(path.name for path in made.iterdir()) == sorted((*FILES, *running(method)))
    gains = json.loads((made / "gains.json").read_text(encoding="utf-8"))
    level = re.fullmatch(r"guaranteed level: (\S+)  \(.*\)", printed[0])
    assert level is not None and float(level[1]) == pytest.approx(gains["value"], rel=1e-5)
    assert gains["bracket"]["lower"] <= gains["bracket"]["upper"] == gains["value"]
    read = scipy.io.loadmat(made / "gains.mat")
    for name, gain in gains["gains"].items():
        assert np.array_equal(read[name].ravel(), np.ravel(gain["value"]))
    stem = CASES[method][0].removesuffix(".toml")
    assert f"{stem}_{method}_" in (made / "gains.h").read_text(encoding="utf-8")
    check_page(made, method)


def check_page(made: Path, method: str) -> None:
    """Whole, self-contained, and it says how it was made."""
    text = (made / "index.html").read_text(encoding="utf-8")
    tree = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False).parse(text)
    assert tree.get("lang") == "en"
    assert {link.get("href") for link in tree.iter("a")} == {*FILES[:-1], *running(method)}
    assert len([svg for svg in tree.iter("{http://www.w3.org/2000/svg}svg") if svg.get("aria-label")]) == 1
    assert not re.search(r"<(script|link|img|iframe)\b|@import|https?://(?!www\.w3\.org/2000/svg)", text)
    code = next(tree.iter("code")).text
    assert code.split()[:4] == ["replication", "design", method, CASES[method][0]]
    for option in CASES[method][1:]:
        assert option in code.split()


def running(method: str) -> tuple[str, ...]:
    """The forms of the observer; that of a delay plant asks for a sampling period first."""
    return () if method == "delay" else RUNNING


def test_the_observer_that_is_written_runs_by_the_names_of_the_file(here: Path) -> None:
    assert run("multirate") == 0
    loaded: Any = load(here / "cart-multirate" / "observer.json")
    in_order: Any = load(here / "cart-multirate" / "observer.json")
    named = [loaded.step({"force": 0.5, "encoder": 0.3, "camera": k}) for k in range(8)]
    assert np.array_equal(named, [in_order.step([0.5], [0.3, k]) for k in range(8)])
    assert "int cart_multirate_step(" in (here / "cart-multirate" / "observer.c").read_text(encoding="utf-8")
    assert "= observer(u, y)" in (here / "cart-multirate" / "observer.m").read_text(encoding="utf-8")


def test_the_same_design_gives_the_same_bytes(here: Path) -> None:
    assert run("dualrate", "--output", "one") == run("dualrate", "--output", "two") == 0
    for name in (*FILES, *RUNNING):
        assert (here / "one" / name).read_bytes() == (here / "two" / name).read_bytes()


def test_names_of_the_file_are_in_the_gains(here: Path) -> None:
    assert run("multirate") == 0
    signals = json.loads((here / "cart-multirate" / "gains.json").read_text(encoding="utf-8"))["signals"]
    assert signals == {
        "states": ["position", "speed"],
        "inputs": ["force"],
        "measurements": ["encoder", "camera"],
        "outputs": ["position", "speed"],
        "dt": 0.1,
        "units": {"position": "m", "speed": "m/s", "force": "N", "encoder": "m/s", "camera": "m"},
    }
    page = (here / "cart-multirate" / "index.html").read_text(encoding="utf-8")
    assert "<td>position (m), speed (m/s)</td>" in page


@pytest.mark.parametrize(
    ("units", "said"),
    [
        ("encoder = 1", "units: must be a table of names with their units"),
        ('wheel = "m"', "units.wheel: no signal of [names] is called so; there are camera, encoder, force"),
    ],
)
def test_a_unit_that_belongs_to_nothing_is_told(
    units: str, said: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (EXAMPLES / "cart.toml").read_text(encoding="utf-8").partition("[units]")[0]
    (here / "cart.toml").write_text(f"{text}[units]\n{units}\n", encoding="utf-8")
    assert main(["design", "multirate", "cart.toml", "--periods", "1,4"]) == 2
    assert said in capsys.readouterr().err


def test_a_title_cannot_become_a_part_of_the_page(here: Path) -> None:
    text = (EXAMPLES / "servo.toml").read_text(encoding="utf-8").partition("[units]")[0]
    hostile = text.replace("Servo that", "</title><script>alert(1)</script>").replace('"voltage"', "'<img src=x>'")
    (here / "hostile.toml").write_text(hostile, encoding="utf-8")
    assert main(["design", "dualrate", "hostile.toml", "--period", "0.02", "--ratio", "10"]) == 0
    page = (here / "servo-dualrate" / "index.html").read_text(encoding="utf-8")
    assert "<script" not in page and "<img" not in page
    assert page.count("&lt;script&gt;") == 2 and "&lt;img src=x&gt;" in page


def test_a_kalman_filter_is_designed_from_covariances(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "A = [[1, 0.1], [0, 0.98]]\nC = [[0, 1], [1, 0]]\nQ = [[0, 0], [0, 0.01]]\nP0 = [[1, 0], [0, 1]]\n"
    (here / "own.toml").write_text(text + "R = [[0.25, 0], [0, 0.01]]\n", encoding="utf-8")
    command = ["design", "multirate", "own.toml", "--periods", "1,4", "--goal"]
    assert main([*command, "h2"]) == 0
    assert "rms error of the Kalman filter" in capsys.readouterr().out
    made = here / "own-multirate"
    gains = json.loads((made / "gains.json").read_text(encoding="utf-8"))["gains"]
    assert list(gains) == ["L", "K", "P", "F", "V"]
    read, header = scipy.io.loadmat(made / "gains.mat"), (made / "gains.h").read_text(encoding="utf-8")
    plant = MultiratePlant(A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=[[0, 1], [1, 0]], D=np.diag([0.5, 0.1]))
    wanted = design(plant, periods=(1, 4), goal="h2")
    for name, gain in gains.items():
        assert np.allclose(gain["value"], wanted.gains[name], atol=1e-12)
        assert np.array_equal(read[name], gain["value"])
        assert f"own_multirate_{name}[4][2][2]" in header
    assert main([*command, "mixed", "--output", "b"]) == 2
    assert "P0 belongs to the goal h2" in capsys.readouterr().err
    assert main([*command, "h2", "--level", "1", "--output", "b"]) == 2
    (here / "goal.toml").write_text(text + "goal = 'h2'\nR = [[0.25, 0], [0, 0.01]]\n", encoding="utf-8")
    by_file = ["design", "multirate", "goal.toml", "--periods", "1,4"]
    assert main(by_file) == 0
    assert json.loads((here / "goal-multirate" / "gains.json").read_text(encoding="utf-8"))["gains"] == gains
    assert main([*by_file, "--goal", "hinf", "--output", "b"]) == 2  # P0 is left without a use
    for goal, words in (("'h3'", "goal must be one of"), ("3", 'goal: must be a word in quotes, such as "h2", got 3')):
        (here / "bad.toml").write_text(f"{text}goal = {goal}\nR = [[0.25, 0], [0, 0.01]]\n", encoding="utf-8")
        assert main(["design", "multirate", "bad.toml", "--periods", "1,4"]) == 2
        assert words in capsys.readouterr().err
    assert not (here / "b").exists()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ("R = [[0.25, 0], [0, 0]]", "R must be positive definite"),
        ("R = [[0.25, 0], [0, 0.01]]\nS = [[1, 0], [0, 0]]", "S does not fit Q and R"),
        ("R = [[0.25, 0], [0, 0.01]]\nP0 = [[1, 2], [2, 1]]", "P0 must be positive semidefinite"),
        ("R = [[0.25, 0], [0, 0.01]]\nD = [[1, 0], [0, 1]]", "give the sensor noise once"),
    ],
)
def test_covariances_that_are_none_end_before_a_design(
    changed: str, words: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = f"A = [[1, 0.1], [0, 0.98]]\nC = [[0, 1], [1, 0]]\nQ = [[1, 0], [0, 1]]\n{changed}\n"
    (here / "own.toml").write_text(text, encoding="utf-8")
    assert main(["design", "multirate", "own.toml", "--periods", "1,4", "--goal", "h2"]) == 2
    assert words in capsys.readouterr().err
    assert [path.name for path in here.iterdir()] == ["own.toml"]


def test_gains_in_the_file_are_analysed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (EXAMPLES / "servo.toml").read_text(encoding="utf-8")
    own = here / "own.toml"
    own.write_text("K = [[-1.0, -0.5]]\nL = [[1.0], [0.2]]\n" + text, encoding="utf-8")
    command = ["design", "dualrate", str(own), "--period", "0.02", "--ratio", "10"]
    assert main([*command, "--output", "a"]) == 0
    gains = json.loads((here / "a" / "gains.json").read_text(encoding="utf-8"))["gains"]
    assert gains["K"]["value"] == [[-1.0, -0.5]]
    own.write_text("K = [[-1.0, -0.5]]\n" + text, encoding="utf-8")
    assert main([*command, "--output", "b"]) == 2
    assert "one of K and L" in capsys.readouterr().err


def test_an_earlier_design_is_replaced_only_if_asked_and_nothing_else_ever(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("dualrate", "--output", "out/deep") == 0
    assert run("dualrate", "--output", "out/deep") == 2
    assert "exists; choose another --output, or --force" in capsys.readouterr().err
    (here / "out/deep/index.html").write_text("old", encoding="utf-8")
    assert run("dualrate", "--output", "out/deep", "--force") == 0
    assert (here / "out/deep/index.html").read_text(encoding="utf-8") != "old"
    (here / "out/deep/mine.txt").write_text("keep", encoding="utf-8")
    assert run("dualrate", "--output", "out/deep", "--force") == 2
    assert "holds more than a design (mine.txt)" in capsys.readouterr().err
    (here / "link").symlink_to("out")
    assert run("dualrate", "--output", "link", "--force") == 2
    assert "is no directory" in capsys.readouterr().err
    assert [path.name for path in (here / "out").iterdir()] == ["deep"]


def test_a_place_that_cannot_be_written_is_named_before_anything_is_computed(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(METHODS, "dualrate", replace(METHODS["dualrate"], design=None))
    (here / "file").write_text("keep", encoding="utf-8")
    assert run("dualrate", "--output", "file/deep/out") == 2
    assert "file is no directory that can be written; choose another --output" in capsys.readouterr().err
    monkeypatch.setattr(writing.os, "access", lambda *_: False)
    assert run("dualrate") == 2
    assert f"{here} is no directory that can be written" in capsys.readouterr().err


def test_a_failure_while_writing_leaves_nothing(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run("dualrate", "--output", "out") == 0
    before = {path.name: path.read_bytes() for path in (here / "out").iterdir()}

    def fail(*_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writing, "page", fail)
    assert run("dualrate", "--output", "out", "--force") == 2
    assert {path.name: path.read_bytes() for path in (here / "out").iterdir()} == before
    assert run("dualrate", "--output", "new") == 2
    assert [path.name for path in here.iterdir()] == ["out"]


def test_no_design_is_exit_code_3(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("multirate", "--level", "0.1") == 3
    complaint = capsys.readouterr().err
    assert "cart.toml: no observer has a gain below 0.1" in complaint and "Traceback" not in complaint
    assert list(here.iterdir()) == []


def test_a_plant_that_cannot_be_observed_is_exit_code_2(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    blind = here / "blind.toml"
    blind.write_text("A = [[2.0]]\nB_d = [[1.0]]\nC = [[0.0]]\nD = [[1.0]]\n", encoding="utf-8")
    assert main(["design", "multirate", str(blind), "--periods", "1"]) == 2
    assert "blind.toml: the pair is not detectable" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["multirate", "x.toml"], "the following arguments are required: --periods"),
        (["multirate", "x.toml", "--periods", "1,2.5"], "'2.5' is not a whole number from 0 on"),
        (["multirate", "x.toml", "--periods", "0"], "'0' is not a whole number of at least 1"),
        (["multirate", "x.toml", "--periods", ""], "'' is not a whole number"),
        (["multirate", "x.toml", "--periods", "1", "--offsets", "-1"], "'-1' is not a whole number from 0 on"),
        (["multirate", "x.toml", "--periods", "1", "--level", "nan"], "'nan' is not a positive number"),
        (["nonuniform", "x.toml", "--periods", "0.1"], "'0.1' must be two numbers"),
        (["nonuniform", "x.toml", "--periods", "0.1,inf"], "'inf' is not a positive number"),
        (["dualrate", "x.toml", "--period", "1"], "required: --ratio"),
        (["dualrate", "x.toml", "--period", "1e-300", "--ratio", "2"], "'1e-300' is not from 1e-60 to 1e+60"),
        (["dualrate", "x.toml", "--period", "1", "--ratio", "999999999"], "'999999999' is more than 2000; the library"),
        (["nonuniform", "x.toml", "--periods", "1,2", "--leaves", "500"], "'500' is more than 200"),
        (["kalman", "x.toml"], "invalid choice: 'kalman'"),
        ([], "the following arguments are required: METHOD"),
    ],
)
def test_usage_is_checked(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["design", *words])
    assert end.value.code == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("method", "old", "new", "message"),
    [
        ("multirate", "[[1.0, 0.1]", "[[1e200, 0.1]", "A[0][0]: 1e+200 is beyond 1e+60 in size; choose other units"),
        ("delay", "delays = [", "delays = [1e-300, ", "delays[0]: 1e-300 is below 1e-60; choose another unit of time"),
    ],
)
def test_numbers_out_of_all_proportion_are_refused_by_name(
    method: str, old: str, new: str, message: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (EXAMPLES / CASES[method][0]).read_text(encoding="utf-8")
    assert old in text
    (here / "odd.toml").write_text(text.replace(old, new), encoding="utf-8")
    assert main(["design", method, "odd.toml", *CASES[method][1:]]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("error", [np.linalg.LinAlgError("singular"), OverflowError("too large")])
def test_a_design_that_fails_numerically_is_exit_code_3_without_a_warning(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object, **__: object) -> None:
        np.float64(1e300) * np.float64(1e300)
        raise error

    monkeypatch.setitem(METHODS, "dualrate", replace(METHODS["dualrate"], design=fail))
    assert run("dualrate") == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert "no design" in line and "choose units in which they are near 1" in line


@pytest.mark.parametrize(
    ("words", "variables", "message"),
    [
        (["design", "multirate", "a\0b", "--periods", "1"], {}, "a null character"),
        (["check", "--output", "a\0b"], {}, "a null character"),
        (["list"], {"SOURCE_DATE_EPOCH": "soon"}, "SOURCE_DATE_EPOCH must be whole seconds since 1970, got 'soon'"),
        (["design", "dualrate", str(EXAMPLES / "servo.toml"), *CASES["dualrate"][1:], "--output", "/"], {}, "/ exists"),
        (["show", "x" * 100_000], {}, "unknown claim 'xxx"),
    ],
)
def test_odd_surroundings_are_bad_input(
    words: list[str],
    variables: dict[str, str],
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line or "there is no replication.toml" in line
    assert len(line) < 500


@pytest.mark.parametrize("path", ["no.toml", "a\0b", "x" * 300, "."])
def test_files_that_cannot_be_read_are_exit_code_2(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["design", "multirate", path, "--periods", "1"]) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("replication: ") and len(complaint.splitlines()) == 1


@pytest.mark.parametrize("method", CASES)
def test_help_of_a_method_lists_the_keys_of_its_file(method: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["design", method, "--help"])
    text = capsys.readouterr().out
    assert "keys of the plant file:" in text and "exit codes:" in text
    assert all(
        f"--{option.name} " in text and option.help in " ".join(text.split()) for option in METHODS[method].options
    )


def test_the_best_timing_is_searched_on_every_core(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    periods = (9, 9)
    plant = read_plant(EXAMPLES / "cart.toml", "multirate")
    alone = search_timing(MultiratePlant(**plant.values), periods)
    assert len(alone.optima) > FEW
    assert main(["design", "multirate", str(EXAMPLES / "cart.toml"), "--periods", "9,9", "--offsets", "best"]) == 0
    assert f"periods {periods}, offsets {alone.best}" in capsys.readouterr().out
    together = search_timing(MultiratePlant(**plant.values), periods, apply=every_core)
    assert together.optima == alone.optima
    assert not Path("cart-multirate.timings").exists()


def noted(folder: Path, item: int) -> int:
    """Ten times the item, with a note of each call; the last item fails while there is no file `mended`."""
    with (folder / f"called-{item}").open("a") as notes:
        notes.write("x")
    if item == FEW and not (folder / "mended").exists():
        raise InvalidInputError("not yet")
    return 10 * item


def test_a_search_that_ended_early_goes_on_with_what_is_left(tmp_path: Path) -> None:
    store, function, items = tmp_path / "store", partial(noted, tmp_path), range(FEW - 2, FEW + 1)
    with pytest.raises(InvalidInputError, match="not yet"):
        list(every_core(function, items, store=store))
    (tmp_path / "mended").touch()
    for _ in range(2):
        assert list(every_core(function, items, store=store)) == [10 * item for item in items]
    assert [len((tmp_path / f"called-{item}").read_text()) for item in items] == [1, 1, 2]


def squared(power: int, item: int) -> int:
    return int(item**power)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*successfully executed")
def test_ten_thousand_stream_and_only_what_is_left_is_computed(tmp_path: Path) -> None:
    store, items = tmp_path / "store", range(10_000)
    begun = every_core(partial(squared, 2), items, store=store)
    assert list(itertools.islice(begun, 3000)) == [item**2 for item in items[:3000]]
    begun.close()
    kept = {path: path.stat().st_mtime_ns for path in (store / "kept").glob("*.json")}
    assert 3000 <= len(kept) < len(items)  # values are handed out before all are there
    assert list(every_core(partial(squared, 2), items, store=store)) == [item**2 for item in items]
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert sum(1 for _ in (store / "kept").glob("*.json")) == len(items)


class Bomb:
    """Whoever reads its pickle makes a file."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (str(self.target),)


def test_what_lies_in_the_folder_of_a_search_is_never_run_nor_trusted(here: Path) -> None:
    asked = ["design", "multirate", str(EXAMPLES / "cart.toml"), "--periods", "2,2", "--offsets", "best"]
    assert main([*asked, "--output", "honest"]) == 0
    store, function, items = here / "store", partial(noted, here), [1, 2, 3, 4]
    assert list(every_core(function, items, store=store)) == [10, 20, 30, 40]
    one, two, three, four = sorted((store / "kept").iterdir())
    poison = pickle.dumps(Bomb(here / "exploded"))
    one.write_bytes(poison)  # as joblib kept them
    two.write_bytes(hashlib.sha256(two.stem.encode() + poison).hexdigest().encode() + b"\n" + poison)
    three.write_bytes(three.read_bytes()[:-1] + b"9")
    four.write_bytes(two.read_bytes())
    old = here / "cart-multirate.timings" / "kept" / "joblib" / "replication"
    old.mkdir(parents=True)
    (old / "output.pkl").write_bytes(poison)
    assert list(every_core(function, items, store=store)) == [10, 20, 30, 40]
    assert [len((here / f"called-{item}").read_text()) for item in items] == [2, 2, 2, 2]
    assert main(asked) == 0
    assert (here / "cart-multirate/gains.json").read_bytes() == (here / "honest/gains.json").read_bytes()
    assert not (here / "exploded").exists()
    pickle.loads(poison)
    assert (here / "exploded").exists()


def test_a_kept_optimum_is_the_computed_one(here: Path) -> None:
    values = read_plant(EXAMPLES / "cart.toml", "multirate").values
    apply = partial(every_core, store=here / "store")
    first, again = (search_timing(MultiratePlant(**values), (2, 4), apply=apply) for _ in range(2))
    assert first == again == search_timing(MultiratePlant(**values), (2, 4))
    kept = len(list((here / "store" / "kept").iterdir()))
    assert kept == len(first.optima)
    search_timing(MultiratePlant(**{**values, "dt": 0.25}), (2, 4), apply=apply)
    assert len(list((here / "store" / "kept").iterdir())) == 2 * kept


@pytest.mark.parametrize("offsets", ["best", "0,0"])
def test_a_folder_of_the_users_beside_the_design_stays(offsets: str, here: Path) -> None:
    own = here / "cart-multirate.timings" / "mine.txt"
    own.parent.mkdir()
    own.write_text("keep")
    asked = ["design", "multirate", str(EXAMPLES / "cart.toml"), "--periods", "2,2", "--offsets", offsets]
    assert main(asked) == 0
    assert [path.name for path in own.parent.iterdir()] == ["mine.txt"]


@pytest.mark.slow
def test_a_killed_search_for_timings_is_taken_up(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["design", "multirate", str(EXAMPLES / "cart.toml"), "--periods", "60,60", "--offsets", "best"]
    store = Path("cart-multirate.timings")
    environment = {**os.environ, "PYTHONPATH": str(EXAMPLES.parents[1])}
    running = subprocess.Popen([sys.executable, "-m", "replication", *asked], start_new_session=True, env=environment)
    wait_for(lambda: sum(1 for _ in store.rglob("*.json")) >= FEW, lambda: running.poll() is None)
    os.killpg(running.pid, signal.SIGKILL)
    running.wait()
    assert not Path("cart-multirate").exists()
    assert main(asked) == 0
    assert "offsets" in capsys.readouterr().out
    assert Path("cart-multirate", "gains.json").exists() and not store.exists()


def test_a_delay_plant_with_noise_is_designed_for_and_has_no_certificate(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(EXAMPLES / "late.toml")
    assert main(["design", "delay", file, "--degree", "3"]) == 0
    assert "least level of any observer" in capsys.readouterr().out
    gains = json.loads((here / "late-delay" / "gains.json").read_text(encoding="utf-8"))
    assert set(gains["gains"]) == {"L0", "Lz", "L1", "E1"}
    assert main(["design", "delay", file, "--degree", "3", "--output", "other", "--certificate"]) == 2
    assert "free of noise" in capsys.readouterr().err
    assert sorted(path.name for path in here.iterdir()) == ["late-delay"]


def test_a_delay_plant_whose_noise_is_forgotten_is_told_so(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (EXAMPLES / "late.toml").read_text(encoding="utf-8")
    (here / "silent.toml").write_text(re.sub(r"D21_delayed.*", "", text), encoding="utf-8")
    assert main(["design", "delay", "silent.toml"]) == 2
    assert "add a disturbance of its own to each row of d21" in capsys.readouterr().err
    (here / "narrow.toml").write_text(f"{text}D21 = [[1.0]]\n", encoding="utf-8")
    assert main(["design", "delay", "narrow.toml"]) == 2
    assert "D21: has 1 columns" in capsys.readouterr().err
