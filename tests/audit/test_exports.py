"""Exports of a toy run: files that their readers can read, and an archive that packs, checks and rebuilds itself."""

import hashlib
import json
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import pytest
from cases import altered
from lab import Inside, committed, make_inside

from replication.audit.publish import archive
from replication.audit.publish.archive import archive_name, badge, changed_files, export_texts, unfilled
from replication.audit.publish.linked_data import Person, media_type, read_software
from replication.audit.store.records import ResultsFile
from replication.errors import AuditError
from replication.scaffold import scaffold

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def texts(made: ResultsFile) -> dict[str, str]:
    return export_texts(made, read_software(ROOT))


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> Inside:
    """A toy project under git, run and packed."""
    lab = make_inside(tmp_path_factory.mktemp("project") / "toy")
    shutil.copy(ROOT / "CITATION.cff", lab.root)
    (lab.root / ".gitignore").write_text("report/\n.cache/\n*.zip\n", encoding="utf-8")
    (lab.root / "fit.sh").touch(0o755)
    committed(lab.root)
    assert lab.cli("run", "--jobs", "1").returncode == 0
    assert lab.cli("artifact", "--to", "one.zip").returncode == 0
    return lab


def unpack(lab: Inside, where: Path) -> Inside:
    with zipfile.ZipFile(lab.root / "one.zip") as archive:
        archive.extractall(where)
    (where / "one" / "fit.sh").chmod(0o755)  # as `unzip` does, and zipfile does not
    return replace(lab, root=where / "one")


def test_linked_data_has_each_claim_with_its_verdict(texts: dict[str, str], made: ResultsFile) -> None:
    graph = json.loads(texts["claims.jsonld"])["@graph"]
    reviews = {node["@id"]: node["reviewRating"]["alternateName"] for node in graph if node["@type"] == "ClaimReview"}
    assert reviews == {f"#claim-{claim.id}": str(claim.verdict) for claim in made.claims}
    named = {node["@id"] for node in graph}
    assert {node["itemReviewed"]["appearance"]["@id"] for node in graph if "itemReviewed" in node} <= named


def test_bibtex_names_the_package_and_every_paper(texts: dict[str, str], made: ResultsFile) -> None:
    assert texts["citation.bib"].startswith("@software{")
    assert all(paper.bibtex in texts["citation.bib"] for paper in made.papers)


def label(drawing: str) -> str:
    return str(ET.fromstring(drawing).get("aria-label"))


def test_badge_counts_what_holds_is_possible_fails_and_is_undetermined_or_what_moved(made: ResultsFile) -> None:
    """In word, shape and colour."""
    pinned = tuple(claim for claim in made.claims if not claim.unexpected)
    kinds = {
        "hold": ("reproduced", "reproduced after erratum", "consistent"),
        "possible": ("compatible",),
        "fail": ("differs", "refuted"),
        "undetermined": ("undetermined",),
    }
    found = {word: sum(claim.verdict in verdicts for claim in pinned) for word, verdicts in kinds.items()}
    assert min(found.values()) > 0
    words = ", ".join(f"{number} {word}{'s' * (word == 'fail' and number == 1)}" for word, number in found.items())
    assert label(badge("a <b> & c", pinned)).startswith(f"a <b> & c: {words}")
    moved = len(made.claims) - len(pinned)
    assert moved and label(badge("x", made.claims)) == f"x: {moved} off the pin"
    agree = tuple(claim for claim in pinned if claim.verdict not in kinds["fail"])
    false = next(altered(claim, place="Theorem 1") for claim in pinned if claim.verdict == "refuted")
    drawings = [ET.fromstring(badge("x", chosen)) for chosen in (agree, pinned, (*agree, false))]
    paths = [list(drawing.iter("{http://www.w3.org/2000/svg}path")) for drawing in drawings]
    assert len({path[0].get("fill") for path in paths}) == len({path[1].get("d") for path in paths}) == 3


def test_an_author_is_a_person_with_an_orcid_unless_the_name_says_otherwise() -> None:
    for person in (Person(name="A. Author"), Person(family_names="Author", given_names="A.")):
        assert person.linked["@type"] == "Person"
    for name in ("The sleep study developers", "LIGO Scientific Collaboration"):
        assert Person(name=name).linked["@type"] == "Organization"
    known = Person(name="A. Author", orcid="https://orcid.org/0000-0002-1825-0097")
    assert known.linked["@id"] == known.orcid and known.plain_orcid == "0000-0002-1825-0097"


def test_media_types_do_not_depend_on_the_machine() -> None:
    types = {"a.json": "application/json", "a.svg": "image/svg+xml", "a.py": "text/x-python"}
    assert {name: media_type(name) for name in (*types, "LICENSE")} == {
        **types,
        "LICENSE": "application/octet-stream",
    }


def test_citation_file_with_a_mistake_is_named(tmp_path: Path) -> None:
    with pytest.raises(AuditError, match=r"CITATION.cff is missing"):
        read_software(tmp_path)
    author = "authors: [{name: A, orcid: https://orcid.org/0000-0002-1825-0098}]"
    for text, said in (("title: [1]\n", "title"), (author, "is none; copy it from orcid.org")):
        (tmp_path / "CITATION.cff").write_text(text, encoding="utf-8")
        with pytest.raises(AuditError, match=said):
            read_software(tmp_path)


@pytest.mark.slow
def test_archive_is_the_same_twice_and_holds_all(packed: Inside) -> None:
    assert packed.cli("artifact", "--to", "two.zip").returncode == 0
    with zipfile.ZipFile(packed.root / "one.zip") as first, zipfile.ZipFile(packed.root / "two.zip") as second:
        assert {name.partition("/")[2]: first.read(name) for name in first.namelist()} == {
            name.partition("/")[2]: second.read(name) for name in second.namelist()
        }
        inside = {entry.filename.partition("/")[2]: entry.external_attr >> 16 & 0o111 for entry in first.infolist()}
    wanted = ("report/index.html", "report/results.json", "requirements.lock", "exports/badges/all.svg", "COMMIT")
    assert inside.keys() >= {*wanted}
    assert {name for name, runs in inside.items() if runs} == {"fit.sh"} and inside["fit.sh"] == 0o111


@pytest.mark.slow
def test_unpacked_archive_rebuilds_checks_and_packs_itself(packed: Inside, tmp_path: Path) -> None:
    """And describes its files, with their checksums."""
    inside = unpack(packed, tmp_path)
    crate = json.loads((inside.root / "ro-crate-metadata.json").read_text(encoding="utf-8"))
    nodes: dict[str, Any] = {node["@id"]: node for node in crate["@graph"]}
    described = [nodes[part["@id"]] for part in nodes["./"]["hasPart"]]
    assert described
    for node in described:
        assert node["sha256"] == hashlib.sha256((inside.root / node["@id"]).read_bytes()).hexdigest()
    subprocess.run(["sha256sum", "--check", "--quiet", "SHA256SUMS"], cwd=inside.root, check=True)
    assert inside.cli("check").returncode == 0
    assert inside.cli("artifact", "--to", "one.zip").returncode == 0
    assert (inside.root / "one.zip").read_bytes() == (packed.root / "one.zip").read_bytes()
    done = inside.cli("run", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    rebuilt, stored = (json.loads((lab.root / "report/results.json").read_text()) for lab in (inside, packed))
    assert rebuilt["run"]["commit"] == stored["run"]["commit"] != "unknown"
    values = [[claim["evidence"]["value"] for claim in file["claims"]] for file in (rebuilt, stored)]
    assert values[0] == values[1]


@pytest.mark.slow
def test_changed_file_of_an_archive_is_found(packed: Inside, tmp_path: Path) -> None:
    inside = unpack(packed, tmp_path)
    assert inside.cli("artifact", "--check", ".").stdout == "0 files changed\n"
    inside.edit("toy2020/squares.py", "product", "multiple")
    (inside.root / "report" / "index.html").unlink()
    done = inside.cli("artifact", "--check", ".")
    assert done.returncode == 1
    assert "papers/toy2020/squares.py: changed" in done.stdout and "report/index.html: missing" in done.stdout
    assert "sources of this archive were changed (papers/toy2020" in inside.cli("artifact").stderr


@pytest.mark.slow
def test_edited_sources_are_not_packed(packed: Inside, tmp_path: Path) -> None:
    edited = replace(packed, root=Path(shutil.copytree(packed.root, tmp_path / "copy")))
    edited.edit("toy2020/squares.py", "Squares", "Cubes")
    done = edited.cli("artifact")
    assert done.returncode == 2
    assert "commit, then `replication run`" in done.stderr
    assert not (edited.root / "dist").exists()


def test_what_a_new_project_leaves_to_be_written_is_named(tmp_path: Path) -> None:
    scaffold("moss", tmp_path)
    assert [line.partition(" still says ") for line in unfilled(tmp_path)] == [
        ("CITATION.cff", " still says ", "'WHAT IS AUDITED', which is for you to write"),
        ("papers/moss/paper.toml", " still says ", "'TITLE', which is for you to write"),
    ]
    for path in (tmp_path / "CITATION.cff", tmp_path / "papers/moss/paper.toml"):
        path.write_text(re.sub("A. AUTHOR|WHAT IS AUDITED|TITLE|In your own words", "Moss", path.read_text()))
    assert unfilled(tmp_path) == []


@pytest.mark.parametrize(
    ("content", "message"),
    [
        *(
            (f"{line}\n".encode(), "line 1")
            for line in ("x  a", f"{'0' * 64}  ../a", f"{'0' * 64}  /etc/passwd", "0" * 64)
        ),
        (b"", "lists no file; unpack"),
        (b"\xff\xfe\x00", "is no list of checksums .*; unpack"),
    ],
)
def test_a_manifest_that_leads_out_or_is_none_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "SHA256SUMS").write_bytes(content)
    with pytest.raises(AuditError, match=message):
        changed_files(tmp_path)


def test_an_archive_is_called_after_its_project(tmp_path: Path) -> None:
    rest = 'abstract: A\nversion: "1.2"\nlicense: MIT\nauthors: [{name: A. Author}]\n'
    for title, name in (("The probable error", "the-probable-error"), ("Gosset (1908): anew", "gosset-1908")):
        (tmp_path / "CITATION.cff").write_text(f'title: "{title}"\n{rest}')
        assert archive_name(tmp_path) == f"{name}-1.2-artifact.zip"


def test_a_folder_that_git_does_not_know_is_not_packed(tmp_path: Path) -> None:
    with pytest.raises(AuditError, match=r"is no checkout of git, .* `git init`, .*`git commit`"):
        archive._sources(tmp_path)


@pytest.mark.parametrize(
    ("program", "code", "told", "second"),
    [
        (None, 0, "", "# Without checksums of the files: neither uv nor pip-compile is here."),
        ("/bin/uv", 1, "it is\nnot reached", "# Without checksums of the files: uv: not reached."),
        ("/bin/pip-compile", 0, "", "numpy==1 --hash=sha256:0"),
    ],
)
def test_a_lock_has_checksums_or_says_why_not(program: str | None, code: int, told: str, second: str) -> None:
    done = SimpleNamespace(returncode=code, stdout="numpy==1 --hash=sha256:0\n", stderr=told)
    with (
        patch.object(archive.shutil, "which", lambda name, path: program if program and name in program else None),
        patch.object(archive.subprocess, "run", return_value=done) as asked,
    ):
        lines = [line for line in archive.lock_text(ask=True).splitlines() if "from no index" not in line]
    assert lines[1] == second and asked.call_count == (program is not None)
    assert ("numpy==1" in lines[1]) or any(re.match("numpy==[0-9.]+$", line) for line in lines)
