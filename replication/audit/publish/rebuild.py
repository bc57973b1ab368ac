"""How a project is rebuilt where there is nothing but Python: the wheel of this program, a lock, and the steps.

`replication new --ci` writes them for a service that runs the audit at each change, `replication artifact` packs them.
The steps stand here once; the page for readers, the workflow and the container are made of them.
"""

import base64
import hashlib
import io
import json
import os
import platform
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

import replication
from replication import scaffold
from replication.audit.store.provenance import LOCK, OWN, canonical, installed, python_minor
from replication.errors import AuditError

TOOL = "tool"
"""The folder of the wheel: the program is in no index of packages, so it travels with what it audits."""
PAGE, CONTAINER, WORKFLOW = "REBUILD.md", "Dockerfile", ".github/workflows/replication.yml"
INSTALL = (f"python -m pip install -r {LOCK}", f"python -m pip install {TOOL}/*.whl")
RUN = ("replication run", "replication check")
METADATA = ("METADATA", "WHEEL", "entry_points.txt", "top_level.txt", "licenses/LICENSE")
NOT_LOCKED = {OWN, "pip", "setuptools", "wheel"}
BARE = "# Without checksums of the files"
PATIENCE = 120
"""Seconds that the index may take."""
EARLIEST, PLAIN = (1980, 1, 1, 0, 0, 0), 0o100644
"""The earliest time that a zip can hold, given to every file, and the mode of one that is not to be run."""


def brings_the_tool(root: Path) -> bool:
    """Whether the project holds the sources of this very program, and so needs no wheel of it."""
    return Path(replication.__file__).resolve().is_relative_to(root.resolve()) and (root / "pyproject.toml").is_file()


def tool_wheel() -> tuple[str, bytes]:
    """Name and bytes of a wheel of this program as it is installed; the same installation gives the same bytes.

    Raises AuditError where the program runs from sources that were never installed.
    """
    distribution = installed(OWN)
    if distribution is None:
        raise AuditError("this program is not installed, so that its wheel cannot be packed; `pip install` its sources")
    package = Path(replication.__file__).parent
    stem = f"{OWN.replace('-', '_')}-{distribution.version}"
    files = {
        path.relative_to(package.parent).as_posix(): path.read_bytes()
        for path in package.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    texts = {f"{stem}.dist-info/{name}": distribution.read_text(name) for name in METADATA}
    files |= {name: text.encode() for name, text in texts.items() if text}
    lines = [f"{name},sha256={_digest(data)},{len(data)}" for name, data in sorted(files.items())]
    record = f"{stem}.dist-info/RECORD"
    files[record] = "\n".join([*lines, f"{record},,", ""]).encode()
    return f"{TOOL}/{stem}-py3-none-any.whl", zipped({name: (data, PLAIN) for name, data in files.items()})


def zipped(files: Mapping[str, tuple[bytes, int]]) -> bytes:
    """A zip of files with their modes, in the order of their names: the same content is the same archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, (data, mode) in sorted(files.items()):
            entry = zipfile.ZipInfo(name, EARLIEST)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, mode << 16
            archive.writestr(entry, data)
    return buffer.getvalue()


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def lock_text(*, ask: bool = False) -> str:
    """What is installed where this runs, a package a line with its version; what is in no index is named beside.

    ask: whether uv or pip-compile, where there is one, asks the index for the checksums of the files. The first lines
    say whether they are there, and why not.
    """
    pins: dict[str, str] = {}
    for package in metadata.distributions():
        name = package.metadata["Name"]
        if name and canonical(name) not in NOT_LOCKED:
            origin = json.loads(package.read_text("direct_url.json") or "{}").get("url", "")
            pin = f"# from no index: {name} {package.version}, {origin}" if origin else f"{name}=={package.version}"
            pins.setdefault(canonical(name), pin)
    text = "".join(f"{pins[name]}\n" for name in sorted(pins))
    hashed, why = _hashed(text) if ask else ("", "the index was not asked")
    comments = [line for line in text.splitlines(keepends=True) if hashed and line.startswith("#")]
    head = (
        f"# What `replication run` is run with: Python {python_minor(platform.python_version())} and these packages.\n"
    )
    return "".join([head, *([] if hashed else [f"{BARE}: {why}.\n"]), *comments, hashed or text])


def _hashed(pins: str) -> tuple[str, str]:
    """The pins with the checksums of their files as the index gives them, or nothing and why not."""
    here = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    words = ["--quiet", "--generate-hashes", "--no-header", "--no-annotate"]
    arguments = {"uv": ["pip", "compile", "--no-deps", *words, "-"], "pip-compile": [*words, "--output-file=-", "-"]}
    program = next((executable for name in arguments if (executable := shutil.which(name, path=here))), None)
    if program is None:
        return "", "neither uv nor pip-compile is here"
    line = [program, *arguments[Path(program).stem]]
    try:
        process = subprocess.run(line, input=pins, capture_output=True, text=True, check=False, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return "", f"{Path(program).stem} took longer than {PATIENCE} s"
    message = next(iter(reversed(process.stderr.strip().splitlines())), "it says nothing").strip()
    return (process.stdout, "") if process.returncode == 0 else ("", f"{Path(program).stem}: {message[:200]}")


def plain_templates(folder: Path) -> Environment:
    """The templates of a folder for texts that are no HTML."""
    return Environment(loader=FileSystemLoader(folder), undefined=StrictUndefined, keep_trailing_newline=True)


def rebuild_texts() -> dict[str, str]:
    """The page for readers, the workflow and the container, by name."""
    templates = plain_templates(Path(scaffold.__file__).parent)
    fields = {
        "install": INSTALL,
        "steps": (*INSTALL, *RUN),
        "python": python_minor(platform.python_version()),
        "lock": LOCK,
    }
    names = {PAGE: "rebuild.md.j2", WORKFLOW: "workflow.yml.j2", CONTAINER: "Dockerfile.j2"}
    return {name: templates.get_template(template).render(fields) for name, template in names.items()}


def rebuild_files(root: Path, *, ask: bool = False) -> dict[str, bytes]:
    """All of it by name, but for what the project has: a wheel in `tool`, a lock, files that a person wrote.

    ask: as for `lock_text`.
    """
    lock = "" if (root / LOCK).exists() else lock_text(ask=ask)
    texts = {LOCK: lock, ".dockerignore": ".cache\n.git\n.venv\n", **rebuild_texts()}
    files = {name: text.encode() for name, text in texts.items() if not (root / name).exists()}
    if not list((root / TOOL).glob("*.whl")):
        name, wheel = tool_wheel()
        files[name] = wheel
    return dict(sorted(files.items()))
