"""Makes the certificates of the wanted theorems of this paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from papers._common import certificate
from papers.okajima2023.experiments.declared import DIAGONAL_STEP, ENTRY_DECIMALS, LARGEST_ENTRY, SECOND_DECIMALS
from papers.okajima2023.experiments.unstable import any_entries
from papers.okajima2023.method.recovery import exact_diagonals, recover_outputs, recover_poles
from papers.okajima2023.printed import DATA, GAINS, PLANT, poles
from replication.audit.judge.printed import number
from replication.certify import multirate
from replication.certify.rounding import decimals
from replication.errors import AuditError

SECOND = ("section-4c-second-setting", "section-4c-second-design")
"""The theorems on the second diagonal with the stated poles."""
FREE_DESIGN = "section-4c-free-design"
"""That on a design for an A of which all entries may differ from the print."""


def make(name: str) -> dict[str, Any]:
    """The certificate of one entry of theorems.json."""
    return certificate("okajima2023", name, MAKERS)


def recovered(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """No witness, where the search finds the parameters of the theorem: the diagonal, or C too.

    They stand in theorems.json, so that the verifier need not search. Raises AuditError if the search finds others.
    """
    diagonal = _diagonal(theorem["name"])
    found: dict[str, Any] = {"diagonal": diagonal}
    if "C" in theorem["parameters"]:
        error_poles = [pole[0] for pole in poles(DATA["error-poles"])]
        found["C"] = recover_outputs(_with(diagonal), GAINS["42"], error_poles, LARGEST_ENTRY)["C"]
    return _as_wanted(theorem, found)


def _diagonal(name: str) -> list[float]:
    """The diagonal with the stated poles that the theorem of this name is on."""
    A, stated = number(DATA["unstable-A"]), poles(DATA["poles"])
    if name in SECOND:
        return [round(entry, SECOND_DECIMALS) for entry in exact_diagonals(A, stated)[1]]
    return list(recover_poles(A, stated, DIAGONAL_STEP)["fits"][0])


def _with(diagonal: list[float]) -> list[list[float]]:
    """A of eq. (41) with another diagonal."""
    A: list[list[float]] = number(DATA["unstable-A"])
    for i, entry in enumerate(diagonal):
        A[i][i] = entry
    return A


def free_setting(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """The same for the A of which all entries may differ from the print."""
    return _as_wanted(theorem, {"A": _free()})


def _free() -> list[list[float]]:
    stated, error_poles = poles(DATA["poles"]), [pole[0] for pole in poles(DATA["error-poles"])]
    found = any_entries(number(DATA["unstable-A"]), PLANT["C"], GAINS["42"], stated, error_poles, ENTRY_DECIMALS)
    rounded: list[list[float]] = found["rounded"]
    return rounded


def _as_wanted(theorem: Mapping[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    """No witness, if these are the parameters of the theorem."""
    wanted = theorem["parameters"]
    for name, value in found.items():
        if decimals(value) != wanted[name]:
            raise AuditError(
                f"theorems.json: {name} of {theorem['name']} is {wanted[name]}, the search finds {decimals(value)}; "
                "write that there, or mend the search"
            )
    return {}


def stated_design(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """An observer by Theorem 2 for an A that has the stated poles, all else as in Sec. IV-A."""
    given, C = theorem["parameters"], theorem["plant"]["C"]
    A = _free() if theorem["name"] == FREE_DESIGN else _with(_diagonal(theorem["name"]))
    _as_wanted(theorem, {"A": A, **{name: PLANT[name] for name in ("B_d", "D")}})
    identity = [[str(int(i == j)) for j in range(len(A))] for i in range(len(A))]
    plant = {"W": identity, "C": C, **{name: given[name] for name in ("A", "B_d", "D")}}
    schedule = {"sensors": list(range(len(C))), "periods": given["periods"], "offsets": given["offsets"]}
    return multirate.feasible_design({"plant": plant, "parameters": schedule})


MAKERS = {
    "gain": multirate.gain,
    "gain-under-losses": multirate.least_gain,
    "optimum-noncausal": multirate.optimum_noncausal,
    "optimum-causal": multirate.optimum_causal,
    "shorter-periods": multirate.shorter_periods,
    "one-matrix": multirate.one_matrix,
    "recovered-poles": recovered,
    "same-setting": recovered,
    "free-setting": free_setting,
    "recovered-error-poles": recovered,
    "stated-design": stated_design,
}
