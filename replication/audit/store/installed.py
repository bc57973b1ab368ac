"""The installed distributions with which something is computed, and where they differ from the lock."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

OWN = "slow-sensor-replication"
"""This program, whose sources count one by one."""
_PIN = re.compile(r"^([A-Za-z0-9][A-Za-z0-9._-]*)==([^\s;\\#]+)", re.MULTILINE)


def loaded(modules: Iterable[str]) -> dict[str, str]:
    """Version by name of the distributions that own these top-level modules, and of all that these require.

    The version is followed by
    the checksum of the files as installed: a package may be built anew under the same version.
    """
    waiting = [name for module in modules for name in owners().get(module, ())]
    found: dict[str, str] = {}
    seen: set[str] = set()
    while waiting:
        name = canonical(waiting.pop())
        if name in seen or name == OWN:
            continue
        seen.add(name)
        if (known := _known(name)) is not None:
            title, version, required = known
            found[title] = version
            waiting.extend(required)
    return dict(sorted(found.items()))


def canonical(name: str) -> str:
    """The name of a distribution in the form in which two spellings are one."""
    return re.sub(r"[-_.]+", "-", name).lower()


def plain(versions: Mapping[str, str]) -> dict[str, str]:
    """The versions without the checksums of the files."""
    return {name: version.partition(" ")[0] for name, version in versions.items()}


def against_lock(versions: Mapping[str, str], lock: Path) -> tuple[str, ...]:
    """What is installed in another version than the lock says, or is not in it; nothing where there is no lock."""
    if not lock.is_file():
        return ()
    pins = {canonical(name): version for name, version in _PIN.findall(lock.read_text(encoding="utf-8"))}
    return tuple(
        f"{name} {version} ({f'locked {pin}' if (pin := pins.get(canonical(name))) else 'not in the lock'})"
        for name, version in sorted(versions.items())
        if pins.get(canonical(name)) != version
    )


def listing() -> list[str]:
    """A name for each thing that is installed where Python looks, with its version and the time it was put there."""
    return sorted(_installed())


def _installed() -> Iterator[str]:
    for place in dict.fromkeys(sys.path):
        if Path(place).is_dir():
            for entry in os.scandir(place or "."):
                if entry.name.endswith((".dist-info", ".egg-info", ".egg-link", ".pth")):
                    yield f"{entry.path} {entry.stat().st_mtime_ns}"


@functools.cache
def owners() -> Mapping[str, list[str]]:
    """The distributions that own each top-level module."""
    return importlib.metadata.packages_distributions()


@functools.cache
def _known(name: str) -> tuple[str, str, tuple[str, ...]] | None:
    try:
        found = importlib.metadata.distribution(name)
    except (importlib.metadata.PackageNotFoundError, ValueError):
        return None
    needed = (text for text in found.requires or () if "extra ==" not in text)
    required = tuple(re.split(r"[^A-Za-z0-9._-]", text, maxsplit=1)[0] for text in needed)
    return found.metadata["Name"], f"{found.version} {_files(found.read_text('RECORD') or '')}", required


def _files(record: str) -> str:
    """A checksum of what a distribution installed that can be run or read, not of what Python makes of it."""
    lines = (line for line in record.splitlines() if ".dist-info/" not in line and not line.startswith(".."))
    kept = sorted(line for line in lines if ".pyc," not in line)
    return hashlib.sha256("\n".join(kept).encode()).hexdigest()[:8]
