"""No small change of the verifier's inequalities goes unnoticed by its tests."""

from __future__ import annotations

import pytest
from mutants import mutants_of, survivors

VERIFIER = {
    "replication.verify.delay": ("test_delay",),
    "replication.verify.delay_dual": ("test_delay_programs",),
    "replication.verify.delay_forms": ("test_delay",),
    "replication.verify.delay_hidden": ("test_delay",),
    "replication.verify.delay_pade": ("test_delay_programs",),
    "replication.verify.delay_plant": ("test_delay",),
    "replication.verify.delay_sos": ("test_delay",),
    "replication.verify.delay_symbols": ("test_delay_identities",),
    "replication.verify.linear": ("test_linear", "test_multirate"),
    "replication.verify.multirate.bounds": ("test_multirate",),
    "replication.verify.multirate.levels": ("test_multirate",),
    "replication.verify.multirate.sensing": ("test_multirate",),
    "replication.verify.multirate.counts": ("test_multirate",),
    "replication.verify.multirate.symbolic": ("test_multirate",),
    "replication.verify.multirate.identities": ("test_multirate",),
    "replication.verify.multirate.recovered": ("test_multirate",),
    "replication.verify.dualrate_roots": ("test_dualrate_mathematics",),
    "replication.verify.dualrate_scalar": ("test_dualrate_mathematics",),
    "replication.verify.dualrate_lyapunov": ("test_dualrate_mathematics", "test_dualrate"),
    "replication.verify.nonuniform_floor": ("test_nonuniform_steps", "test_nonuniform"),
    "replication.verify.nonuniform_gain": ("test_nonuniform_steps", "test_nonuniform"),
    "replication.verify.nonuniform_grid": ("test_nonuniform_theory",),
}
"""The modules that state inequalities, and the tests that must notice each change of them."""


@pytest.mark.slow
@pytest.mark.parametrize("module", VERIFIER)
def test_every_mutant_is_noticed(module: str) -> None:
    assert len(mutants_of(module)) > 5
    assert [str(mutant) for mutant in survivors(module, VERIFIER[module])] == []
