"""No small change of the verifier goes unnoticed by its tests."""

from __future__ import annotations

import math
import os

import pytest
from mutants import mutants_of, survivors

SAID = ("test_said",)
DUALRATE = ("test_dualrate_mathematics", "test_dualrate", *SAID)
STEPS = ("test_nonuniform_steps", "test_nonuniform", *SAID)
STAMPED = ("test_nonuniform_stamped", *SAID)
PROOFS = ("test_nonuniform_proofs", *SAID)
VERIFIER = {
    "algebra.balls": ("test_balls",),
    "algebra.decimals": ("test_run",),
    "algebra.linear": ("test_linear", "test_multirate"),
    "algebra.roots": ("test_roots",),
    "algebra.symbolic": ("test_symbolic", "test_words"),
    "algebra.words": ("test_words",),
    "delay.dual": ("test_delay_programs", *SAID),
    "delay.forms": ("test_delay", *SAID),
    "delay.hidden": ("test_delay", *SAID),
    "delay.identity": ("test_delay_identities", *SAID),
    "delay.inverse": ("test_delay_identities", *SAID),
    "delay.levels": ("test_delay", *SAID),
    "delay.pade": ("test_delay_programs", *SAID),
    "delay.plant": ("test_delay", "test_delay_programs", *SAID),
    "delay.sos": ("test_delay", *SAID),
    "dualrate.identities": DUALRATE,
    "dualrate.loop": DUALRATE,
    "dualrate.loops": DUALRATE,
    "dualrate.lyapunov": DUALRATE,
    "dualrate.motor": DUALRATE,
    "dualrate.errors": DUALRATE,
    "dualrate.response": DUALRATE,
    "dualrate.scalar": ("test_dualrate_mathematics",),
    "dualrate.theory": DUALRATE,
    "kernel": ("test_kernel", "test_symbolic"),
    "multirate.bounds": ("test_multirate", *SAID),
    "multirate.counts": ("test_multirate", *SAID),
    "multirate.identities": ("test_multirate", *SAID),
    "multirate.levels": ("test_multirate", *SAID),
    "multirate.losses": ("test_multirate_losses", *SAID),
    "multirate.orders": ("test_multirate", *SAID),
    "multirate.recovered": ("test_multirate", *SAID),
    "multirate.sensing": ("test_multirate", *SAID),
    "nonuniform.floor": STEPS,
    "nonuniform.gain": (*STEPS, "test_nonuniform_proofs", "test_nonuniform_stamped"),
    "nonuniform.grid": ("test_nonuniform_theory", *SAID),
    "nonuniform.identities": ("test_nonuniform_theory", *SAID),
    "nonuniform.levels": ("test_nonuniform", *SAID),
    "nonuniform.output": PROOFS,
    "nonuniform.smallgain": PROOFS,
    "nonuniform.stamped": STAMPED,
    "nonuniform.system": (*STEPS, "test_nonuniform_stamped"),
    "nonuniform.theory": ("test_nonuniform_theory", *SAID),
    "place": ("test_run",),
    "quantities": ("test_predicate",),
    "reading": ("test_reading",),
    "run": ("test_run",),
    "says": ("test_predicate", *SAID),
    "statement": ("test_statement", "test_predicate"),
    "subjects": ("test_run",),
}
"""The modules, and the tests that must notice each change of them."""
EQUIVALENT = [
    ("delay.identity", "MOST = 2", "became 3", "more delays than are needed"),
    (
        "delay.identity",
        "form = block([[rate, -P, one], [-P.transpose(), one * -2, zeros(2, 2)], [one, zeros(2, 2), one * -2]])",
        "became 3",
        "the example has the larger level too, since it has the smaller one",
    ),
    ("dualrate.loop", "BITS = 256", "became 257", "more bits than are needed"),
    ("dualrate.response", "TERMS, PIECES, PARTS = 24, 32, 2000", "became 25", "more terms than are needed"),
    ("dualrate.response", "TERMS, PIECES, PARTS = 24, 32, 2000", "became 33", "more pieces than are needed"),
    ("dualrate.response", "TERMS, PIECES, PARTS = 24, 32, 2000", "became 2001", "more parts than are needed"),
    (
        "run",
        "def report(paths: Sequence[Path], root: Path = ROOT, jobs: int | None = 1) -> int:",
        "became 2",
        "the lines are the same in several processes",
    ),
    (
        "run",
        'print(printable(words, sys.stdout.encoding or "ascii"), flush=True)',
        "became False",
        "seen in a process of its own only, by a test with a reader that leaves",
    ),
    (
        "nonuniform.grid",
        "b = fmpq(square.p.isqrt(), square.q.isqrt()) if square > 0 else fmpq(0)",
        "Gt became GtE",
        "the root of zero is zero",
    ),
    (
        "nonuniform.gain",
        'weight = times[share] if case.weight == "duration" else arb(1)',
        "became 2",
        "both energies have the weight",
    ),
    (
        "nonuniform.system",
        'Kind_co = TypeVar("Kind_co", bound=Estimator, covariant=True)',
        "became False",
        "types are for their checker",
    ),
    ("nonuniform.output", "BITS = 40", "became 41", "more bits than are needed"),
    ("nonuniform.smallgain", "HALVINGS = 12", "became 13", "more halvings than are needed"),
    (
        "nonuniform.smallgain",
        "h_0, ends = seconds(plant.middle), "
        '[seconds(plant.period(name, "period")) for name in (PERIODS[0], PERIODS[-1])]',
        "lost its sign or negation",
        "e^{ah} is convex and falls, so that it changes most from the middle to the lower end",
    ),
    (
        "nonuniform.system",
        'level=positive(given["level"], f"{path}.level") if level else fmpq(0),',
        "became 1",
        "a level that is not asked for is not read",
    ),
    ("nonuniform.theory", "DIGITS = 40", "became 41", "more bits than are needed"),
]
"""Changes that make nothing false: module, line of its source, change, and why no test need notice it."""


SHARE = None if os.environ.get("MUTANTS") == "all" else 16
"""How many mutants of each module are tried, evenly spread over it; all of them with MUTANTS=all (`make mutants`)."""


@pytest.mark.slow
@pytest.mark.parametrize("module", VERIFIER)
def test_every_mutant_is_noticed(module: str) -> None:
    mutants = mutants_of(f"replication.verify.{module}")
    assert len(mutants) > 5
    tried = mutants[:: math.ceil(len(mutants) / SHARE)] if SHARE else mutants
    left = [(mutant.text, mutant.change) for mutant in survivors(tried[0].module, tried, VERIFIER[module])]
    known = [(text, change) for where, text, change, _ in EQUIVALENT if where == module]
    assert left == [pair for pair in known if pair in {(mutant.text, mutant.change) for mutant in tried}]
