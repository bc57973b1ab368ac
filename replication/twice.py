"""Both arithmetics under the same statements: python-flint, and `verify/stdlib`, which shares no code with it.

`python verify.py --both` proves each certificate in either, each in a process of its own, and compares what they say:
whether it is proved, the bounds, the sentence and what it says as data. A mistake in a statement both have in common.
"""

import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict
from fractions import Fraction
from itertools import zip_longest
from pathlib import Path
from typing import Any

from replication.files import sum_of, write_atomically

ROOT = Path(__file__).resolve().parents[1]
RECORD = "checked-twice.json"
"""Beside a paper: the checksums of the certificates that both arithmetics prove, and of the second arithmetic."""
ARITHMETICS = ("flint", "stdlib")
CHOICE = "REPLICATION_ARITHMETIC"
"""The variable of the environment by which `replication.verify` takes one."""
NUMBER = re.compile(r"-?[0-9]+\.[0-9]+(?:e[+-]?[0-9]+)?")
RADIUS = re.compile(r"\+/- [0-9.e+-]+\]")
ENCLOSED = Fraction(1, 10**5)
"""How far, relatively, two rounded ends of enclosures of the same number may be from each other in a sentence."""
Said = dict[str, Any]


def said(paths: Sequence[Path], root: Path, jobs: int | None) -> list[Said]:
    """What the arithmetic of this process says of each certificate, as JSON."""
    from functools import partial

    from replication.verify.reading import written
    from replication.verify.run import lost, verify
    from replication.verify.workers import in_order

    outcomes = in_order(partial(verify, root=root), paths, jobs, lost)
    return [
        {"line": outcome.line(), "proved": False}
        if outcome.theorem is None
        else {"line": outcome.line(), "proved": True, **written(asdict(outcome.theorem))}
        for outcome in outcomes
    ]


def difference(left: Said, right: Said) -> str:
    """In what two arithmetics differ on a certificate; empty if they say the same."""
    if left["proved"] is not right["proved"]:
        return f"{ARITHMETICS[not left['proved']]} alone proves it"
    if not left["proved"]:
        return ""
    for part in ("lower", "upper", "holds"):
        if left[part] != right[part]:
            return f"{part} is {left[part]} for {ARITHMETICS[0]}, {right[part]} for {ARITHMETICS[1]}"
    if not _same_words(left["sentence"], right["sentence"]):
        return f"the sentences differ: {left['sentence']} / {right['sentence']}"
    if not _meet(left["items"], right["items"]):
        return "the enclosures of the listed numbers do not meet"
    terms = list(zip_longest(left["says"], right["says"]))
    if not all(a and b and {**a, "items": 0} == {**b, "items": 0} and _meet(a["items"], b["items"]) for a, b in terms):
        return "what they say as data differs"
    return ""


def _same_words(left: str, right: str) -> bool:
    """The same sentence, but for the ends of enclosures, which each arithmetic finds by itself."""
    left, right = (RADIUS.sub("+/- radius]", text) for text in (left, right))
    numbers = [[Fraction(number) for number in NUMBER.findall(text)] for text in (left, right)]
    near = all(abs(a - b) <= ENCLOSED * max(abs(a), abs(b)) for a, b in zip_longest(*numbers, fillvalue=Fraction(0)))
    return left == right or (NUMBER.sub("#", left) == NUMBER.sub("#", right) and near)


def _meet(left: Sequence[Sequence[str | None]], right: Sequence[Sequence[str | None]]) -> bool:
    """Whether there are as many enclosures, and each is the same or meets that of the other."""
    return len(left) == len(right) and all(
        list(a) == list(b)
        or (None not in (*a, *b) and max(Fraction(a[0]), Fraction(b[0])) <= min(Fraction(a[1]), Fraction(b[1])))  # type: ignore[arg-type]
        for a, b in zip(left, right, strict=True)
    )


def by(arithmetic: str, paths: Sequence[Path], root: Path, jobs: int | None) -> list[Said]:
    """What an arithmetic says of these certificates, from a process of its own."""
    request = json.dumps({"paths": [str(path) for path in paths], "root": str(root), "jobs": jobs})
    process = subprocess.run(
        [sys.executable, "-m", "replication.twice"],
        input=request, stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT, env={**os.environ, CHOICE: arithmetic},
    )  # fmt: skip
    records: list[Said] = json.loads(process.stdout)
    return records


def report(paths: Sequence[Path], root: Path = ROOT, jobs: int | None = 1) -> int:
    """Print a line for each certificate, and one for each on which the arithmetics differ; 1 on any failure.

    Without `paths`, all certificates are checked, and what both prove is recorded.
    """
    from replication.verify.run import listed, say
    from replication.verify.theorem import Refused

    try:
        files = [path.absolute() for path in listed(paths, root)]
    except Refused as refusal:
        say(f"NOT PROVED: {refusal}")
        return 1
    proved, conflicts, both = 0, 0, list[Path]()
    pairs = zip(*(by(arithmetic, files, root.absolute(), jobs) for arithmetic in ARITHMETICS), strict=True)
    for path, (left, right) in zip(files, pairs, strict=True):
        say(left["line"])
        conflict = difference(left, right)
        if conflict:
            say(f"THE ARITHMETICS DIFFER on {path}: {conflict}")
        proved += left["proved"]
        conflicts += bool(conflict)
        if left["proved"] and not conflict:
            both.append(path)
    say(f"{proved} of {len(files)} certificates proved; {len(both)} of them in both arithmetics")
    if not paths:
        record(both, root)
    return 0 if files and proved == len(files) and not conflicts else 1


def second() -> str:
    """The checksum of the second arithmetic, with what compares it."""
    files = sorted((ROOT / "replication" / "verify" / "stdlib").glob("*.py"))
    return sum_of([*files, Path(__file__)])


def record(proved: Sequence[Path], root: Path) -> None:
    """Write beside each paper, for the report, which certificates both arithmetics prove, with all checksums."""
    sums: dict[str, dict[str, str]] = {}
    for path in proved:
        sums.setdefault(path.parent.name, {})[path.stem] = hashlib.sha256(path.read_bytes()).hexdigest()
    for paper, certificates in sums.items():
        text = json.dumps({"arithmetic": second(), "certificates": certificates}, indent=2) + "\n"
        write_atomically(root / "papers" / paper / RECORD, text.encode())


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line of `verify.py`."""
    parser = argparse.ArgumentParser(
        prog="verify.py", description="Check certificates in exact and ball arithmetic, and say what each proves."
    )
    parser.add_argument("paths", nargs="*", type=Path, metavar="PATH", help="files or folders (default: all)")
    chosen = parser.add_mutually_exclusive_group()
    chosen.add_argument("--both", action="store_true", help="in both arithmetics, which must say the same")
    words = "python-flint, or the standard library alone (default: python-flint where it is installed)"
    chosen.add_argument("--arithmetic", choices=ARITHMETICS, help=words)
    # Beside the options: what follows from them is imported once the arithmetic is known.
    if "--arithmetic" in (argv := [*(sys.argv[1:] if arguments is None else arguments)]):
        os.environ[CHOICE] = (argv[argv.index("--arithmetic") + 1 :] or [""])[0]
    from replication.verify.workers import add_jobs

    add_jobs(parser)
    options = parser.parse_args(argv)
    try:
        if options.both:
            return report(options.paths, jobs=options.jobs)
        from replication.verify.run import report as alone

        return alone(options.paths, jobs=options.jobs)
    except KeyboardInterrupt:
        print("interrupted: not all certificates were checked", file=sys.stderr)
        return 130


if __name__ == "__main__":
    query = json.load(sys.stdin)
    answers = said([Path(path) for path in query["paths"]], Path(query["root"]), query["jobs"])
    json.dump(answers, sys.stdout)
