"""What a certificate must be beside what it proves: its format, its names, and the theorem for which its place stands.

All that this module can do is to refuse: the sentence of a theorem does not depend on it, so that nothing here need be
trusted for that. It keeps a file from standing for a theorem of a paper that it does not prove.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from replication.verify.predicate import same
from replication.verify.reading import name_of, text
from replication.verify.subjects import FORMAT
from replication.verify.theorem import require


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
