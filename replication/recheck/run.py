"""The second verifier from outside: a certificate file in, what is proved or why nothing is out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from replication.recheck import delay, dualrate, multirate, nonuniform
from replication.recheck.reading import WORD, Certificate, Proof, Unproved, load, need, number, take, word
from replication.recheck.subjects import ROOT, wanted

CHECKS: dict[str, Callable[[Certificate], Proof]] = {
    **multirate.CHECKS,
    **nonuniform.CHECKS,
    **dualrate.CHECKS,
    **delay.CHECKS,
}
"""By statement, the function that proves a certificate of it or raises Unproved."""
FIELDS = ("format", "paper", "name", "claims", "statement", "plant", "parameters", "bound", "witness")


def check(path: Path, root: Path = ROOT) -> Proof | str:
    """What a certificate file proves, or the reason why nothing is; never raises on account of the file."""
    try:
        return proof(load(path), root, _place(path, root))
    except Unproved as reason:
        return str(reason)
    except RecursionError as failure:
        return f"the check ended in {type(failure).__name__}"
    except (ArithmeticError, LookupError, TypeError, ValueError, AttributeError, OSError) as failure:
        return f"the check ended in {type(failure).__name__}: {failure}"


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
    if given["paper"] is None:
        need(given["claims"] == [], "an own plant supports no claims")
    else:
        for field, right in wanted(word(given["paper"], "paper"), given["name"], root).items():
            # Lists of texts, integers and the like: written out, 1 and true differ.
            need(repr(_sorted(given[field])) == repr(_sorted(right)), f"{field} is not that of the theorem wanted")
    statement = word(given["statement"], "statement")
    need(statement in CHECKS, f"no check of {statement!r:.60} here")
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
