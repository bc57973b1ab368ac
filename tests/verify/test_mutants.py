"""No small change of the verifier goes unnoticed by its tests."""

import math
import os
import tomllib
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pytest
from mutants import Mutant, mutants_of, survivors

SAID = ("test_said",)
DUALRATE = ("test_dualrate", *SAID)
MULTIRATE = ("test_multirate", *SAID)
NONUNIFORM = ("test_nonuniform", *SAID)
VERIFIER = {
    "algebra.linear": ("test_algebra", "test_run", "test_multirate"),
    "algebra.symbolic": ("test_algebra",),
    "delay.identity": ("test_delay_identities", *SAID),
    "delay.levels": ("test_delay", "test_delay_programs", *SAID),
    "delay.plant": ("test_delay", "test_delay_programs", *SAID),
    "delay.sos": ("test_delay", *SAID),
    "dualrate.loop": DUALRATE,
    "dualrate.loops": DUALRATE,
    "dualrate.lyapunov": DUALRATE,
    "dualrate.response": DUALRATE,
    "kernel": ("test_kernel", "test_algebra"),
    "multirate.counts": MULTIRATE,
    "multirate.levels": MULTIRATE,
    "multirate.recovered": MULTIRATE,
    "multirate.sensing": MULTIRATE,
    "nonuniform.gain": NONUNIFORM,
    "nonuniform.grid": NONUNIFORM,
    "nonuniform.identities": NONUNIFORM,
    "nonuniform.levels": NONUNIFORM,
    "nonuniform.smallgain": NONUNIFORM,
    "nonuniform.system": NONUNIFORM,
    "predicate": ("test_statement", *SAID),
    "reading": ("test_reading", "test_statement"),
    "run": ("test_run",),
    "statement": ("test_statement",),
    "stdlib": ("test_balls", "test_arithmetics"),
    "stdlib.balls": ("test_balls", "test_arithmetics"),
    "stdlib.exact": ("test_arithmetics",),
    "subjects": ("test_run",),
}
"""The modules, and the tests that must notice each change of them."""
EQUIVALENT = tomllib.loads(Path(__file__).with_name("equivalent.toml").read_text(encoding="utf-8"))
"""Changes that make nothing false, and why no test need notice them."""


SHARE = None if os.environ.get("MUTANTS") == "all" else 5
"""How many mutants of each module are tried, evenly spread over it and none of `EQUIVALENT`, which only all tests
together fail to notice; all of them with MUTANTS=all (`make mutants`)."""


@pytest.mark.slow
@pytest.mark.parametrize("module", VERIFIER)
def test_every_mutant_is_noticed(module: str) -> None:
    full, tests = f"replication.verify.{module}", VERIFIER[module]
    mutants = mutants_of(full)
    assert len(mutants) > 5
    known = Counter((row["line"], change) for row in EQUIVALENT.get(module, ()) for change in row["changes"])
    assert not known - _counted(mutants), "these are gone"
    if SHARE:
        mutants = [mutant for mutant in mutants if (mutant.text, mutant.change) not in known]
        mutants, known = mutants[:: math.ceil(len(mutants) / SHARE)], Counter()
        # All certificates only where the shortest of each kind tell nothing.
        mutants = survivors(full, mutants, ["shortest" if test in SAID else test for test in tests])
    left = _counted(survivors(full, mutants, tests) if mutants else [])
    assert not left - known, "no test notices these"
    assert not known - left, "a test notices these"


def _counted(mutants: Sequence[Mutant]) -> Counter[tuple[str, str]]:
    return Counter((mutant.text, mutant.change) for mutant in mutants)
