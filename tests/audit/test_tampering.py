"""Every field of a results file, changed by hand: refused, found by `check`, or listed as what nobody can derive."""

import json
import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from lab import Inside, Lab, make_inside
from tables import rows

from replication.audit.report import sections, templates
from replication.audit.report.page import build_report, numbers_of, require_sourced
from replication.audit.store.records import ResultsFile
from replication.errors import AuditError

TAKEN = {
    "run.date": "the time of the run",
    "run.commit": "the sources have this state or not whatever a commit is called; the keys hold their checksums",
    "run.dirty": "as the commit",
    "run.cpu": "a fact of the machine; what it changes, the kernel, is in the keys",
    "run.platform": "a fact of the machine",
    "run.python": "its last place, which is not in the keys",
    "run.blas": "versions of libraries, which those of the packages imply; the kernel must stand in it",
    "experiments.seconds": "measured; another number makes a note, for then the kept result is of another run",
}
"""Fields of a file that a change by hand leaves without a problem, with the reason; all others are derived."""

TAMPER = """
import functools, json
from pathlib import Path
from replication.audit.store import provenance
provenance.kernel = functools.cache(provenance.kernel)  # of this process, whatever a file says
from replication.audit.inspect.check import check, differences, kept
from replication.audit.model import Kind, Verdict
from replication.audit.project import find_project
from replication.audit.store.cache import Cache
from replication.audit.store.records import read_results
from replication.errors import AuditError

root, papers = Path.cwd(), find_project(Path.cwd())
content = json.loads((root / "report/results.json").read_bytes())
again = kept(papers.load(), root, Cache(root / ".cache/replication"))

def found(content):
    Path("tampered.json").write_text(json.dumps(content))
    try:
        results = read_results(Path("tampered.json"))
    except AuditError:
        return "refused"
    problems = map(str, check(results, papers.load(), root))
    return [*problems, *map(str, differences(results, again, root / "figures"))]

def others(value):
    if isinstance(value, bool):
        return [not value, None]
    if isinstance(value, (int, float)):
        return [value * 1.0000001 + 1e-9, -value - 1, None]
    if isinstance(value, str):
        words = [list(words) for words in (Verdict, Kind) if value in list(words)]
        return [*words[0]] if words else [value + "x", "", "9/7"]
    if value is None:
        return [1.5, 3, True, "x", "9/7", {}, {"lower": 0.0, "upper": 1.0, "how": "search"}]
    if isinstance(value, list):
        return [value[:-1], value + value[-1:]] if value else [[1.5], ["x"], [["1", "2"]]]
    fewer = [{key: entry for key, entry in value.items() if key != name} for name in value]
    return [{**value, "x": 1.5}, {**value, "x": "x"}, *fewer]

def places(value, path=()):
    yield path, value
    if isinstance(value, (dict, list)):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from places(value[key], (*path, key))

base, missed, tried = found(content), [], 0
for path, value in places(content):
    for other in others(value) if path else ():
        if json.dumps(other) == json.dumps(value):
            continue
        inner = functools.reduce(lambda whole, key: whole[key], path[:-1], content)
        inner[path[-1]] = other
        tried += 1
        same = found(content) == base
        inner[path[-1]] = value
        if same:
            missed.append((".".join(str(key) for key in path if isinstance(key, str)), repr(value), repr(other)))
print(json.dumps({"base": base, "missed": missed, "tried": tried}))
"""


PLANTS = """
from flint import fmpq, fmpq_mat

def plants(data):
    one = fmpq_mat([[1]])
    return {"scalar": {"A": one, "B": one, "C": one, "K": -2 * one, "L": 2 * one, "T": fmpq(1, 1000), "M": fmpq(5)}}
"""


def theorem(lab: Lab, name: str, claims: list[str], bound: dict[str, str], witness: dict[str, Any]) -> dict[str, Any]:
    """Write a certificate about the scalar loop; the entry that wants it."""
    entry = {
        "name": name,
        "claims": claims,
        "statement": f"dualrate.{name}",
        "plant": "scalar",
        "parameters": {"observer": "fast_sensor"},
    }
    one = [["1"]]
    plant = {"name": "scalar", "A": one, "B": one, "C": one, "K": [["-2"]], "L": [["2"]], "T": "1/1000", "M": "5"}
    certificate = {"format": "replication-certificate/1", "paper": "toy2020", **entry, "plant": plant}
    file = lab.root / "certificates" / "toy2020" / f"{name}.json"
    file.write_text(json.dumps({**certificate, "bound": bound, "witness": witness}), encoding="utf-8")
    return entry


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Inside:
    """A run with a theorem that is proved, and with something in the parts that are empty otherwise."""
    lab = make_inside(tmp_path_factory.mktemp("tampered"))
    lab.path("toy2020/plants.py").write_text(PLANTS, encoding="utf-8")
    (lab.root / "certificates" / "toy2020").mkdir(parents=True)
    radius = {"lower": "1094030315135/1099511627776", "upper": "273507688187/274877906944"}
    root = ["4481148954840129/4503599627370496", "128346116101713/576460752303423488"]
    wanted = [
        theorem(lab, "radius", [], radius, {"root": root}),
        theorem(lab, "stable", [], {}, {"radius": "1023/1024"}),
    ]
    lab.path("toy2020/theorems.json").write_text(json.dumps(wanted), encoding="utf-8")
    more = """sensitivity=lambda results: (Sensitivity(
        claim="square.two", parameter="x", printed="2", base=4.0, low=results["square"]["squares"][0],
        high=None),),
    common=lambda results: (CommonLevel(sensor="s", multiple=1, lower=1.0, upper=2.0, measure="m"),),
    findings="""
    lab.edit("toy2020/__init__.py", "findings=", more)
    lab.edit("toy2020/__init__.py", "import Formula", "import CommonLevel, Sensitivity, Formula")
    done = lab.cli("run")
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert "certificates: 2 of 2 proved" in done.stdout
    return lab


@pytest.mark.slow
def test_every_field_is_derived_or_on_the_list(ran: Inside) -> None:
    done = ran.python("-c", TAMPER)
    assert done.returncode == 0, done.stderr[-2000:]
    answer = json.loads(done.stdout)
    assert answer["base"] == [] and answer["tried"] > 1000
    missed = {re.sub(r"^run\.packages\..*", "run.packages", path) for path, _, _ in answer["missed"]}
    assert missed == TAKEN.keys(), [entry for entry in answer["missed"] if entry[0] not in TAKEN]


@pytest.mark.parametrize(
    "words",
    [
        {
            "figures/toy2020-fig1.svg": "toy2020-fig1: not derived: .*fig1.csv and .svg are not as the run left them",
            "certificates/toy2020/stable.json": "stable.json: certificate: the file is not the one",
        },
        {"PAPERS/toy2020/squares.py": "toy2020.square: not derived: sources, inputs or data are others now"},
    ],
)
def test_what_lies_beside_the_file_must_be_of_its_run(ran: Inside, words: dict[str, str], tmp_path: Path) -> None:
    lab = replace(ran, root=Path(shutil.copytree(ran.root, tmp_path / "copy")))
    for file in words:
        with (lab.root / file.replace("PAPERS", lab.package)).open("a", encoding="utf-8") as stream:
            stream.write("\n")
    done = lab.cli("check")
    assert done.returncode == 1
    assert all(re.search(text, done.stdout) for text in words.values()), done.stdout


def test_without_the_results_that_it_was_made_of_this_is_said(ran: Inside, tmp_path: Path) -> None:
    lab = replace(ran, root=Path(shutil.copytree(ran.root, tmp_path / "copy")))
    (lab.root / ".cache" / "replication" / "toy2020.square.json").unlink()
    done = lab.cli("check")
    assert done.returncode == 0
    assert "note: toy2020: the cache does not hold the results of this run" in done.stdout


# A number on the page that the results do not hold stops the build


SOURCE: dict[str, Any] = {
    "places": ["Table 1, column (2,3)", "2024-02-29T12:00:00Z", "version 1.17.1", "3.84(9) × 10^{-4} of 2^12"],
    "numbers": (0.63204, -1.7771, 3.7e-10, 73, 12345.6),
}


def sources_copied_to(directory: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the report's templates that is used from now on."""
    files = shutil.ignore_patterns("index.html", "results.json", "*-*")
    copied = shutil.copytree(templates.SOURCES, directory / "html", ignore=files)
    monkeypatch.setattr(templates, "SOURCES", copied)
    templates.environment.cache_clear()
    return copied


@pytest.fixture(autouse=True)
def own_templates() -> Iterator[None]:
    """No test leaves templates to the next one."""
    yield
    templates.environment.cache_clear()


def shows(text: str) -> bool:
    try:
        require_sourced({"": text}, SOURCE)
    except AuditError:
        return False
    return True


@pytest.mark.parametrize("text", rows("sourced"))
def test_numbers_of_the_results_may_stand_on_the_page(text: str) -> None:
    assert shows(text)


@pytest.mark.parametrize("text", rows("unsourced"))
def test_any_other_number_is_found(text: str) -> None:
    assert not shows(text)


def test_texts_count_in_the_results_only_and_an_exact_number_is_none() -> None:
    with pytest.raises(AuditError, match=r"'0\.64' in 'the level is 0\.64 here'.*take it from the results"):
        require_sourced({"": "<p>the level is 0.64 here</p>"}, SOURCE)
    require_sourced({"": "<p>0.64</p>"}, SOURCE, {"derived": (Fraction(16, 25),)})
    with pytest.raises(AuditError, match=r"0\.64"):
        require_sourced({"": "<p>0.64</p>"}, SOURCE, {"sentence": "the level is 0.64"})
    with pytest.raises(AuditError, match="4711"):
        require_sourced({"": "<p>4711</p>"}, {"intervals": (("4711/200", "5000/200"),)})


def test_numbers_are_found_at_any_depth(made: ResultsFile) -> None:
    found = list(numbers_of({"results": [made]}))
    assert made.claims[0].evidence.value in found
    assert made.experiments[0].inputs["tolerance"] in found
    assert not [number for number in found if isinstance(number, bool)]


def test_a_number_typed_into_a_template_stops_the_build(
    made: ResultsFile, figures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copied = sources_copied_to(tmp_path, monkeypatch)
    assert build_report(made, figures, tmp_path / "index.html").is_file()
    words = copied / "words.html.j2"
    words.write_text(words.read_text() + "<p>They were judged within 4711 seconds.</p>\n")
    templates.environment.cache_clear()
    with pytest.raises(AuditError, match="within 4711 seconds"):
        build_report(made, figures, tmp_path / "other.html")
    assert not (tmp_path / "other.html").exists()


def test_what_a_section_derives_is_handed_over_as_a_number(
    made: ResultsFile, figures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (sources_copied_to(tmp_path, monkeypatch) / "cite.html.j2").write_text("<p>{{ shown.text }}</p>\n")

    def shown(content: dict[str, Any]) -> None:
        monkeypatch.setattr(sections, "_SECTIONS", (("cite", "Derived", lambda results, read: content),))

    shown({"text": "0.4711"})
    with pytest.raises(AuditError, match=r"0\.4711"):
        build_report(made, figures, tmp_path / "index.html")
    shown({"text": "0.4711", "number": 0.4711})
    assert build_report(made, figures, tmp_path / "index.html").is_file()
