"""Plant files with mistakes of all kinds: every one is reported, with its path, at once, and nothing else happens."""

import importlib
import inspect
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from replication.errors import InvalidInputError
from replication.ownplant.files import MAX_BYTES, MAX_ENTRIES, read_plant
from replication.ownplant.methods import LOSSES, METHODS, Kind

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
GOOD = {
    "multirate": "A = [[0.5]]\nB_d = [[1.0]]\nC = [[1.0]]\nD = [[1]]\n",
    "nonuniform": "A = [[-0.5]]\nB = [[1.0, 0.0]]\nC = [[1.0]]\nD = [[0, 1]]\nL = [[1]]\n",
    "dualrate": "A = [[-0.5]]\nB = [[1.0]]\nC = [[1.0]]\n",
    "delay": "A0 = [[-0.5]]\nA = [[[0.1]]]\ndelays = [1]\nB = [[1.0]]\nC10 = [[1.0]]\nC2 = [[1]]\n",
}


def write(folder: Path, text: str, name: str = "plant.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def message(folder: Path, text: str, method: str = "multirate") -> str:
    with pytest.raises(InvalidInputError) as caught:
        read_plant(write(folder, text), method)
    return str(caught.value)


@pytest.mark.parametrize("method", METHODS)
def test_a_small_file_is_read(method: str, tmp_path: Path) -> None:
    plant = read_plant(write(tmp_path, GOOD[method], "my-plant.toml"), method)
    assert (plant.name, plant.title, plant.method, plant.names) == ("my-plant", "my-plant", method, {})
    assert set(plant.values) == {field.name for field in METHODS[method].fields if field.required}


def test_every_mistake_is_reported_with_its_path(tmp_path: Path) -> None:
    text = (
        'name = "../x"\ntitel = "a"\nmethod = "delay"\ntime_unit = "ms"\ndt = "0.1 s"\n'
        'A = [[1.0, nan], ["x", 0.98]]\nB_d = [[0.0]]\nC = [[0.0, 1.0], [1.0]]\nD = [[0.5, 0.0], [0.0, true]]\nW = 3\n'
        '[names]\nstates = ["a", "a"]\ninput = ["u"]\n'
    )
    lines = message(tmp_path, text).splitlines()
    assert lines[0].endswith("has 12 mistakes:")
    expected = {
        "titel": "did you mean title?",
        "name": "files are called after it, got '../x'",
        "method": "the file is for 'delay', the command for 'multirate'",
        "time_unit": "must be 's', got 'ms'; convert",
        "A[0][1]": "nan is not finite",
        "A[1][0]": "'x' is not a number",
        "C": "its rows have different lengths, [2, 1]",
        "D[1][1]": "True is not a number",
        "W": "must be a list of rows",
        "dt": "'0.1 s' is not a number; write it without quotes and unit",
        "names.states": "a name stands there twice",
        "names.input": "did you mean inputs?",
    }
    found = dict(line.strip().split(": ", 1) for line in lines[1:])
    assert found.keys() == expected.keys()
    assert all(words in found[path] for path, words in expected.items())


def test_shapes_are_compared_across_the_file(tmp_path: Path) -> None:
    text = "A = [[1, 0], [0, 1]]\nB_d = [[1], [1], [1]]\nC = [[1, 0, 0]]\nD = [[1], [1]]\n[names]\nstates = ['a']\n"
    assert message(tmp_path, text).splitlines()[1:] == [
        "  B_d: has 3 rows, where A sets n = 2",
        "  C: has 3 columns, where A sets n = 2",
        "  D: has 2 rows, where C sets q = 1",
        "  names.states: has 1 names for 2 states",
    ]
    assert "A: has 2 columns, where itself has another number" in message(tmp_path, "A = [[1, 0]]\n")


def test_several_matrices_are_compared_with_the_number_of_delays(tmp_path: Path) -> None:
    text = GOOD["delay"].replace("[[[0.1]]]", "[[[0.1]], [[1, 2]]]")
    lines = message(tmp_path, text, "delay").splitlines()
    assert "  A[1]: has 2 columns, where A0 sets n = 1" in lines
    assert "  delays: has 1 entries, where A sets k = 2" in lines


@pytest.mark.parametrize("method", METHODS)
def test_text_as_windows_writes_it_is_read(method: str, tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD[method].replace("\n", "\r\n").encode())
    assert read_plant(path, method).values == read_plant(write(tmp_path, GOOD[method], "other.toml"), method).values


def test_times_that_are_not_positive_are_listed_with_the_rest(tmp_path: Path) -> None:
    text = GOOD["multirate"].replace("[[0.5]]", "[[nan]]") + "dt = -0.1\n"
    assert message(tmp_path, text).splitlines()[1:] == [
        "  A[0][0]: nan is not finite",
        "  dt: must be positive, got -0.1",
    ]
    assert "delays[0]: must be positive, got 0" in message(tmp_path, GOOD["delay"].replace("[1]", "[0]"), "delay")


@pytest.mark.parametrize("method", METHODS)
def test_what_is_missing_is_listed(method: str, tmp_path: Path) -> None:
    text = message(tmp_path, "", method)
    for field in METHODS[method].fields:
        assert (f"{field.name}: is missing; write {field.kind}" in text) is field.required


def test_a_covariance_stands_for_its_factor(tmp_path: Path) -> None:
    text = (
        GOOD["multirate"]
        .replace("B_d = [[1.0]]", "Q = [[4.0]]")
        .replace("D = [[1]]", "R = [[9]]\nS = [[2]]\nP0 = [[1]]")
    )
    assert set(read_plant(write(tmp_path, text), "multirate").values) == {"A", "C", "Q", "R", "S", "P0"}
    lines = message(tmp_path, text.replace("R = [[9]]", "").replace("S = [[2]]", "S = [[2, 1]]")).splitlines()[1:]
    assert lines == [
        "  D: is missing; write a list of rows, such as [[1, 0], [0, 1]], or give R",
        "  S: has 2 columns, where C sets q = 1",
    ]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("R = [9, 1]", "R: has 2 entries, where C sets q = 1"),
        ("R = [9, [1]]", "R[1]: [1] is not a number"),
        ("R = []", "R: must be a list of rows"),
        ("latency = [-0.1]", "latency[0]: must be at least 0"),
        ("latency = [0, 0.1]", "latency: has 2 entries"),
    ],
)
def test_variances_and_latencies_may_be_lists(line: str, said: str, tmp_path: Path) -> None:
    text = GOOD["multirate"].replace("D = [[1]]", "R = [9]")
    for R in ("[9]", "[[9]]"):
        values = read_plant(write(tmp_path, text.replace("[9]", R)), "multirate").values
        assert np.ravel(values["R"]).tolist() == [9]
    kept = text.replace("R = [9]\n", "") if line.startswith("R") else text
    assert said in message(tmp_path, f"{kept}{line}\n")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("A = [[1]]\nB_d = [[1]]\nA = [[2]]\n", "): 'A = [[2]]'"),
        ("A = [[1\n", "is not TOML"),
        ("A = [[1, ]\n[names]\n[names]\n", "is not TOML"),
        ("a" * 3, "is not TOML"),
        ("A = " + "[" * 5000 + "]" * 5000, "nested too deeply"),
        (f"A = [[{'9' * 5000}]]", "a number that cannot be read"),
        (f"A = [[{'9' * 400}]]", "A[0][0]: "),
        ("A = [[1e400]]", "A[0][0]: inf is not finite"),
        ("A = [[-inf]]", "A[0][0]: -inf is not finite"),
        ("A = [[1979-05-27]]", "is not a number"),
        ("A = [[{ x = 1 }]]", "is not a number"),
        ("A = [1, 2]", "A: must be a list of rows"),
        ("A = []", "A: must be a list of rows"),
        ("A = [[]]", "A: "),
        ("names = 3", "names: must be a table"),
        ("title = 'a\\nb'\ntime_unit = 3", "time_unit: must be 's', got 3"),
        ('title = "a\\u0000b"', "title: must be one line"),
        ("title = 3", "title: must be one line"),
    ],
)
def test_odd_files_are_refused(text: str, words: str, tmp_path: Path) -> None:
    assert words in message(tmp_path, text)


@pytest.mark.parametrize(
    "name", ["../x", "/etc/x", "a/b", "a\\\\b", "", ".", "..", "-x", "a" * 41, "a\\u0000b", "é", "CON:", "a b", "~"]
)
def test_names_that_would_lead_elsewhere_are_refused(name: str, tmp_path: Path) -> None:
    assert "name: must start with a letter" in message(tmp_path, f'name = "{name}"\n{GOOD["multirate"]}')


def test_matrices_of_a_million_entries_are_refused_with_the_limit(tmp_path: Path) -> None:
    row = "[" + "0," * 1000 + "]"
    text = f"A = [{','.join([row] * 1000)}]"
    assert len(text) > MAX_BYTES
    assert f"is larger than {MAX_BYTES} bytes" in message(tmp_path, text)
    smaller = f"A = [{','.join([row] * 100)}]"
    assert f"A: has 100000 entries, more than {MAX_ENTRIES}; pass" in message(tmp_path, smaller)
    many = message(tmp_path, f"delays = [{'0,' * (MAX_ENTRIES + 1)}]", "delay")
    assert f"delays: has {MAX_ENTRIES + 1} entries, more than {MAX_ENTRIES}; pass" in many


def test_many_mistakes_are_counted(tmp_path: Path) -> None:
    text = message(tmp_path, f"A = [{', '.join(['[true]'] * 100)}]")
    assert "has 103 mistakes" in text and text.endswith("and 83 more") and len(text.splitlines()) == 22


def test_files_that_are_none_are_refused(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (tmp_path, tmp_path / "nowhere", pipe, Path("a\0b"), Path("/dev/zero")):
        with pytest.raises(InvalidInputError, match="is not a file"):
            read_plant(path, "multirate")
    with pytest.raises(OSError, match="too long"):
        read_plant(tmp_path / ("x" * 300), "multirate")
    (tmp_path / "latin").write_bytes(b"title = '\xe9'")
    with pytest.raises(InvalidInputError, match="is not UTF-8 text"):
        read_plant(tmp_path / "latin", "multirate")


@settings(max_examples=25)
@given(st.recursive(st.none() | st.booleans() | st.floats() | st.text(), lambda inner: st.lists(inner, max_size=4)))
def test_any_matrix_is_read_or_refused_by_name(value: object) -> None:
    """Whatever stands in place of a matrix: a finite rectangle of numbers, or a list of what is wrong with it."""
    from replication.ownplant.files import _nested

    problems: list[str] = []
    matrix = _nested("A", value, 2, Kind.MATRIX, problems)
    assert (matrix is None) == bool(problems)
    assert all(problem.startswith("A") for problem in problems)


@pytest.mark.parametrize("method", METHODS)
def test_every_option_is_an_argument_of_the_design_in_the_library(method: str) -> None:
    room = importlib.import_module(f"replication.estimation.{method}")
    taken = inspect.signature(room.design).parameters
    # `stamps` says which of both designs it is.
    more = {"stamps", *inspect.signature(room.design_stamped).parameters} if method == "nonuniform" else set()
    options = METHODS[method].options
    assert options.keys() - set(LOSSES) <= {*taken, *more}
    required = {name for name, argument in taken.items() if argument.default is argument.empty} - {"plant"}
    assert {name for name, settings in options.items() if settings.get("required")} == required


def test_examples_are_good_plants() -> None:
    of = {"cart": "multirate", "spring": "nonuniform", "load": "nonuniform", "servo": "dualrate"}
    assert {path.stem for path in EXAMPLES.glob("*.toml")} > of.keys()
    for path in EXAMPLES.glob("*.toml"):
        assert read_plant(path, of.get(path.stem, "delay")).name == path.stem


MOVING = {"A_c": [[0, 1], [-4, -0.3]], "B_d": [[0], [1]], "C": [[1, 0], [0, 1]], "D": [[0.1, 0], [0, 0.2]], "dt": 0.2}


def test_the_latency_of_a_file_is_in_seconds_and_that_of_the_command_line_in_base_periods() -> None:
    make = METHODS["multirate"].design
    plain, late = make(MOVING, periods=[1, 3]), make({**MOVING, "latency": [0.0, 0.3]}, periods=[1, 3])
    assert plain.value < late.value
    assert make(MOVING, periods=[1, 3], latency=[0, 1.5]).value == pytest.approx(late.value, rel=1e-9)


def test_options_of_losses_make_a_design_for_them() -> None:
    make = METHODS["multirate"].design
    plain, row = make(MOVING, periods=[1, 3]), make(MOVING, periods=[1, 3], misses=[0, 1])
    assert row.value > plain.value and "at most 0, 1 lost in a row" in str(row)
    drawn, bursts = (make(MOVING, periods=[1, 3], lost=[0.1], **more) for more in ({}, {"burst": [0.5]}))
    assert drawn.value < bursts.value
    packets = make(MOVING, periods=[1, 3], lost=[0.1], packets="together")
    assert "in one packet" in str(packets)
    with pytest.raises(InvalidInputError, match="not both"):
        make(MOVING, periods=[1, 3], lost=[0.1], misses=[1])
    with pytest.raises(InvalidInputError, match="burst is"):
        make(MOVING, periods=[1, 3], burst=[0.1])
    with pytest.raises(InvalidInputError, match="A_c needs"):
        make({**MOVING, "A": [[1, 0], [0, 1]]}, periods=[1, 3])
