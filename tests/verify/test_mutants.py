"""No small change of the verifier goes unnoticed by its tests."""

from __future__ import annotations

import math
import os

import pytest
from mutants import mutants_of, survivors

THEORY = ("test_dualrate_mathematics", "test_dualrate")
VERIFIER = {
    "balls": ("test_balls",),
    "delay": ("test_delay",),
    "delay_dual": ("test_delay_programs",),
    "delay_forms": ("test_delay",),
    "delay_hidden": ("test_delay",),
    "delay_identity": ("test_delay_identities",),
    "delay_inverse": ("test_delay_identities",),
    "delay_pade": ("test_delay_programs",),
    "delay_plant": ("test_delay",),
    "delay_sos": ("test_delay",),
    "delay_symbols": ("test_delay_identities",),
    "dualrate": THEORY,
    "dualrate_identities": THEORY,
    "dualrate_loop": THEORY,
    "dualrate_lyapunov": THEORY,
    "dualrate_motor": THEORY,
    "dualrate_orders": THEORY,
    "dualrate_response": THEORY,
    "dualrate_roots": ("test_dualrate_mathematics",),
    "dualrate_scalar": ("test_dualrate_mathematics",),
    "dualrate_theory": THEORY,
    "linear": ("test_linear", "test_multirate"),
    "multirate.bounds": ("test_multirate",),
    "multirate.counts": ("test_multirate",),
    "multirate.identities": ("test_multirate",),
    "multirate.levels": ("test_multirate",),
    "multirate.recovered": ("test_multirate",),
    "multirate.sensing": ("test_multirate",),
    "multirate.symbolic": ("test_multirate",),
    "nonuniform": ("test_nonuniform",),
    "nonuniform_floor": ("test_nonuniform_steps", "test_nonuniform"),
    "nonuniform_gain": ("test_nonuniform_steps", "test_nonuniform"),
    "nonuniform_grid": ("test_nonuniform_theory",),
    "nonuniform_identities": ("test_nonuniform_theory",),
    "nonuniform_system": ("test_nonuniform_steps", "test_nonuniform"),
    "nonuniform_theory": ("test_nonuniform_theory",),
    "printed": ("test_run",),
    "reading": ("test_reading",),
    "run": ("test_run",),
    "subjects": ("test_run",),
    "symbols": THEORY,
}
"""The modules, and the tests that must notice each change of them."""
EQUIVALENT = [
    ("dualrate_loop", "BITS = 256", "became 257", "more bits than are needed"),
    ("dualrate_response", "TERMS, PIECES, PARTS = 24, 32, 2000", "became 25", "more terms than are needed"),
    ("dualrate_response", "TERMS, PIECES, PARTS = 24, 32, 2000", "became 33", "more pieces than are needed"),
    ("dualrate_response", "TERMS, PIECES, PARTS = 24, 32, 2000", "became 2001", "more parts than are needed"),
    (
        "run",
        'print(printable(words, sys.stdout.encoding or "ascii"), flush=True)',
        "became False",
        "seen in a process of its own only, by a test with a reader that leaves",
    ),
    ("nonuniform_theory", "DIGITS = 40", "became 41", "more bits than are needed"),
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
