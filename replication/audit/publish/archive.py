"""One zip of everything: sources, lock, results, figures, certificates, report, exports, with a checksum for each file.

Unpacked, it is a project like the one that it came from: `make report` rebuilds it, `make artifact` packs it again, and
`sha256sum -c SHA256SUMS` or `python -m replication artifact --check DIR` tells whether any file was changed.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from replication.audit.publish.exports import export_texts, to_json
from replication.audit.publish.linked_data import crate
from replication.audit.publish.software import read_software
from replication.audit.store.provenance import COMMIT_FILE, git, git_state
from replication.audit.store.records import RunRecord, read_results
from replication.errors import AuditError
from replication.files import write_atomically

MANIFEST, CRATE, EXPORTS = "SHA256SUMS", "ro-crate-metadata.json", "exports"
BUILT = ("report/index.html", "report/results.json")
EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip can hold, given to every file: the same content is then the same archive."""

EXECUTABLE, PLAIN = 0o100755, 0o100644


def write_archive(root: Path, path: Path) -> int:
    """Write the archive of the project at `root` at `path`, whole or not at all; returns the number of files.

    Raises AuditError if the project has not been run, its results come from edited sources or from another commit than
    the one that is checked out, or a source file is missing.
    """
    content = dict(_content(root))
    buffer = io.BytesIO()
    top = path.stem
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, (data, mode) in sorted(content.items()):
            entry = zipfile.ZipInfo(f"{top}/{name}", EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, mode << 16
            archive.writestr(entry, data)
    write_atomically(path, buffer.getvalue())
    return len(content)


def changed_files(directory: Path) -> tuple[str, ...]:
    """The files of an unpacked archive that are missing or are not what its manifest says, with what is wrong.

    Files that the manifest does not name are left out: building makes new ones.
    Raises AuditError if there is no manifest, or it is not one.
    """
    return tuple(
        f"{name}: {problem}" for name, digest in _manifest(directory) if (problem := _problem(directory, name, digest))
    )


def _problem(directory: Path, name: str, digest: str) -> str:
    try:
        found = hashlib.sha256((directory / name).read_bytes()).hexdigest()
    except FileNotFoundError:
        return "missing"
    return "" if found == digest else "changed"


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
    described = sorted({*map(Path, (*_sources(root), *BUILT)), *tutorials})
    missing = [str(file) for file in described if not (root / file).is_file()]
    if missing:
        raise AuditError(f"files are missing: {', '.join(missing[:5])}; check them out and run `make report`")
    software = read_software(root)
    texts = {f"{EXPORTS}/{name}": text for name, text in export_texts(results, software).items()}
    texts[CRATE] = to_json(crate(results, software, root, described))
    texts[COMMIT_FILE] = f"{commit}\n"
    content = {name: (text.encode(), PLAIN) for name, text in texts.items()}
    for file in described:
        executable = (root / file).stat().st_mode & 0o100
        content[file.as_posix()] = ((root / file).read_bytes(), EXECUTABLE if executable else PLAIN)
    sums = (f"{hashlib.sha256(data).hexdigest()}  {name}\n" for name, (data, _) in sorted(content.items()))
    yield MANIFEST, ("".join(sums).encode(), PLAIN)
    yield from content.items()


def _require_unedited(root: Path, run: RunRecord) -> str:
    head, dirty = git_state(root)
    if run.commit != head or run.dirty or dirty:
        state = "edited sources" if run.dirty else f"commit {run.commit[:12]}"
        now = f"{head[:12]}{', edited' if dirty else ''}"
        raise AuditError(f"the results come from {state}, the sources are at {now}; commit, then `make report`")
    return head


def _sources(root: Path) -> list[str]:
    """The files that git knows; in an unpacked archive, those of its manifest that packing does not write anew."""
    if (listed := git(root, "ls-files", "-z")) is not None and git_state(root)[1] is not None:
        return [name for name in listed.split("\0") if name]
    packed = {name for name, _ in _manifest(root)} - {CRATE, COMMIT_FILE}
    edited = [line for line in changed_files(root) if line.partition("/")[0] not in ("figures", "report")]
    if edited:
        raise AuditError(f"sources of this archive were changed ({edited[0]}); pack from a git checkout")
    return [name for name in packed if not name.startswith(f"{EXPORTS}/")]
