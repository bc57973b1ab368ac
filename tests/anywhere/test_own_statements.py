"""A paper's own statement stands with its certificates, and with no other."""

import json
from pathlib import Path
from typing import Any

import pytest

from replication.verify.run import check
from replication.verify.subjects import subject
from replication.verify.theorem import Refused

STATEMENTS = '''
from flint import fmpq
from replication.verify.reading import integer
from replication.verify.statement import BOTH, statement
from replication.verify.theorem import require

@statement("{name}", parameters={{"of": integer}}, bound=BOTH, says="square root [1]")
def root(of: int, lower: fmpq, upper: fmpq) -> None:
    """The root of {{of}} lies between {{lower:down 1}} and {{upper:up 1}}."""
    require(lower**2 < of < upper**2, "it does not")
'''
WANTED = {"name": "two", "claims": ["toy.root"], "statement": "toy.root", "plant": "", "parameters": {"of": 2}}


def project(root: Path, name: str = "toy.root", folder: str = "papers") -> Path:
    paper = root / folder / "toy"
    paper.mkdir(parents=True)
    (root / "replication.toml").write_text(f'papers = "{folder}"\n', encoding="utf-8")
    (paper / "theorems.json").write_text(json.dumps([WANTED]), encoding="utf-8")
    (paper / "statements.py").write_text(STATEMENTS.format(name=name), encoding="utf-8")
    return root


def certificate(root: Path, **changed: Any) -> dict[str, Any]:
    whole = {**subject("toy", "two", root), "bound": {"lower": "7/5", "upper": "3/2"}, "witness": {}}
    return {**whole, **changed}


@pytest.mark.parametrize("folder", ["papers", "texts"])
def test_it_is_found_beside_the_paper_and_exports_its_quantity(tmp_path: Path, folder: str) -> None:
    root = project(tmp_path, folder=folder)
    theorem = check(certificate(root), root)
    assert theorem.sentence == "The root of 2 lies between 1.4 and 1.5."
    (said,) = theorem.says
    assert (said.of.quantity, said.unit, said.of.setting) == ("square root [1]", "1", {"of": 2})


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"bound": {"lower": "3/2", "upper": "8/5"}}, "it does not"),
        ({"statement": "toy.other"}, "statement is not that of the wanted theorem"),
        ({"paper": None, "claims": []}, "there is no statement 'toy.root'"),
    ],
)
def test_what_it_does_not_prove_is_refused(tmp_path: Path, changed: dict[str, Any], reason: str) -> None:
    root = project(tmp_path)
    with pytest.raises(Refused, match=reason):
        check(certificate(root, **changed), root)


@pytest.mark.parametrize("name", ["multirate.gain", "other.root"])
def test_it_takes_no_name_of_another(tmp_path: Path, name: str) -> None:
    root = project(tmp_path, name)
    with pytest.raises(Refused, match=f"declares {name}, which must begin with toy."):
        check(certificate(root), root)


@pytest.mark.parametrize("papers", ['papers = "../out"', "papers = 3", 'papers = "a.b"', "papers ="])
def test_a_configuration_that_does_not_do_is_refused(tmp_path: Path, papers: str) -> None:
    root = project(tmp_path)
    (root / "replication.toml").write_text(papers + "\n", encoding="utf-8")
    with pytest.raises(Refused, match=r"replication\.toml"):
        subject("toy", "two", root)
