"""Small faults in one verifier, found by the other: what it then says of the corpus, against the other's word."""

from __future__ import annotations

import cProfile
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import CodeType
from typing import Any

import byhand
import mutants
from corpus import Certificate, altered, true

import replication.verify.run as first
from replication import twice
from replication.recheck import run as second
from replication.recheck.reading import Proof, Unproved
from replication.verify.theorem import Refused

SLOW, SLOWEST = 0.2, 5.0
"""Seconds of the processor beyond which an altered certificate, or a true one, is no part of a search for faults."""
FIRST = 3
"""Alterations that are always tried: bounds come first."""
PATIENCE = 5
"""Alterations of one certificate that may take too long, before no more are tried."""
MOST = 100
"""Cases on which a fault is tried, where all would take long."""


def by_first(certificate: Certificate) -> first.Outcome:
    """What the first verifier says of a certificate."""
    try:
        return first.Outcome(path=Path(certificate["name"]), theorem=first.check(certificate))
    except Refused as refusal:
        return first.Outcome(path=Path(certificate["name"]), theorem=None, reason=str(refusal))
    except Exception as failure:  # noqa: BLE001 - as its command does
        return first.Outcome(path=Path(certificate["name"]), theorem=None, reason=f"ended in {failure!r}")


def by_second(certificate: Certificate) -> Proof | Unproved:
    """What the second verifier says of a certificate."""
    try:
        return second.proof(certificate)
    except Unproved as refusal:
        return refusal
    except Exception as failure:  # noqa: BLE001 - as its command does
        return Unproved(f"ended in {failure!r}")


ASK: Mapping[str, Callable[[Certificate], Any]] = {"verify": by_first, "recheck": by_second}


@dataclass(frozen=True)
class Case:
    """A certificate, what both say of it, and by room the seconds that takes and the functions that are called."""

    certificate: Certificate
    one: first.Outcome
    other: Proof | Unproved
    seconds: Mapping[str, float]
    entered: Mapping[str, set[int]]

    def noticed(self, room: str) -> bool:
        """Whether the verifier in this room, asked again, differs from what the other one has said, or skips it."""
        if room == "verify":
            pair = twice.compared(by_first(self.certificate), self.other)
        else:
            pair = twice.compared(self.one, by_second(self.certificate))
        return bool(pair.conflict) or not pair.checked


def cases(step: int) -> list[Case]:
    """The corpus: attacks, and of each true certificate itself, the first alterations, every step-th of the others."""
    return attacked(("",)) + [case for certificate in true().values() for case in made_of(certificate, step)]


def attacked(beginnings: Sequence[str]) -> list[Case]:
    """The attacks whose names begin so."""
    chosen = [one for what, one in byhand.attacks().items() if what.startswith(tuple(beginnings))]
    return [case for one in chosen if (case := _case(one, SLOW))]


def made_of(certificate: Certificate, step: int) -> list[Case]:
    """The cases of one certificate; none if it takes too long itself, no more once several alterations have."""
    whole = _case(certificate, SLOWEST)
    found, slow = [whole] if whole else [], 0
    for place, one in enumerate(altered(certificate) if whole else ()):
        if slow < PATIENCE and place > 0 and (place < FIRST or place % step == 0):
            case = _case(one, SLOW)
            found += [case] if case else []
            slow += case is None
    return found


def _case(certificate: Certificate, limit: float) -> Case | None:
    """What both say of it; None if that takes one of them longer."""
    said: dict[str, Any] = {}
    seconds = {}
    entered: defaultdict[str, set[int]] = defaultdict(set)
    mutants._forget(mutants._own_modules())
    for room, ask in ASK.items():
        profile = cProfile.Profile()
        begin = time.process_time()
        with suppress(TooLong), _within(limit):
            said[room] = profile.runcall(ask, certificate)
        seconds[room] = time.process_time() - begin
        if room not in said or seconds[room] > limit:
            return None
        for name, line in _called(profile):
            entered[name].add(line)
    return Case(certificate, said["verify"], said["recheck"], seconds, entered)


class TooLong(BaseException):
    """The time is over; no exception of a verifier, which would tell it as a refusal."""


@contextmanager
def _within(limit: float) -> Iterator[None]:
    """Raise TooLong after so many seconds of the processor."""

    def stop(*_: object) -> None:
        raise TooLong

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, limit)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def _called(profile: cProfile.Profile) -> Iterator[tuple[str, int]]:
    """The modules of the verifiers, and the first lines, of the functions that were called."""
    files = {module.__file__: name for name, module in list(sys.modules.items()) if name.startswith(mutants.ROOM)}
    for entry in profile.getstats():
        if isinstance(entry.code, CodeType) and entry.code.co_filename in files:
            yield files[entry.code.co_filename], entry.code.co_firstlineno


def unnoticed(
    module: str, tried: Sequence[mutants.Mutant], corpus: Sequence[Case], most: int | None = None
) -> Iterator[mutants.Mutant]:
    """Those faults of a module with which its verifier says of every case what the other one says.

    most: cases on which a fault is tried, the quick ones first; which these are is not the same in each run.
    """
    room = module.split(".")[1]
    kills: defaultdict[int, int] = defaultdict(int)
    for mutant in tried:
        reached = [
            i
            for i, case in enumerate(corpus)
            if (case.entered[module] if not mutant.function else not case.entered[module].isdisjoint(mutant.function))
        ]
        # What has noticed faults before comes first, then what is quick of each certificate.
        reached.sort(key=lambda i: corpus[i].seconds[room])
        rank: defaultdict[str, int] = defaultdict(int)
        order = {}
        for i in reached:
            name = corpus[i].certificate["name"]
            order[i] = (-kills[i], rank[name], corpus[i].seconds[room])
            rank[name] += 1
        reached.sort(key=order.__getitem__)
        noticed = _noticed(mutant, room, [corpus[i] for i in reached[:most]])
        if noticed is None:
            yield mutant
        elif noticed >= 0:
            kills[reached[noticed]] += 1


def _noticed(mutant: mutants.Mutant, room: str, tried: Sequence[Case]) -> int | None:
    """The number of the case that a fault changes; -1 if it ends in the import or never; None if there is none."""
    return mutants.told_by_a_child(lambda: _first_difference(mutant, room, tried))


def _first_difference(mutant: mutants.Mutant, room: str, tried: Sequence[Case]) -> int | str:
    try:
        mutants._take_the_place(mutant)
    except Exception:  # noqa: BLE001 - whatever a fault does to an import, it is noticed
        return -1
    return next((i for i, case in enumerate(tried) if case.noticed(room)), "none")
