"""Where results come from: sources, lock, packages, machine. Facts only; nothing here influences a result."""

import contextlib
import functools
import importlib.metadata
import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import replication
from replication.audit.store.records import RunRecord
from replication.errors import AuditError
from replication.extras import DISTRIBUTION, canonical, name_of, required
from replication.files import sha256

_PIN = re.compile(r"^([A-Za-z0-9][A-Za-z0-9._-]*)==([^\s;\\#]+)", re.MULTILINE)


def loaded(modules: Iterable[str]) -> dict[str, str]:
    """The distributions that own these modules, and all that these require, with version and checksum of the files."""
    waiting = [name for module in modules for name in owners().get(module, ())]
    versions: dict[str, str] = {}
    names: set[str] = set()
    while waiting:
        name = canonical(waiting.pop())
        if name in names or name == DISTRIBUTION:
            continue
        names.add(name)
        if (known := _known(name)) is not None:
            title, version, required = known
            versions[title] = version
            waiting.extend(required)
    return dict(sorted(versions.items()))


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


def machine(root: Path) -> list[Any]:
    """All that may matter to a run beside files and what it reads, found without loading what computes."""
    here = [replication.__version__, platform.python_version(), platform.platform(), _of_processor("flags")]
    return [*git_state(root), *here, _cpu_model(), sorted(_installed())]


def _installed() -> Iterator[str]:
    """A name for each thing that is installed where Python looks, with its version and the time it was put there."""
    for place in dict.fromkeys(sys.path):
        if Path(place).is_dir():
            for entry in os.scandir(place or "."):
                if entry.name.endswith((".dist-info", ".egg-info", ".egg-link", ".pth")):
                    yield f"{entry.path} {entry.stat().st_mtime_ns}"


@functools.cache
def owners() -> Mapping[str, list[str]]:
    """The distributions that own each top-level module."""
    distributions = importlib.metadata.packages_distributions()
    return {module: [name for name in names if name] for module, names in distributions.items()}


def installed(name: str) -> importlib.metadata.Distribution | None:
    """The distribution of that name; an empty folder that an interrupted installation left is none."""
    with contextlib.suppress(ValueError):
        return next((dist for dist in importlib.metadata.distributions(name=name) if dist.metadata["Name"]), None)
    return None


@functools.cache
def _known(name: str) -> tuple[str, str, tuple[str, ...]] | None:
    dist = installed(name)
    if dist is None:
        return None
    required = tuple(name_of(text) for text in dist.requires or () if "extra ==" not in text)
    return dist.metadata["Name"], f"{dist.version} {_files(dist.read_text('RECORD') or '')}", required


def _files(record: str) -> str:
    """A checksum of what a distribution installed that can be run or read, not of what Python makes of it."""
    lines = (line for line in record.splitlines() if ".dist-info/" not in line and not line.startswith(".."))
    rows = sorted(line for line in lines if ".pyc," not in line)
    return sha256("\n".join(rows))[:8]


COMPUTING = ("estimation", "proofs")
"""The extras of this package with which papers compute."""
LOCK, COMMIT_FILE = "requirements.lock", "COMMIT"
THREADS = 1
"""Threads of the linear algebra in each process; one, so that sums are always taken in the same order."""

# What runs and exports write; an edit there does not change what the next run computes.
OUTPUTS = (
    *("figures", "report/index.html", "report/results.json", "report/*/*", "benchmarks/results.md", ".cache"),
    *("codecheck.yml", ".zenodo.json"),
)


@dataclass(frozen=True)
class Environment:
    """What every result depends on beside its own sources: checksum of the lock, Python, installed packages, kernel.

    kernel: the instruction set for which the linear algebra chose its code; another one rounds differently.
    """

    lock_sha256: str
    python: str
    packages: dict[str, str]
    kernel: str

    def of_key(self, loaded: Mapping[str, str], exact: bool = False) -> dict[str, Any]:
        """What the key of a result has of it, as fields of `Dependencies`.

        loaded: distributions imported beside the declared ones. exact: without linear algebra in floating point.
        """
        packages = {**self.packages, **loaded}
        kernel = "" if exact else self.kernel
        return {"lock": self.lock_sha256, "python": self.python, "packages": packages, "kernel": kernel}


def read_environment(root: Path) -> Environment:
    """The environment of the project at `root`; raises AuditError if a package that it declares is not installed."""
    return Environment(
        sha256(root / LOCK, "no lock"), python_minor(platform.python_version()), _package_versions(root), kernel()
    )


def python_minor(version: str) -> str:
    """`3.11` of `3.11.7`."""
    return ".".join(version.split(".")[:2])


def run_record(root: Path, environment: Environment, loaded: Mapping[str, str]) -> RunRecord:
    """Provenance of a run at `root` in this environment, with the date of SOURCE_DATE_EPOCH where that is set.

    loaded: versions of what experiments import beside the packages that the project declares.
    """
    commit, dirty = git_state(root)
    versions = dict(sorted({**environment.packages, **loaded}.items()))
    libraries = {f"{p['internal_api']} {p['version']} ({p.get('architecture', 'unknown')})" for p in _pools()}
    return RunRecord(
        package_version=replication.__version__,
        date=run_date(),
        commit=commit,
        dirty=dirty,
        lock_sha256=environment.lock_sha256,
        python=platform.python_version(),
        packages=versions,
        unlocked=against_lock(versions, root / LOCK),
        blas="; ".join(sorted(libraries)) or "unknown",
        threads=THREADS,
        cpu=_cpu_model(),
        platform=platform.platform(),
    )


def git_state(root: Path) -> tuple[str, bool | None]:
    """Commit of the sources, and whether they were edited since; what a run writes does not count.

    Where `root` is no top of a repository: what an unpacked archive says, else "unknown", and None.
    """
    top = git(root, "rev-parse", "--show-toplevel")
    commit = git(root, "rev-parse", "HEAD")
    if top is None or commit is None or Path(top).resolve() != root.resolve():
        packed = root / COMMIT_FILE
        return packed.read_text(encoding="utf-8").strip() if packed.is_file() else "unknown", None
    outputs = [f":(exclude){path}" for path in OUTPUTS]
    status = git(root, "status", "--porcelain", "--untracked-files=all", "--", ".", *outputs)
    return commit, None if status is None else status != ""


def run_date() -> str:
    """SOURCE_DATE_EPOCH if that is set, else now; UTC to the second, for example `2024-02-29T12:00:00Z`."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    try:
        moment = datetime.now(UTC) if epoch is None else datetime.fromtimestamp(int(epoch), UTC)
    except (ValueError, OverflowError, OSError):
        raise AuditError(f"SOURCE_DATE_EPOCH must be whole seconds since 1970, got {epoch!r}; correct it") from None
    return moment.strftime("%Y-%m-%dT%H:%M:%SZ")


def git(root: Path, *arguments: str) -> str | None:
    """Output of a git command, or None if git is missing or says no."""
    program = shutil.which("git")
    if program is None:
        return None
    process = subprocess.run([program, "-C", str(root), *arguments], capture_output=True, text=True, check=False)
    return process.stdout.strip() if process.returncode == 0 else None


def _package_versions(root: Path) -> dict[str, str]:
    """Installed versions of what pyproject.toml declares, else of what this package needs, extras that compute too."""
    path = root / "pyproject.toml"
    project = tomllib.loads(path.read_text(encoding="utf-8")).get("project", {}) if path.is_file() else {}
    extras = project.get("optional-dependencies", {})
    declared = project.get("dependencies")
    optional = [text for extra in COMPUTING for text in extras.get(extra, ())]
    if declared is None:
        declared = [text for text in required() if "extra ==" not in text]
        optional = [text for text in required() if text.partition("extra == ")[2].strip("\"'") in COMPUTING]
    names = {name for name in map(name_of, optional) if installed(name) is not None}
    return read_packages(sorted({*map(name_of, declared), *names}))


def read_packages(names: Iterable[str]) -> dict[str, str]:
    """The installed version of each package; raises AuditError if one is not installed."""
    try:
        return {name: importlib.metadata.version(name) for name in names}
    except importlib.metadata.PackageNotFoundError as error:
        raise AuditError(
            f"package {error.name} is not installed; install it with pip, in the version of {LOCK} where there is one"
        ) from None


def kernel() -> str:
    """The instruction set of numpy's and scipy's linear algebra; what else is loaded hangs on what ran before."""
    pools = [pool for pool in _pools() if {"numpy", "scipy"} & set(re.split(r"[^a-z]+", pool["filepath"]))]
    return "; ".join(sorted({pool.get("architecture", "unknown") for pool in pools or _pools()})) or "unknown"


def _pools() -> list[dict[str, Any]]:
    """The linear algebra libraries that are loaded, numpy's and scipy's among them."""
    import numpy as np  # noqa: F401 - loads the library that is then looked at
    import threadpoolctl

    with contextlib.suppress(ModuleNotFoundError):
        import scipy.linalg  # noqa: F401 - its own library

    return [pool for pool in threadpoolctl.threadpool_info() if pool["user_api"] == "blas"]


def _cpu_model() -> str:
    return _of_processor("model name") or platform.processor() or platform.machine() or "unknown"


def _of_processor(name: str) -> str:
    """What Linux says of the first processor under this name; empty elsewhere."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8", errors="replace").splitlines() if info.is_file() else []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith(name)), "")
