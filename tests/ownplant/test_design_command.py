"""`replication design`: what is printed and written, all or nothing, and the exit codes."""

import hashlib
import json
import os
import pickle
import re
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
from replication.ownplant import files
from replication.ownplant.files import FILES, RUNNING, read_plant
from replication.ownplant.methods import FEW, METHODS, every_core

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


def test_the_names_of_the_file_are_in_the_gains_the_page_and_the_observer(here: Path) -> None:
    assert run("multirate") == 0
    signals = json.loads((here / "cart-multirate" / "gains.json").read_text(encoding="utf-8"))["signals"]
    assert (signals["inputs"], signals["dt"], signals["units"]["speed"]) == (["force"], 0.1, "m/s")
    page = (here / "cart-multirate" / "index.html").read_text(encoding="utf-8")
    assert "<td>position (m), speed (m/s)</td>" in page
    loaded: Any = load(here / "cart-multirate" / "observer.json")
    in_order: Any = load(here / "cart-multirate" / "observer.json")
    named = [loaded.step({"force": 0.5, "encoder": 0.3, "camera": k}) for k in range(8)]
    assert np.array_equal(named, [in_order.step([0.5], [0.3, k]) for k in range(8)])
    assert "int cart_multirate_step(" in (here / "cart-multirate" / "observer.c").read_text(encoding="utf-8")
    assert "= observer(u, y)" in (here / "cart-multirate" / "observer.m").read_text(encoding="utf-8")


def test_a_title_cannot_become_a_part_of_the_page(here: Path) -> None:
    text = (EXAMPLES / "servo.toml").read_text(encoding="utf-8").partition("[units]")[0]
    hostile = text.replace("Servo that", "</title><script>alert(1)</script>").replace('"voltage"', "'<img src=x>'")
    (here / "hostile.toml").write_text(hostile, encoding="utf-8")
    assert main(["design", "dualrate", "hostile.toml", "--period", "0.02", "--ratio", "10"]) == 0
    page = (here / "servo-dualrate" / "index.html").read_text(encoding="utf-8")
    assert "<script" not in page and "<img" not in page
    assert page.count("&lt;script&gt;") == 2 and "&lt;img src=x&gt;" in page


def test_a_kalman_filter_is_designed_from_covariances(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = FILTER + "P0 = [[1, 0], [0, 1]]\n"
    (here / "own.toml").write_text(text, encoding="utf-8")
    (here / "goal.toml").write_text(f"{text}goal = 'h2'\n", encoding="utf-8")
    command, by_file = (["design", "multirate", f"{name}.toml", "--periods", "1,4"] for name in ("own", "goal"))
    assert main([*command, "--goal", "h2"]) == main(by_file) == 0
    assert "rms error of the Kalman filter" in capsys.readouterr().out
    gains, again = (
        json.loads((here / f"{name}-multirate" / "gains.json").read_text(encoding="utf-8"))["gains"]
        for name in ("own", "goal")
    )
    assert gains == again
    plant = MultiratePlant.from_covariances(
        A=[[1, 0.1], [0, 0.98]], C=[[0, 1], [1, 0]], Q=np.eye(2), R=np.diag([0.25, 0.01])
    )
    wanted = design(plant, periods=(1, 4), goal="h2").gains
    assert {name: np.shape(gain["value"]) for name, gain in gains.items()} == {n: g.shape for n, g in wanted.items()}
    assert all(np.allclose(gain["value"], wanted[name], atol=1e-12) for name, gain in gains.items())
    assert main([*by_file, "--goal", "hinf", "--output", "b"]) == 2  # P0 is left without a use
    assert "P0 belongs to the goal h2" in capsys.readouterr().err


def example(method: str, old: str = "", new: str = "") -> str:
    """The plant file of a method without units, changed."""
    text = (EXAMPLES / CASES[method][0]).read_text(encoding="utf-8").partition("[units]")[0]
    assert old in text
    return text.replace(old, new, 1) if old else text + new


BALL = """A = [[0.0, 1.0], [22.0, 0.0]]
B = [[0.0], [1.0]]
C = [[1.0, 0.0], [0.0, 1.0]]
sensor_noise = [[1.0, 0.0], [0.0, 4.0]]
"""
SLOW = "--period 0.02 --ratio 10,2 --at slow --hold 2"
GROWING = "A = [[0.5]]\nB = [[1.0, 0.0]]\nC = [[1.0]]\nD = [[0, 0.1]]\nL = [[1]]\n"
RANGE = "--periods 0.1,0.4 --horizon 20"
FILTER = "A = [[1, 0.1], [0, 0.98]]\nC = [[0, 1], [1, 0]]\nQ = [[1, 0], [0, 1]]\nR = [[0.25, 0], [0, 0.01]]\n"
KALMAN = "--periods 1,4 --goal h2"
LATE = (EXAMPLES / "late.toml").read_text(encoding="utf-8")
STAMPED = 'stamps = "known"\n'
REFUSED = {
    "units: must be a table of names with their units": (
        "multirate", example("multirate", new="[units]\nencoder = 1\n"), "--periods 1,4",
    ),
    "units.wheel: no signal of [names] is called so; there are camera, encoder, force": (
        "multirate", example("multirate", new='[units]\nwheel = "m"\n'), "--periods 1,4",
    ),
    "own.toml: no observer has a gain below 0.1": ("multirate", example("multirate"), "--periods 1,4 --level 0.1"),
    "S does not fit Q and R": ("multirate", FILTER + "S = [[1, 0], [0, 0]]", KALMAN),
    "give the sensor noise once": ("multirate", FILTER + "D = [[1, 0], [0, 1]]", KALMAN),
    "delays[0]: 1e-300 is below 1e-60; choose another unit of time": (
        "delay", example("delay", "delays = [", "delays = [1e-300, "), "",
    ),
    "add a disturbance of its own to each row of d21": ("delay", re.sub(r"D21_delayed.*", "", LATE), ""),
    "D21: has 1 columns": ("delay", f"{LATE}D21 = [[1.0]]\n", ""),
    "one of K and L": ("dualrate", f"K = [[-1.0, -0.5]]\n{example('dualrate')}", "--period 0.02 --ratio 10"),
    "no controller at these rates keeps the level 0.001: the least is": (
        "dualrate", BALL, f"{SLOW} --goal hinf --level 1e-3",
    ),
    'belong to designs at the slow rate: at="slow"': ("dualrate", BALL, f"{SLOW} --at continuous"),
    "sensor_noise, at, hold: for a design; the file has gains K and L": (
        "dualrate", f"K = [[-30.0, -9.0]]\nL = [[1.0, 0.0], [0.0, 1.0]]\n{BALL}", SLOW,
    ),
    "the verifier has no statement on a SlowRateResult": ("dualrate", BALL, f"{SLOW} --certificate"),
    "dualrate.stable is a statement on loops with one input and one output": (
        "dualrate", "A = [[-1.0, 0.0], [0.0, -2.0]]\nB = [[1.0, 0.0], [0.0, 1.0]]\nC = [[1.0, 0.0], [0.0, 1.0]]\n",
        "--period 0.01 --ratio 2 --certificate",
    ),
    "one that takes the time stamps of the samples can": ("nonuniform", GROWING, RANGE),
    "A must be Hurwitz": ("nonuniform", GROWING + STAMPED, f"{RANGE} --stamps unknown"),
    'stamps: must be "known" or "unknown", got \'sometimes\'': ("nonuniform", GROWING + 'stamps = "sometimes"', RANGE),
    "stamps: must be a word in quotes": ("nonuniform", GROWING + "stamps = true\n", RANGE),
    "B_u: has 2 rows, where A sets n = 1": ("nonuniform", GROWING + STAMPED + "B_u = [[1], [0]]\n", RANGE),
    "B_u: for a filter that takes time stamps": ("nonuniform", GROWING + "B_u = [[1]]\n", RANGE),
    "B_u, cells: for a filter that takes time stamps": ("nonuniform", GROWING + "B_u = [[1]]\n", f"{RANGE} --cells 3"),
    "goal, leaves: for a filter that takes no time": (
        "nonuniform", GROWING, f"{RANGE} --stamps known --goal nominal --leaves 3",
    ),
}  # fmt: skip
"""What is told: of which method, for which file, with which options."""


@pytest.mark.parametrize("words", REFUSED)
def test_what_does_not_fit_is_told_and_nothing_is_written(
    words: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    method, text, options = REFUSED[words]
    (here / "own.toml").write_text(text, encoding="utf-8")
    infeasible = "no observer" in words or "no controller" in words
    assert main(["design", method, "own.toml", *options.split()]) == (3 if infeasible else 2)
    told = capsys.readouterr().err
    assert words in told and "Traceback" not in told
    assert [path.name for path in here.iterdir()] == ["own.toml"]


def test_gains_in_the_file_are_analysed(here: Path) -> None:
    text = (EXAMPLES / "servo.toml").read_text(encoding="utf-8")
    own = here / "own.toml"
    own.write_text("K = [[-1.0, -0.5]]\nL = [[1.0], [0.2]]\n" + text, encoding="utf-8")
    command = ["design", "dualrate", str(own), "--period", "0.02", "--ratio", "10"]
    assert main([*command, "--output", "a"]) == 0
    gains = json.loads((here / "a" / "gains.json").read_text(encoding="utf-8"))["gains"]
    assert gains["K"]["value"] == [[-1.0, -0.5]]


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
    assert run("dualrate", "--output", "/") == 2
    assert "/ exists" in capsys.readouterr().err
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
    monkeypatch.setattr(files.os, "access", lambda *_: False)
    assert run("dualrate") == 2
    assert f"{here} is no directory that can be written" in capsys.readouterr().err


def test_a_failure_while_writing_leaves_nothing(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run("dualrate", "--output", "out") == 0
    before = {path.name: path.read_bytes() for path in (here / "out").iterdir()}

    def fail(*_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files, "page", fail)
    assert run("dualrate", "--output", "out", "--force") == 2
    assert {path.name: path.read_bytes() for path in (here / "out").iterdir()} == before
    assert run("dualrate", "--output", "new") == 2
    assert [path.name for path in here.iterdir()] == ["out"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["multirate", "x.toml"], "the following arguments are required: --periods"),
        (["multirate", "x.toml", "--periods", "1,2.5"], "'2.5' is not a whole number from 1 on"),
        (["multirate", "x.toml", "--periods", "1", "--offsets", "-1"], "'-1' is not a whole number from 0 on"),
        (["multirate", "x.toml", "--periods", "1", "--level", "nan"], "'nan' is not a positive number"),
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


def test_a_range_of_periods_has_two_ends(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["design", "nonuniform", str(EXAMPLES / "spring.toml"), "--periods", "0.1"]) == 2
    assert "periods must be (h_l, h_u) in seconds" in capsys.readouterr().err


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
    assert all(f"  {field.name} " in text for field in METHODS[method].fields)
    options, words = METHODS[method].options.items(), " ".join(text.split())
    assert all(f"--{name} " in text and settings["help"] in words for name, settings in options)


def test_the_best_timing_is_searched_on_every_core(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    periods = (9, 9)
    plant = read_plant(EXAMPLES / "cart.toml", "multirate")
    alone = search_timing(MultiratePlant(**plant.values), periods)
    assert len(alone.optima) > FEW
    assert main(["design", "multirate", str(EXAMPLES / "cart.toml"), "--periods", "9,9", "--offsets", "best"]) == 0
    assert f"periods {periods}, offsets {alone.best}" in capsys.readouterr().out
    assert not Path("cart-multirate.timings").exists()
    for apply in (every_core, *[partial(every_core, store=here / "store")] * 2):
        assert search_timing(MultiratePlant(**plant.values), periods, apply=apply).optima == alone.optima
    kept = [*(here / "store" / "kept").iterdir()]
    search_timing(MultiratePlant(**{**plant.values, "dt": 0.25}), periods, apply=apply)
    assert len(kept) == len(alone.optima) and len([*kept[0].parent.iterdir()]) == 2 * len(kept)


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


@pytest.mark.parametrize("offsets", ["best", "0,0"])
def test_a_folder_of_the_users_beside_the_design_stays(offsets: str, here: Path) -> None:
    own = here / "cart-multirate.timings" / "mine.txt"
    own.parent.mkdir()
    own.write_text("keep")
    asked = ["design", "multirate", str(EXAMPLES / "cart.toml"), "--periods", "2,2", "--offsets", offsets]
    assert main(asked) == 0
    assert [path.name for path in own.parent.iterdir()] == ["mine.txt"]


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
