"""Makes the certificates of the wanted theorems of this paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from papers.okajima2023.experiments.declared import DIAGONAL_STEP, ENTRY_DECIMALS, LARGEST_ENTRY, SECOND_DECIMALS
from papers.okajima2023.experiments.unstable import any_entries
from papers.okajima2023.method.input_recovery import recover_inputs
from papers.okajima2023.method.recovery import exact_diagonals, recover_outputs, recover_poles
from papers.okajima2023.printed import DATA, GAINS, PLANT, matrix, poles
from replication.certify import multirate
from replication.certify.rounding import decimals
from replication.errors import AuditError
from replication.verify.subjects import subject

KEY = "okajima2023"
SECOND = "section-4c-second-setting"
"""The theorem on the second diagonal with the stated poles."""


def make(name: str) -> dict[str, Any]:
    """The certificate of one entry of theorems.json."""
    theorem = subject(KEY, name)
    return {**theorem, **MAKERS.get(theorem["statement"], nothing)(theorem)}


def nothing(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Counts and identities need no witness: the verifier computes them."""
    return {"bound": {}, "witness": {}}


def recovered(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """No witness, where the search finds the parameters of the theorem: the diagonal, or C, B_d and D too.

    They stand in theorems.json, so that the verifier need not search. Raises AuditError if the search finds others.
    """
    gains, wanted = GAINS["42"], theorem["parameters"]
    A = matrix(DATA["unstable-A"])
    found: dict[str, Any] = {"diagonal": recover_poles(A, poles(DATA["poles"]), DIAGONAL_STEP)["fits"][0]}
    if theorem["name"] == SECOND:
        found["diagonal"] = [round(entry, SECOND_DECIMALS) for entry in exact_diagonals(A, poles(DATA["poles"]))[1]]
    if "C" in wanted:
        for i, entry in enumerate(found["diagonal"]):
            A[i][i] = entry
        error_poles = [pole[0] for pole in poles(DATA["error-poles"])]
        found["C"] = recover_outputs(A, gains, error_poles, LARGEST_ENTRY)["C"]
        if "B_d" in wanted:
            inputs = recover_inputs(A, found["C"], gains)
            found |= {"B_d": inputs["B_d"], "D": inputs["D"]}
    return _as_wanted(theorem, found)


def free_setting(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """The same for the A of which all entries may differ from the print."""
    stated, error_poles = poles(DATA["poles"]), [pole[0] for pole in poles(DATA["error-poles"])]
    A = matrix(DATA["unstable-A"])
    found = any_entries(A, PLANT["C"], GAINS["42"], stated, error_poles, ENTRY_DECIMALS)
    return _as_wanted(theorem, {"A": found["rounded"]})


def _as_wanted(theorem: Mapping[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    """No witness, if these are the parameters of the theorem."""
    wanted = theorem["parameters"]
    for name, value in found.items():
        if decimals(value) != wanted[name]:
            raise AuditError(
                f"theorems.json: {name} of {theorem['name']} is {wanted[name]}, the search finds {decimals(value)}; "
                "write that there, or mend the search"
            )
    return nothing(theorem)


def recovered_design(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """An observer by Theorem 2 for the plant of Sec. IV-C as the search finds it."""
    recovered(theorem)
    given = theorem["parameters"]
    A = [list(row) for row in theorem["plant"]["A"]]
    for i, entry in enumerate(given["diagonal"]):
        A[i][i] = entry
    identity = [[str(int(i == j)) for j in range(len(A))] for i in range(len(A))]
    plant = {"A": A, "W": identity, **{name: given[name] for name in ("C", "B_d", "D")}}
    schedule = {"sensors": list(range(len(given["C"]))), "periods": given["periods"], "offsets": given["offsets"]}
    return multirate.feasible_design({"plant": plant, "parameters": schedule})


MAKERS: Mapping[str, Callable[[Mapping[str, Any]], dict[str, Any]]] = {
    "multirate.gain": multirate.gain,
    "multirate.gain-under-losses": multirate.least_gain,
    "multirate.optimum-noncausal": multirate.optimum_noncausal,
    "multirate.optimum-causal": multirate.optimum_causal,
    "multirate.shorter-periods": multirate.shorter_periods,
    "multirate.one-matrix": multirate.one_matrix,
    "multirate.recovered-poles": recovered,
    "multirate.same-setting": recovered,
    "multirate.free-setting": free_setting,
    "multirate.recovered-error-poles": recovered,
    "multirate.recovered-design": recovered_design,
}
