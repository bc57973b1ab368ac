"""One zip of everything: sources, lock, results, figures, certificates, report, exports, with a checksum for each file.

Unpacked, it is a project like the one that it came from, with this program as a wheel and REBUILD.md, the way to run it
beside nothing but Python. `replication run` rebuilds it, `replication artifact` packs it again, and `sha256sum -c
SHA256SUMS` or `python -m replication artifact --check DIR` tells whether any file was changed. `replication new --ci`
writes the same wheel, lock and steps for a service that runs the audit at each change; the steps stand here once, and
the page for readers, the workflow and the container are made of them.
"""

import base64
import hashlib
import io
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from importlib import metadata
from pathlib import Path, PurePosixPath

import replication
from replication.audit.inspect.headline import tally
from replication.audit.publish.linked_data import (
    CITATION,
    CODECHECK,
    MARK,
    Software,
    filled,
    read_software,
    register_texts,
    to_json,
)
from replication.audit.report.claim import standing
from replication.audit.report.templates import environment
from replication.audit.store.provenance import (
    COMMIT_FILE,
    LOCK,
    git,
    git_state,
    installed,
    python_minor,
)
from replication.audit.store.records import ClaimRecord, ResultsFile, RunRecord, read_results
from replication.errors import AuditError
from replication.extras import DISTRIBUTION, canonical
from replication.files import sha256, write_atomically
from replication.scaffold import plain_templates

TICK, CROSS, DIAMOND = "M4 10.5l3.5 3.5l6-8", "M4.5 5.5l8 8m0-8l-8 8", "M8.5 5.5l4.5 4.5l-4.5 4.5l-4.5-4.5z"
GOOD, SOME, BAD = ("#0b6b46", TICK), ("#8a5200", DIAMOND), ("#a11d2f", CROSS)
"""Colour, with a contrast of more than 4.5:1 to white, and mark: all agree, something does not, a theorem fails."""


def export_texts(results: ResultsFile, software: Software) -> dict[str, str]:
    """Name and text of each exported file; the same results give the same texts."""
    texts = {
        **badges(results, "badges", "replication"),
        "claims.jsonld": to_json(filled("claims", results=results, software=software)),
        "citation.bib": bibtex(results, software),
    }
    return dict(sorted(texts.items()))


def badges(results: ResultsFile, folder: str, label: str) -> dict[str, str]:
    """By name of its file the badge of each paper, and that of all, which has a label."""
    by_paper = {p.key: [claim for claim in results.claims if claim.paper == p.key] for p in results.papers}
    texts = {key: badge(key, claims) for key, claims in by_paper.items()} | {"all": badge(label, results.claims)}
    return {f"{folder}/{name}.svg": text for name, text in texts.items()}


def write_exports(results: ResultsFile, root: Path, directory: Path) -> tuple[Path, ...]:
    """Write every export of `results` below `directory`; returns the paths. root: of the project, for CITATION.cff."""
    texts = export_texts(results, read_software(root))
    for name, text in texts.items():
        write_atomically(directory / name, text.encode())
    return tuple(directory / name for name in texts)


def badge(label: str, claims: Iterable[ClaimRecord]) -> str:
    """One badge: how the claims stand, or whether a verdict has moved.

    A tick says that all agree, a diamond that some do not, a cross that a theorem fails or a verdict has changed.
    """
    chosen = tuple(claims)
    moved = sum(claim.unexpected for claim in chosen)
    text = f"{moved} off the pin" if moved else tally(chosen).words
    stands = standing(chosen)
    colour, mark = BAD if moved or stands.broken else SOME if stands.failing else GOOD
    return environment().get_template("badge.svg.j2").render(colour=colour, mark=mark, label=label, text=text)


def bibtex(results: ResultsFile, software: Software) -> str:
    """BibTeX of this package and of every paper that it replicates."""
    fields = {
        "title": f"{{{software.title}}}",
        "author": " and ".join(f"{{{person.full_name}}}" for person in software.authors),
        "version": software.version,
        "year": results.run.date[:4],
        "doi": software.doi,
        "url": software.url or software.repository_code,
    }
    lines = [f"  {name} = {{{value}}}," for name, value in fields.items() if value]
    package = "\n".join(["@software{replication,", *lines, "}"])
    return "\n\n".join([package, *(paper.bibtex.strip() for paper in results.papers)]) + "\n"


MANIFEST, CRATE, EXPORTS = "SHA256SUMS", "ro-crate-metadata.json", "exports"
BUILT = ("report/index.html", "report/results.json")
EXECUTABLE = 0o100755


def archive_name(root: Path) -> str:
    """What the archive of the project at `root` is called: title, up to a colon, and version of its CITATION.cff."""
    software = read_software(root)
    words = re.findall(r"[a-z0-9]+", software.title.partition(":")[0].lower())
    return f"{'-'.join([*words, software.version])}-artifact.zip"


def write_archive(root: Path, path: Path) -> int:
    """Write the archive of the project at `root` at `path`, whole or not at all; returns the number of files.

    Raises AuditError if the project has not been run, its results come from edited sources or from another commit than
    the one that is checked out, or a source file is missing.
    """
    content = dict(_content(root))
    write_atomically(path, zipped({f"{path.stem}/{name}": entry for name, entry in content.items()}))
    return len(content)


def changed_files(directory: Path) -> tuple[str, ...]:
    """The files of an unpacked archive that are missing or are not what its manifest says, with what is wrong.

    Files that the manifest does not name are left out: building makes new ones.
    Raises AuditError if there is no manifest, or it is not one.
    """
    hashes = ((name, digest, sha256(directory / name, "missing")) for name, digest in _manifest(directory))
    return tuple(f"{name}: {'missing' if now == 'missing' else 'changed'}" for name, then, now in hashes if now != then)


def unfilled(root: Path) -> list[str]:
    """What `replication new` left to be written by hand and nobody has, file by file."""
    left = re.compile(r"A\. AUTHOR|WHAT IS AUDITED|\bTITLE\b|In your own words:")
    paths = [root / CITATION, *root.glob("*/*/paper.toml")]
    matches = {path.relative_to(root): left.search(_read(path)) for path in paths}
    return [f"{path} still says {match[0]!r}, which is for you to write" for path, match in matches.items() if match]


def _manifest(directory: Path) -> Iterator[tuple[str, str]]:
    path = directory / MANIFEST
    if not path.is_file():
        raise AuditError(f"{path} is missing; give the directory of an unpacked archive")
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise AuditError(f"{path} is no list of checksums ({error.reason}); unpack the archive again") from None
    if not lines:
        raise AuditError(f"{path} lists no file; unpack the archive again")
    for number, line in enumerate(lines, 1):
        digest, separator, name = line.partition("  ")
        parts = PurePosixPath(name).parts
        if len(digest) != 64 or not separator or not parts or ".." in parts or PurePosixPath(name).is_absolute():
            raise AuditError(f"{path}, line {number}: {line!r} is not a checksum and a file below the directory")
        yield name, digest


def _content(root: Path) -> Iterator[tuple[str, tuple[bytes, int]]]:
    """Name, bytes and mode of each file; the manifest and the RO-Crate describe all the others."""
    results = read_results(root / "report" / "results.json")
    commit = _require_unedited(root, results.run)
    tutorials = (path.relative_to(root) for path in (root / "report" / "notebooks").glob("*.html"))
    drawn = (Path("figures") / f"{f.name}.{end}" for f in results.figures if not f.error for end in ("svg", "csv"))
    sources = [name for name in _sources(root) if name != CODECHECK or MARK not in _read(root / name)]
    articles = (path.relative_to(root) for path in (root / "report" / "articles").glob("*"))
    described = sorted({*map(Path, (*sources, *BUILT)), *articles, *tutorials, *drawn})
    missing = [str(file) for file in described if not (root / file).is_file()]
    if missing:
        raise AuditError(f"files are missing: {', '.join(missing[:5])}; check them out, then `replication run`")
    software = read_software(root)
    added = {name: text.encode() for name, text in register_texts(results, software).items()}
    # A project that holds the sources of this very program needs no wheel of it.
    within = Path(replication.__file__).resolve().is_relative_to(root.resolve())
    added |= {} if within and (root / "pyproject.toml").is_file() else rebuild_files(root)
    whole = {**added, **{file.as_posix(): (root / file).read_bytes() for file in described}}
    texts = {f"{EXPORTS}/{name}": text for name, text in export_texts(results, software).items()}
    texts[CRATE] = to_json(filled("crate", results=results, software=software, files=whole))
    texts[COMMIT_FILE] = f"{commit}\n"
    whole |= {name: text.encode() for name, text in texts.items()}
    executable = {file.as_posix() for file in described if (root / file).stat().st_mode & 0o100}
    content = {name: (data, EXECUTABLE if name in executable else PLAIN) for name, data in whole.items()}
    sums = (f"{sha256(data)}  {name}\n" for name, (data, _) in sorted(content.items()))
    yield MANIFEST, ("".join(sums).encode(), PLAIN)
    yield from content.items()


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""


def _require_unedited(root: Path, run: RunRecord) -> str:
    head, dirty = git_state(root)
    if run.commit != head or run.dirty or dirty:
        state = "edited sources" if run.dirty else f"commit {run.commit[:12]}"
        now = f"{head[:12]}{', edited' if dirty else ''}"
        raise AuditError(f"the results come from {state}, the sources are at {now}; commit, then `replication run`")
    return head


def _sources(root: Path) -> list[str]:
    """The files that git knows; in an unpacked archive, those of its manifest that packing does not write anew."""
    if (listed := git(root, "ls-files", "-z")) is not None and git_state(root)[1] is not None:
        return [name for name in listed.split("\0") if name]
    if not (root / MANIFEST).is_file():
        raise AuditError(
            f"{root} is no checkout of git, which says what its sources are; `git init`, `git add .`, `git commit`, "
            "then `replication run`"
        )
    packed = {name for name, _ in _manifest(root)} - {CRATE, COMMIT_FILE}
    built = ("figures", "report", f"{CODECHECK}: changed")
    edited = [line for line in changed_files(root) if line.partition("/")[0] not in built]
    if edited:
        raise AuditError(f"sources of this archive were changed ({edited[0]}); pack from a git checkout")
    return [name for name in packed if not name.startswith(f"{EXPORTS}/")]


TOOL = "tool"
"""The folder of the wheel: the program is in no index of packages, so it travels with what it audits."""
PAGES = {
    "REBUILD.md": "rebuild.md.j2",
    ".github/workflows/replication.yml": "workflow.yml.j2",
    "Dockerfile": "Dockerfile.j2",
}
"""The page for readers, the workflow and the container, with their templates."""
INSTALL = (f"python -m pip install -r {LOCK}", f"python -m pip install {TOOL}/*.whl")
RUN = ("replication run", "replication check")
METADATA = ("METADATA", "WHEEL", "entry_points.txt", "top_level.txt", "licenses/LICENSE")
NOT_LOCKED = {DISTRIBUTION, "pip", "setuptools", "wheel"}
BARE = "# Without checksums of the files"
PATIENCE = 120
"""Seconds that the index may take."""
EARLIEST, PLAIN = (1980, 1, 1, 0, 0, 0), 0o100644
"""The earliest time that a zip can hold, given to every file, and the mode of one that is not to be run."""


def tool_wheel() -> tuple[str, bytes]:
    """Name and bytes of a wheel of this program as it is installed; the same installation gives the same bytes.

    Raises AuditError where the program runs from sources that were never installed.
    """
    distribution = installed(DISTRIBUTION)
    if distribution is None:
        raise AuditError("this program is not installed, so that its wheel cannot be packed; `pip install` its sources")
    package = Path(replication.__file__).parent
    stem = f"{DISTRIBUTION.replace('-', '_')}-{distribution.version}"
    files = {
        path.relative_to(package.parent).as_posix(): path.read_bytes()
        for path in package.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    texts = {f"{stem}.dist-info/{name}": distribution.read_text(name) for name in METADATA}
    files |= {name: text.encode() for name, text in texts.items() if text}
    digests = {name: base64.urlsafe_b64encode(hashlib.sha256(data).digest()) for name, data in sorted(files.items())}
    lines = [f"{name},sha256={digest.rstrip(b'=').decode()},{len(files[name])}" for name, digest in digests.items()]
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


def rebuild_files(root: Path, *, ask: bool = False) -> dict[str, bytes]:
    """All of it by name, but for what the project has: a wheel in `tool`, a lock, files that a person wrote.

    ask: as for `lock_text`.
    """
    lock = "" if (root / LOCK).exists() else lock_text(ask=ask)
    python = python_minor(platform.python_version())
    fields = {"install": INSTALL, "steps": (*INSTALL, *RUN), "python": python, "lock": LOCK}
    pages = {name: plain_templates().get_template(template).render(fields) for name, template in PAGES.items()}
    texts = {LOCK: lock, ".dockerignore": ".cache\n.git\n.venv\n", **pages}
    files = {name: text.encode() for name, text in texts.items() if not (root / name).exists()}
    if not list((root / TOOL).glob("*.whl")):
        name, wheel = tool_wheel()
        files[name] = wheel
    return dict(sorted(files.items()))
