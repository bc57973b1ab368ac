"""Coq checks the theorems of a paper: it compiles theory, decimals and certificates; an audit asks what was proved.

The audit is a file of its own. It states each theorem again, from the paper's list of theorems and the certificate's
bounds, and Coq says on which assumptions each rests: none, or the run fails.
"""

import hashlib
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from replication.errors import InvalidInputError, ReplicationError
from replication.files import write_atomically
from replication.machine import STATEMENTS, THEORY, sum_for
from replication.machine.generate import identifier, proposition, source
from replication.verify.reading import content, parse
from replication.verify.run import verify
from replication.verify.subjects import Wanted, papers, theorems
from replication.verify.theorem import Refused

FILES = ("Statement", "Theory", "Checker")
PACKAGES = "coq libcoq-mathcomp-algebra"
"""What Debian calls them."""
CLOSED = "Closed under the global context"
SECONDS = 600
"""Longest that Coq may take for one file."""
QUIET = "-notation-overridden,-ambiguous-paths"
RECORD = "machine-checked.json"
AUDIT = """From mathcomp Require Import all_ssreflect all_algebra.
From Coq Require Import QArith_base.
From Multirate Require Import Statement.
From {paper} Require Import Decimals.
Require {modules}.

"""


@dataclass(frozen=True)
class Checked:
    """What came of one theorem: proved by Coq if there is no reason why not."""

    paper: str
    name: str
    reason: str = ""

    def line(self) -> str:
        """What to print of it."""
        return f"{f'NOT PROVED: {self.reason}' if self.reason else 'proved'} {self.paper}/{self.name}"


class Coq:
    """A folder in which Coq compiles; a file is compiled again only if it or one of those before it has changed."""

    def __init__(self, folder: Path, paper: str) -> None:
        if shutil.which("coqc") is None:
            raise InvalidInputError(f"coqc is not there; on Debian: apt-get install {PACKAGES}")
        self.folder, self.paper, self.seen = folder, paper, self.version()
        for module in (folder / "Multirate", folder / paper):
            module.mkdir(parents=True, exist_ok=True)

    @staticmethod
    def version() -> str:
        """Coq's own words."""
        return subprocess.run(["coqc", "--print-version"], capture_output=True, text=True, check=True).stdout.strip()

    def compile(self, place: str, text: str, *, shared: bool = False) -> str:
        """Compile `text` as the file `place`; what Coq printed. shared: all later files depend on it."""
        path, key = self.folder / f"{place}.v", hashlib.sha256((self.seen + text).encode()).hexdigest()
        if shared:
            self.seen += key
        printed = path.with_suffix(".printed")
        if printed.is_file() and printed.read_text(encoding="utf-8").startswith(key):
            return printed.read_text(encoding="utf-8").removeprefix(key)
        printed.unlink(missing_ok=True)
        write_atomically(path, text.encode())
        output = self._run("coqc", "-q", "-w", QUIET, f"{place}.v")
        write_atomically(printed, (key + output).encode())
        return output

    def check_again(self, modules: Sequence[str]) -> None:
        """Have `coqchk`, a kernel on its own, check these modules; those of Coq's libraries are taken as they are."""
        self._run("coqchk", "-silent", *(word for module in modules for word in ("-norec", module)))

    def _run(self, command: str, *options: str) -> str:
        """What a command of Coq printed; raises ReplicationError if it refuses, or takes too long."""
        places = ["-R", "Multirate", "Multirate", "-R", self.paper, self.paper]
        try:
            reply = subprocess.run(
                [command, *places, *options],
                cwd=self.folder, capture_output=True, text=True, timeout=SECONDS, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise ReplicationError(f"{command} took more than {SECONDS} s for {options[-1]}") from None
        if reply.returncode:
            raise ReplicationError(f"{command} refuses: {' '.join(reply.stderr.split())[-400:] or reply.returncode}")
        return reply.stdout


def wanted(paper: str, root: Path) -> dict[str, Wanted]:
    """The theorems of a paper that Coq is to check, by name."""
    return {name: entry for name, entry in theorems(paper, root)[0].items() if entry.statement in STATEMENTS}


def prepared(paper: str, root: Path, folder: Path) -> Coq:
    """Theory and decimals of a paper, compiled."""
    coq = Coq(folder, paper)
    for name in FILES:
        coq.compile(f"Multirate/{name}", (THEORY / f"{name}.v").read_text(encoding="utf-8"), shared=True)
    decimals = root / "papers" / paper / "coq" / "Decimals.v"
    if not decimals.is_file():
        raise InvalidInputError(f"{decimals} is not there: the decimals of the paper, written by hand")
    coq.compile(f"{paper}/Decimals", decimals.read_text(encoding="utf-8"), shared=True)
    return coq


def checked(coq: Coq, entry: Wanted, certificate: Any) -> Checked:
    """Compile one certificate, and ask Coq what it proves."""
    try:
        module = f"{coq.paper}.{identifier(entry.name)}"
        coq.compile(module.replace(".", "/"), source(certificate), shared=False)
        audited(coq, entry, certificate, module)
    except (ReplicationError, Refused, KeyError, TypeError, ValueError, ZeroDivisionError) as error:
        return Checked(coq.paper, entry.name, f"{type(error).__name__}: {error}")
    return Checked(coq.paper, entry.name)


def audited(coq: Coq, entry: Wanted, certificate: Any, module: str) -> None:
    """Refuse unless `module.proved` is the wanted theorem, with the bounds of the certificate, on no assumption."""
    stated = proposition(vars(entry), certificate["bound"])
    text = AUDIT.format(paper=coq.paper, modules=module)
    text += f"Definition wanted : {stated} := {module}.proved.\nPrint Assumptions wanted.\n"
    # What the audit printed belongs to this certificate.
    script = (coq.folder / f"{module.replace('.', '/')}.v").read_bytes()
    text += f"(* {hashlib.sha256(script).hexdigest()} *)\n"
    printed = coq.compile(f"{coq.paper}/audit_{identifier(entry.name)}", text)
    if printed.strip() != CLOSED:
        raise ReplicationError(f"the proof rests on assumptions: {' '.join(printed.split())[:300]}")


def check(
    root: Path, folder: Path, names: Sequence[str] = (), say: Callable[[str], None] = print, *, again: bool = False
) -> dict[str, list[Checked]]:
    """Check the named theorems, or all; say a line for each. The record of a paper is written if all were checked.

    again: have `coqchk` check the theorems too, and not the theory alone.
    """
    records: dict[str, list[Checked]] = {}
    for paper in papers(root):
        entries = {name: entry for name, entry in wanted(paper, root).items() if not names or name in names}
        if not entries:
            continue
        coq, records[paper] = prepared(paper, root, folder), []
        for name, entry in entries.items():
            path = root / "certificates" / paper / f"{name}.json"
            outcome = verify(path, root)
            record = Checked(paper, name, outcome.reason)
            if outcome.theorem:
                record = checked(coq, entry, parse(content(path)))
            records[paper].append(record)
            say(record.line())
        if not names:
            proved = [f"{paper}.{identifier(item.name)}" for item in records[paper] if again and not item.reason]
            theory = [*(f"Multirate.{name}" for name in FILES), f"{paper}.Decimals"]
            # Each theorem by itself, so that each has all of the time that is allowed.
            for modules in (theory, *([name] for name in proved)):
                coq.check_again(modules)
            say(f"{paper}: coqchk has checked the theory and {len(proved)} theorems again")
            _record(root, paper, records[paper], coq)
    if not records:
        raise InvalidInputError(f"no paper wants a theorem that Coq checks named {', '.join(names) or 'anything'}")
    return records


def _record(root: Path, paper: str, records: Sequence[Checked], coq: Coq) -> None:
    """Which certificates Coq has checked, by the checksum of the file, for the report."""
    folder = root / "certificates" / paper
    proved = [outcome.name for outcome in records if not outcome.reason]
    sums = {name: hashlib.sha256((folder / f"{name}.json").read_bytes()).hexdigest() for name in proved}
    statement = (THEORY / "Statement.v").relative_to(Path(__file__).parents[2]).as_posix()
    theory = sum_for(root / "papers" / paper)
    record = {"coq": coq.version(), "statement": statement, "theory": theory, "certificates": sums}
    write_atomically(root / "papers" / paper / RECORD, (json.dumps(record, indent=2) + "\n").encode())


# How many lines a reader must trust for one theorem: `python -m replication.machine.run [PAPER NAME]`.
#
# Counted are lines that hold more than comments, of the statement, of the paper's decimals and of the theorem itself.


ROOT = Path(__file__).parents[2]


def lines(text: str) -> int:
    """Lines of a file of Coq without comments and empty lines."""
    return sum(bool(line.strip()) for line in re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL).splitlines())


def counted(paper: str, name: str, root: Path = ROOT) -> str:
    """The count, as it is printed."""
    entry = wanted(paper, root)[name]
    bound = json.loads((root / "certificates" / paper / f"{name}.json").read_text(encoding="utf-8"))["bound"]
    decimals = root / "papers" / paper / "coq" / "Decimals.v"
    parts = {
        "replication/machine/multirate/Statement.v": lines((THEORY / "Statement.v").read_text(encoding="utf-8")),
        f"papers/{paper}/coq/Decimals.v": lines(decimals.read_text(encoding="utf-8")),
        f"the theorem {name}": lines(proposition(vars(entry), bound)),
    }
    return "".join(f"{count:5} {what}\n" for what, count in parts.items())


if __name__ == "__main__":
    chosen_paper, chosen_name = sys.argv[1:] or ("okajima2023", "gains-38")
    sys.stdout.write(counted(chosen_paper, chosen_name))
