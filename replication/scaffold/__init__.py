"""The package of a new paper from the templates beside this file: the smallest that runs, with one of everything."""

import keyword
import re
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from replication.audit.inspect.coverage import ASIDE, FACTS, ITEMS
from replication.audit.project import CONFIGURATION, read_settings
from replication.errors import InvalidInputError
from replication.files import write_atomically, write_directory

FILES = (
    *("__init__.py", "paper.toml", "printed.toml", "printed.py", "experiments.py", "claims.py"),
    *("figures.py", "paper.py", "coverage.toml"),
)
"""Files of the package, whose templates have their names; `test.py` is that of the test."""
TABLES = ("__init__.py", "paper.toml", "claims.toml", "coverage.toml")
"""Those of a paper without Python, whose numbers lie in a table of the folder `data`."""
LONGEST = 40
REPORT_FOLDERS = ("exports", "notebooks")
"""Where the report on a paper with such a key would lie, other pages do."""


def plain_templates(folder: Path = Path(__file__).parent) -> Environment:
    """The templates of a folder for texts that are no HTML."""
    return Environment(loader=FileSystemLoader(folder), undefined=StrictUndefined, keep_trailing_newline=True)


def scaffold(key: str, root: Path, *, tables: bool = False) -> tuple[Path, ...]:
    """Write papers/KEY/ and tests/papers/test_KEY.py of the project at `root`, whole or not at all; returns the files.

    tables: whether its numbers are only read from tables, so that it needs no Python.
    A folder without a configuration becomes a project by what it lacks: replication.toml, papers/__init__.py,
    CITATION.cff and .gitignore.
    Raises InvalidInputError if `key` is no name of a module in lower case, or what it would name exists.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", key) or keyword.iskeyword(key) or len(key) > LONGEST:
        raise InvalidInputError(
            f"the key of a paper is a Python name in lower case of at most {LONGEST} characters, "
            f"for example gosset1908; got {key[: 2 * LONGEST]!r}"
        )
    folder = read_settings(root).papers
    package, test = root / folder / key, root / "tests" / "papers" / f"test_{key}.py"
    if key in REPORT_FOLDERS:
        raise InvalidInputError(f"report/{key}/ holds something else than a paper, so its key cannot be {key!r}")
    # pytest takes the names of test modules for unique, whatever folders they lie in.
    for path in (package, test, package.with_suffix(".py"), *(root / "tests").rglob(test.name)):
        if path.exists():
            raise InvalidInputError(f"{path} exists; choose another key, or remove it first")
    templates = plain_templates()
    excuses = {"numeral_excuses": ", ".join({**FACTS, **ASIDE}), "item_excuses": ", ".join(ITEMS)}

    def rendered(template: str) -> str:
        return templates.get_template(f"{template}.j2").render(key=key, folder=folder, tables=tables, **excuses)

    files = TABLES if tables else FILES
    texts = {name: rendered(name).encode() for name in files}
    around = {root / CONFIGURATION: "replication.toml", package.parent / "__init__.py": "papers.py", test: "test.py"}
    if not (root / CONFIGURATION).exists():
        around |= {root / "CITATION.cff": "CITATION.cff", root / ".gitignore": "gitignore"}
    if tables:
        around |= {root / "data" / f"{key}.csv": "table.csv"}
    begun = {path: rendered(template) for path, template in around.items() if not path.exists()}
    for path, text in begun.items():
        write_atomically(path, text.encode())
    write_directory(package, texts)
    return (*(package / name for name in files), *begun)
