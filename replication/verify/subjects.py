"""What a certificate must be about: the plants and the wanted theorems of the papers, read as data.

`papers/<key>/printed.toml` holds what the paper prints, `plants.py` beside it makes the plants of that in exact numbers
(loaded from its file alone), and `theorems.json` lists the wanted theorems, and the claims for which none is possible.
"""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any

from replication.verify.reading import Reader, name_of, no_number, parse, record, sequence, text, written
from replication.verify.theorem import Refused, require, same

FORMAT = "replication-certificate/1"
ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """One entry of theorems.json: a theorem that is to be proved, and the claims that it supports."""

    paper: str
    name: str
    claims: tuple[str, ...]
    statement: str
    plant: str
    parameters: Mapping[str, Any]


@dataclass(frozen=True)
class Unproved:
    """Claims of kind value, bound or feasible that are no theorems, with the reason."""

    claims: tuple[str, ...]
    reason: str


def folder_of(root: Path) -> Path:
    """Where the papers of the project at `root` lie, by its configuration; in `papers` if that does not say."""
    settings = tables(root / "replication.toml", parse_float=float)
    name = text(settings.get("papers", "papers"), "replication.toml: papers")
    require(name.isidentifier() and name.isascii(), f"replication.toml: papers must be a name of Python, got {name}")
    return root / name


def tables(path: Path, parse_float: Callable[[str], Any] = no_number) -> dict[str, Any]:
    """The tables of a TOML file; none if there is no such file."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"), parse_float=parse_float) if path.is_file() else {}
    except ValueError as error:  # also where it is no text
        raise Refused(f"{path.name} is not valid TOML: {error}") from None


def _texts(value: Any, path: str) -> tuple[str, ...]:
    return tuple(sequence(value, path, text))


def _object(value: Any, path: str) -> Mapping[str, Any]:
    require(isinstance(value, dict), f"{path} must be an object")
    return dict(value)


UNPROVED: Mapping[str, Reader] = {"claims": _texts, "reason": text}
WANTED: Mapping[str, Reader] = {
    "name": name_of, "claims": _texts, "statement": text, "plant": text, "parameters": _object
}  # fmt: skip


def theorems(paper: str, root: Path = ROOT) -> tuple[dict[str, Wanted], tuple[Unproved, ...]]:
    """The wanted theorems of a paper by name, and its claims without one; raises Refused for a malformed list."""
    path = folder_of(root) / paper / "theorems.json"
    wanted: dict[str, Wanted] = {}
    unproved = []
    listed = path.relative_to(root).as_posix()
    entries = sequence(parse(path.read_bytes()), listed, lambda entry, _: entry) if path.is_file() else []
    for i, entry in enumerate(entries):
        where = f"{listed}[{i}]"
        if isinstance(entry, dict) and "reason" in entry:
            unproved.append(Unproved(**record(entry, where, UNPROVED)))
        else:
            theorem = Wanted(paper=paper, **record(entry, where, WANTED))
            require(theorem.name not in wanted, f"{where}: the name {theorem.name} stands twice")
            wanted[theorem.name] = theorem
    return wanted, tuple(unproved)


def papers(root: Path = ROOT) -> tuple[str, ...]:
    """The papers that list theorems."""
    return tuple(sorted(path.parent.name for path in folder_of(root).glob("*/theorems.json")))


def subject(paper: str, name: str, root: Path = ROOT) -> dict[str, Any]:
    """What the certificate of a wanted theorem must say of itself: all its fields but `bound` and `witness`."""
    require(paper in papers(root), f"there is no paper {paper!r:.60} that lists theorems")
    listed, _ = theorems(paper, root)
    require(name in listed, f"the paper {paper} wants no theorem named {name}")
    wanted = listed[name]
    entry = {field: getattr(wanted, field) for field in WANTED} | {"claims": [*wanted.claims]}
    return {"format": FORMAT, "paper": paper, **entry, "plant": plant(paper, wanted.plant, root)}


def plant(paper: str, name: str, root: Path = ROOT) -> dict[str, Any]:
    """A plant of a paper as certificates write it; the name "" stands for no plant."""
    if not name:
        return {"name": ""}
    folder = folder_of(root) / paper
    module = loaded(folder / "plants.py")
    plants = module.plants(printed(folder / "printed.toml")) if module else {}
    require(name in plants, f"the paper {paper} has no plant named {name!r}; there are {', '.join(plants) or 'none'}")
    return {"name": name, **written(plants[name])}


def printed(path: Path) -> dict[str, Any]:
    """The printed values of a paper by name: strings, integers, and lists and tables of them; no float."""
    values = tables(path)
    for name, table in values.items():
        require(isinstance(table, dict) and "value" in table, f"{path.name}: [{name}] has no value")
    return {name: table["value"] for name, table in values.items()}


def loaded(path: Path) -> ModuleType | None:
    """A module of a paper, from its file alone; None if there is no such file."""
    if not path.is_file():
        return None
    loader = SourceFileLoader(f"{path.stem} of {path.parent.name}", str(path))
    module = ModuleType(loader.name)
    loader.exec_module(module)
    return module


# All that the three functions below can do is to refuse: the sentence of a theorem does not depend on them. They keep a
# file from standing for a theorem of a paper that it does not prove.


def require_form(values: Mapping[str, Any], place: tuple[str, str] | None) -> None:
    """Refuse another format, what are no names, other sides of a bound, and a paper or name that its place has not."""
    require(values["format"] == FORMAT, f"the format is {values['format']!r:.40}, not {FORMAT}")
    name = name_of(values["name"], "name")
    if isinstance(values["plant"], dict) and values["plant"].get("name", "") != "":
        name_of(values["plant"]["name"], "plant.name")
    if place is not None:
        require(
            same([values["paper"], name], list(place)),
            f"where it lies there must be the theorem {place[1]!r:.90} of the paper {place[0]!r:.90}",
        )
    sides = values["bound"]
    require(isinstance(sides, dict) and set(sides) <= {"lower", "upper"}, "bound must hold lower, upper, or nothing")
    if values["paper"] is None:
        require(values["claims"] == [], "a certificate that belongs to no paper supports no claims")
    else:
        text(values["paper"], "paper")


def wanted_at(path: Path, root: Path) -> tuple[str, str] | None:
    """The paper and the name of the theorem for which the file at `path` stands; None outside root/certificates."""
    # A link to a file stands for a theorem by where it lies, wherever it leads; a link to a folder does by either.
    located = path.parent.resolve() / path.name
    for file, folder in ((path.absolute(), root.absolute()), (located, root.resolve())):
        if file.is_relative_to(folder / "certificates"):
            return file.parent.relative_to(folder / "certificates").as_posix(), file.stem
    return None


def require_file(certificate: Mapping[str, Any], path: Path) -> None:
    """Refuse a file about a paper under another name than that of its theorem."""
    if certificate["paper"] is not None:
        expected = Path(certificate["paper"]) / f"{certificate['name']}.json"
        require(path.resolve().parts[-2:] == expected.parts, f"the file should be {expected.as_posix()}")
