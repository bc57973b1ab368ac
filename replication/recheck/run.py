"""The second verifier from outside: a certificate file in, what is proved or why nothing is out."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from replication.recheck import delay, dualrate, multirate, nonuniform
from replication.recheck.reading import WORD, Certificate, NoCheck, Proof, Unproved, load, need, number, take, word
from replication.recheck.subjects import ROOT, wanted

CHECKS: dict[str, Callable[[Certificate], Proof]] = {
    **multirate.CHECKS,
    **nonuniform.CHECKS,
    **dualrate.CHECKS,
    **delay.CHECKS,
}
"""By statement, the function that proves a certificate of it or raises Unproved."""
ABOUT: dict[str, tuple[str, ...]] = {
    "okajima2023": (
        *("multirate.variables", "multirate.rows", "multirate.error-system", "multirate.dissipation"),
        *("multirate.schur", "multirate.recovered-poles", "multirate.same-setting", "multirate.free-setting"),
        *("multirate.recovered-error-poles", "multirate.recovered-design", "multirate.one-matrix"),
        *("multirate.shorter-periods", "multirate.cyclic-rows"),
    ),
    "mustafa": (
        *("nonuniform.lemma-2", "nonuniform.lemma-3", "nonuniform.map", "nonuniform.congruence"),
        *("nonuniform.recovery", "nonuniform.sizes", "nonuniform.upper-end", "nonuniform.lower-end"),
        *("nonuniform.grid-size", "nonuniform.one-interval", "nonuniform.stalls", "nonuniform.same-level"),
        *("nonuniform.observer-column", "nonuniform.breaks-condition-8", "nonuniform.meets-condition-8"),
        *("nonuniform.grid-solution-fails", "nonuniform.output-matrix"),
    ),
    "shao": (
        *("dualrate.coordinates", "dualrate.sampled-observer", "dualrate.error-equations", "dualrate.step-bound"),
        *("dualrate.prediction-bound", "dualrate.contraction", "dualrate.counterexample"),
        *("dualrate.second-case", "dualrate.collected-constant"),
    ),
    "peet2019": (
        *("delay.dissipation-identity", "delay.operator-identity", "delay.not-unstable", "delay.present-only"),
        "delay.observer-bound",
    ),
}
"""By paper, the statements that speak of it, and stand with its certificates only."""
SECONDS = 20
"""Of processor time that a check may take: few bytes can ask for much more."""
FIELDS = ("format", "paper", "name", "claims", "statement", "plant", "parameters", "bound", "witness")


def check(path: Path, root: Path = ROOT) -> Proof | Unproved:
    """What a certificate file proves, or why nothing is; never raises on account of the file."""
    try:
        with _limited(SECONDS):
            value = load(path)
            found = proof(value, root, _place(path, root))
            expected = (value["paper"], f"{value['name']}.json")
            need(
                value["paper"] is None or path.resolve().parts[-2:] == expected,
                "the file should be {}/{}".format(*expected),
            )
            return found
    except Unproved as reason:
        return reason
    except Exception as failure:  # noqa: BLE001 - whatever ends a check, nothing is proved then, and the reason is told
        return Unproved(f"the check ended in {type(failure).__name__}: {failure}")


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Refuse after so much processor time; only the main thread of a process can be timed."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(*_: Any) -> None:
        raise NoCheck(f"the check takes more than {seconds:g} s")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def _place(path: Path, root: Path) -> tuple[str, str] | None:
    """The paper and the name for which a file in root/certificates stands."""
    folder = (root / "certificates").resolve()
    where = path.parent.resolve()
    return (where.relative_to(folder).as_posix(), path.stem) if where.is_relative_to(folder) else None


def proof(value: Any, root: Path = ROOT, place: tuple[str, str] | None = None) -> Proof:
    """What the JSON value of a certificate proves; place: the paper and the name that it must have."""
    given = dict(zip(FIELDS, take(value, "certificate", *FIELDS), strict=True))
    need(given["format"] == "replication-certificate/1", f"the format is {given['format']!r:.40}")
    need(WORD.fullmatch(word(given["name"], "name")) is not None, "the name is no name")
    need(place is None or place == (given["paper"], given["name"]), f"the file stands for {place}")
    need(all(isinstance(given[group], dict) for group in ("plant", "parameters", "bound", "witness")), "no objects")
    named = word(given["plant"].get("name", ""), "plant.name")
    need(named == "" or WORD.fullmatch(named) is not None, "plant.name is no name")
    if given["paper"] is None:
        need(given["claims"] == [], "an own plant supports no claims")
    else:
        for field, right in wanted(word(given["paper"], "paper"), given["name"], root).items():
            # Lists of texts, integers and the like: written out, 1 and true differ.
            need(repr(_sorted(given[field])) == repr(_sorted(right)), f"{field} is not that of the theorem wanted")
    statement = word(given["statement"], "statement")
    if statement not in CHECKS:
        raise NoCheck(f"there is no second check of {statement!r:.60}")
    about = next((paper for paper, names in ABOUT.items() if statement in names), given["paper"])
    need(about == given["paper"], f"{statement} speaks of {about}, and stands with its certificates only")
    need(set(given["bound"]) <= {"lower", "upper"}, "bound has other sides than lower and upper")
    bound = {side: number(stated, f"bound.{side}") for side, stated in given["bound"].items()}
    certificate = Certificate(
        given["paper"], given["name"], statement, given["plant"], given["parameters"], bound, given["witness"]
    )
    found = CHECKS[statement](certificate)
    for side, stated in bound.items():
        need(getattr(found, side) == stated, f"the {side} bound that is proved is {getattr(found, side)}, not {stated}")
    return found


def _sorted(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _sorted(value[key]) for key in sorted(value)}
    return [_sorted(entry) for entry in value] if isinstance(value, list) else value


def report(paths: list[Path], root: Path = ROOT) -> int:
    """Print a line for each certificate of these files, or of all that there are; 1 if one is not proved."""
    files = paths or sorted((root / "certificates").rglob("*.json"))
    failed = 0
    for path in files:
        found = check(path, root)
        failed += isinstance(found, Unproved)
        print(f"NOT PROVED {path}: {found}" if isinstance(found, Unproved) else f"proved {path}: {told(found)}")
    print(f"{len(files) - failed} of {len(files)} certificates proved by the second verifier")
    return 1 if failed or not files else 0


def told(proof: Proof) -> str:
    """What was proved, in numbers."""
    sides = [f"{side} {getattr(proof, side)}" for side in ("lower", "upper") if getattr(proof, side) is not None]
    answer = [] if proof.holds is None else ["the claim holds" if proof.holds else "the claim does not hold"]
    return ", ".join([*answer, *sides, *([f"{len(proof.items)} values"] if proof.items else [])])
