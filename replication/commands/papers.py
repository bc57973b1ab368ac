"""`replication new`, `guide` and `coverage`: a new paper, how to audit it, and what of the texts of papers is bound."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from replication.commands import DIFFERENT, FINE, command, here, option, say
from replication.errors import InvalidInputError

if TYPE_CHECKING:
    from replication.audit.inspect.coverage import Text


@command(
    "new",
    "make the package of a new paper with claims, a figure, a table and tests, ready to run",
    option("key", metavar="KEY", help="name of the package in papers/, for example gosset1908"),
    option("--tables", action="store_true", help="of a paper whose numbers are read from tables, without any Python"),
    option("--ci", action="store_true", help="also write workflow, container, lock and wheel of the program"),
    notes="""\
What it writes runs as it is; `replication guide adding-a-paper` walks through making it yours. In a folder that
belongs to no project it begins one: replication.toml says what it is called, and where its papers lie.
With --ci it also writes what a service or a stranger needs to run the audit: a GitHub workflow, a Dockerfile, the
page REBUILD.md, a lock of the packages that are installed here, and this program as a wheel. Files that are there stay.

""",
)
def new(chosen: argparse.Namespace) -> int:
    """Write the files and name them; `--ci` alone completes a project that has the paper."""
    from replication.audit.project import read_settings, root_above
    from replication.scaffold import scaffold

    root = root_above(Path.cwd()) or Path.cwd()
    exists = (root / read_settings(root).papers / chosen.key).is_dir()
    if not (chosen.ci and exists):
        say(map(str, scaffold(chosen.key, root, tables=chosen.tables)))
    if chosen.ci:
        from replication.audit.publish.archive import BARE, rebuild_files
        from replication.audit.store.provenance import LOCK
        from replication.files import write_atomically

        for name, data in rebuild_files(root, ask=True).items():
            write_atomically(root / name, data)
            lacks = name == LOCK and data.decode().splitlines()[1].removeprefix("# ")
            say([f"{root / name}: {lacks}" if lacks and BARE in f"# {lacks}" else str(root / name)])
    say([f"next: replication run {chosen.key}"])
    return FINE


@command(
    "guide",
    "print a page of the guide for auditors, or list its pages",
    option("page", nargs="?", metavar="PAGE", help="name of a page (default: the list)"),
)
def guide(chosen: argparse.Namespace) -> int:
    """Print the page, or the name and title of each."""
    import replication
    from replication.errors import one_of

    pages = {path.stem: path for path in sorted((Path(replication.__file__).parent / "guide").glob("*.md"))}
    if chosen.page is None:
        titles = {
            name: path.read_text(encoding="utf-8").partition("\n")[0].lstrip("# ") for name, path in pages.items()
        }
        width = max(map(len, titles))
        say(f"{name:{width}}  {title}" for name, title in titles.items())
    else:
        say([pages[one_of("page", chosen.page, pages)].read_text(encoding="utf-8").rstrip("\n")])
    return FINE


@command(
    "coverage",
    "count the numerals and items of the texts that are bound to a claim or to data, and list those that are not",
    option("papers", nargs="*", metavar="PAPER", help="papers to look at (default: all)"),
    option("--open", action="store_true", help="only list what is neither bound nor excused"),
    option("--text", type=Path, metavar="FILE", help="compare this text with the list of --paper"),
    option("--draft", type=Path, metavar="FILE", help="propose printed.toml and coverage.toml for this text"),
    option("--paper", metavar="KEY", help="the paper of the text; KEY/NAME for another text of its list"),
    notes="""\
The lists are papers/KEY/coverage.toml. A binding that does not exist, or holds other numerals, is a fault.
Counted are the numerals that state a fact: parameters, entries and coefficients, bounds, sizes, instants, counts and
results. Indices, labels, citations, bibliography and the like are listed too, each with its reason, and not counted.
Whoever has a text can compare it with its list by `--text`: each run of digits must occur in both equally often. The
lists are of scanned texts; a scan splits a few numbers and doubles others. `--draft` lists the numerals of a text or of
a LaTeX source, each with its place and a guess, in papers/KEY/*.draft.toml; it replaces nothing.

""",
)
def coverage(chosen: argparse.Namespace) -> int:
    """Print counts, what is open, and faults of the lists; with a text, where it and its list differ."""
    from replication.audit.inspect.coverage import faults, read_coverage

    paths = [path for path in (chosen.text, chosen.draft) if path is not None]
    if len(paths) != (chosen.paper is not None):
        raise InvalidInputError("--paper KEY goes with --text FILE or with --draft FILE; give both or neither")
    if chosen.draft is not None:
        return _draft(chosen.draft, chosen.paper)
    if chosen.text is not None:
        return _compare(chosen.text, *chosen.paper.partition("/")[::2])
    wrong = []
    project = here()
    for paper in project.load(chosen.papers):
        folder = project.folder / paper.key
        if not (folder / "coverage.toml").is_file():
            wrong.append(f"{folder / 'coverage.toml'} does not exist; list there what the text of {paper.key} prints")
            continue
        for name, text in read_coverage(folder / "coverage.toml").items():
            say(_lines(f"{paper.key}, {name}", name, text, chosen.open))
        wrong += faults(folder, paper)
    say(f"fault: {fault}" for fault in wrong)
    return DIFFERENT if wrong else FINE


def _lines(title: str, name: str, text: Text, only_open: bool) -> Iterator[str]:
    from replication.audit.inspect.coverage import REASONS, excuses, still_open, tallied

    if not only_open:
        for tally in tallied(name, text):
            share = f" ({100 * tally.bound / tally.total:.1f} %)" if tally.total else ""
            aside = f"; {tally.aside} more state no fact" if tally.aside else ""
            counts = f"{tally.bound} bound{share}, {tally.excused} excused, {tally.open} open"
            yield f"{title}: {tally.total} {tally.of}: {counts}{aside}"
        for reason, count in excuses(text).most_common():
            yield f"  {count} {reason}: {REASONS.get(reason, 'left out, as the scope says')}"
    yield from (f"{title}: open: {row}" for row in still_open(text))


def _draft(path: Path, key: str) -> int:
    from replication.audit.inspect.draft import write_draft

    project = here()
    folder = project.folder / key
    if not folder.is_dir():
        raise InvalidInputError(f"{folder} does not exist; begin the paper with `replication new {key}`")
    say(f"draft: {written}" for written in write_draft(path, folder))
    say(["next: read each entry against the text, and move what holds into printed.toml and coverage.toml"])
    return FINE


def _compare(path: Path, key: str, name: str) -> int:
    from replication.audit.inspect.coverage import differences, read_coverage
    from replication.errors import one_of
    from replication.files import read_text

    project = here()
    (paper,) = project.load([key])
    texts = read_coverage(project.folder / paper.key / "coverage.toml")
    text = texts[one_of("text of the list", name or next(iter(texts), ""), texts)]
    lines = list(differences(text, read_text(path)))
    say([*lines, f"{len(lines)} numerals differ between {path} and the list of {paper.key}"])
    return DIFFERENT if lines else FINE
