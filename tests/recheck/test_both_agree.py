"""Both verifiers say the same of altered certificates, and a small fault in either is told by the other."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest.mock import patch

import faults
import mutants
import pytest
from corpus import NAMES, Certificate, about_another, altered, true

import replication.verify.run as first
from replication import twice
from replication.recheck import run as second
from replication.recheck.reading import Unproved
from replication.verify.run import STATEMENTS

ROOT = Path(__file__).parents[2]
WHOLE = os.environ.get("MUTANTS") == "all"
STEP = 1 if WHOLE else 32
"""Of the altered certificates every so many are tried; all of them with MUTANTS=all (`make mutants-both`)."""
FEW = 4
"""Of the alterations every so many are the corpus on which all faults are tried, so that it is soon made."""
SHARE = 2
"""Faults of every third module that are tried, evenly spread over it; all of all with MUTANTS=all."""
NOTICED = 0.3
"""Of the faults at least so many change an answer on the corpus: it would not find much if it were weaker."""
WIDE = ("shao/condition", "shao/condition-scalar", "shao/counterexample")
KNOWN = {(path, field) for path in WIDE for field in ("low", "high", "least", "most")}
"""Certificates, and the field altered, that one verifier alone accepts: where the bounds of an eigenvalue are wide, the
intervals of the second enclose the left side of (18) more narrowly than the balls of the first. Both are sound.
"""


def differing(path: str, certificate: Certificate) -> Iterator[tuple[str, str]]:
    """The alterations of a certificate on which the verifiers differ."""
    for place, one in enumerate(altered(certificate)):
        if place < faults.FIRST or place % STEP == 0:
            outcome, found = faults.by_first(one), faults.by_second(one)
            if twice.compared(outcome, found).conflict:
                yield path, _changed(certificate, one)
            # A refusal says why.
            assert "ended in" not in outcome.reason, (path, place, outcome.reason)
            assert not isinstance(found, Unproved) or "ended in" not in str(found), (path, place, found)


def _changed(one: Any, other: Any, field: str = "") -> str:
    """The innermost field that differs."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        keys = [key for key in one if one[key] != other[key] and key not in ("paper", "claims")]
        return _changed(one[keys[0]], other[keys[0]], keys[0]) if keys else field
    return field


FINER = {
    ("mustafa/output-matrix", "half-spaces do not bound"),  # the second improves the bounds of all entries by turns
    ("mustafa/output-matrix", "no C_f has this level"),  # so it sees sooner that there is none
    ("shao/prediction-bound", "is not proved to fail for all periods"),
}
"""Certificates, and the refusal of one verifier, where the other one encloses more narrowly; both are sound."""


@pytest.mark.slow
@pytest.mark.parametrize("paper", NAMES)
def test_both_say_the_same_if_the_paper_were_about_another_plant(paper: str) -> None:
    """Shapes and mathematics alone: what a paper is about is compared elsewhere."""
    found = set()
    with patch.object(first, "subject", return_value={}), patch.object(second, "wanted", return_value={}):
        for path, certificate in true().items():
            for place, one in enumerate(about_another(certificate) if path.startswith(f"{paper}/") else ()):
                if place % (1 if WHOLE else 4) == 0:
                    outcome, other = faults.by_first(one), faults.by_second(one)
                    reason = outcome.reason if outcome.theorem is None else str(other)
                    if twice.compared(outcome, other).conflict:
                        found.add((path, next((words for _, words in FINER if words in reason), reason)))
                    assert "ended in" not in reason, (path, reason)
    assert found <= FINER


@pytest.mark.slow
@pytest.mark.parametrize("paper", [*NAMES, "own"])
def test_both_say_the_same_of_altered_certificates(paper: str) -> None:
    found = [pair for path, one in true().items() if path.startswith(f"{paper}/") for pair in differing(path, one)]
    assert set(found) <= KNOWN


def test_the_corpus_has_a_certificate_of_each_statement() -> None:
    assert {one["statement"] for one in true().values()} == set(STATEMENTS)


def modules() -> list[str]:
    """The modules of both verifiers that decide what is proved."""
    found = []
    for room in ("recheck", "verify"):
        for path in sorted((ROOT / "replication" / room).rglob("*.py")):
            if not path.stem.startswith("__"):
                found.append(".".join(path.relative_to(ROOT).with_suffix("").parts))
    return found


@cache
def corpus() -> list[faults.Case]:
    listed = faults.cases(FEW if WHOLE else 10 * STEP)
    return [case for case in listed if not twice.compared(case.one, case.other).conflict]


@pytest.mark.slow
def test_a_fault_that_changes_an_answer_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """What a faulty verifier says is compared with the word of the other: no changed answer passes for that of both.

    Faults that change none are told by `make mutants-both`, for reading: most leave a check as good as it was.
    """
    tried, left = 0, []
    for name in modules() if WHOLE else modules()[::3]:
        import_module(name)
        listed = mutants.mutants_of(name)
        chosen = listed if WHOLE else listed[:: max(1, math.ceil(len(listed) / SHARE))]
        found = list(faults.unnoticed(name, chosen, corpus(), faults.MOST))
        tried += len(chosen)
        left += found
        if WHOLE:  # as it comes, so that what an interrupted run has found is not lost
            with capsys.disabled():
                print("", f"{name}: {len(found)} of {len(chosen)} change no answer", *found, sep="\n", flush=True)
    with capsys.disabled():
        print(f" [{tried} faults: {tried - len(left)} change an answer, and the other verifier tells]", end="")
    assert tried > 20
    assert tried - len(left) > NOTICED * tried


FAULTS = (
    ("recheck.multirate.orders", "require_seen_late(shorter", "require_seen_late left out", "shorter-periods"),
    ("recheck.multirate.orders", "lower**2 * spent <= seen", "became 3", "gains-38-one-matrix"),
    ("recheck.nonuniform.condition", "scaled(time, [[real", "lost its sign or negation", "condition-8-1"),
    ("recheck.nonuniform.filters", "(sign if k == j", "Sub became Add", "output-matrix"),
    ("recheck.delay.observer", "return first - supplied", "Sub became Add", "observer-bound"),
    ("recheck.delay.squares", "return a + b <= most", "LtE became GtE", "ex1-total-upper"),
    ("recheck.dualrate.steps", "a4 = 2 *", "Mult became Add", "collected-constant"),
)
"""Module, line, change, and the certificate of whose alterations one must tell it."""


@pytest.mark.slow
@pytest.mark.parametrize(("module", "text", "change", "name"), FAULTS)
def test_a_fault_of_the_mathematics_is_told(module: str, text: str, change: str, name: str) -> None:
    module = f"replication.{module}"
    import_module(module)
    seeded = [one for one in mutants.mutants_of(module) if text in one.text and one.change == change]
    (certificate,) = [one for one in true().values() if one["name"] == name]
    assert seeded
    assert list(faults.unnoticed(module, seeded, faults.made_of(certificate, 3))) == []


NEWEST = tuple(
    f"{room}.{name}" for room in ("recheck", "verify") for name in ("multirate.losses", "nonuniform.stamped")
)
LEAVES = (
    ("MOST_", "how much work is asked for at most; the tests of the first verifier count it"),
    ("is not positive", "the fall along a pattern that is stable, as the one from below must be, needs positive P"),
    ("decide(Positive(P[i]", "the same"),
    ("is not stable", "positive P that fall are stable in every pattern"),
    ("is_schur(", "the same"),
    ("every case of its state", "lists of two lengths are not walked together"),
    ("needs an entry for each case", "the same"),
    ("an input for each case", "the same"),
    ("a case that is none", "there is no entry beyond a list"),
    ("has a case that is not there", "the same"),
    ("next_ < len(states)", "the same"),
    ("fits = target < len(at)", "the same"),
    ("inputs_over(turn, v, len(around[0]", "all cases have as many inputs"),
    ("the bounds are not positive", "with a level of zero nothing falls"),
)
"""Lines of which a fault may change no answer, and why: what they refuse, another step refuses."""


@pytest.mark.slow
@pytest.mark.parametrize("module", NEWEST)
def test_each_fault_of_the_newest_statements_is_told(module: str) -> None:
    module = f"replication.{module}"
    import_module(module)
    name = module.rsplit(".", 1)[1]
    made = {"losses": ("lossy", "phased", "exact", "tight"), "stamped": ("stamped", "cells", "stamped-1")}[name]
    cases = faults.attacked(made) + [
        case for path, one in true().items() if path.rsplit("/", 1)[1] in made for case in faults.made_of(one, 1)
    ]
    assert not [case for case in cases if twice.compared(case.one, case.other).conflict]
    left = list(faults.unnoticed(module, mutants.mutants_of(module), cases))
    unexplained = [f"{one}: {one.text}" for one in left if not any(text in one.text for text, _ in LEAVES)]
    assert not unexplained, "\n".join(unexplained)
