"""Makes the certificates of the wanted theorems of this paper."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from papers._common import certificate
from papers.okajima2023.experiments.declared import LARGEST_ENTRY, TRIED
from papers.okajima2023.experiments.unstable import stated_matrices
from papers.okajima2023.method.recovery import recover_outputs
from papers.okajima2023.printed import PLANT
from replication.certify import decimals, multirate
from replication.errors import AuditError

MATRICES = {"free": "any entries", "second": "other diagonal"}
"""Which A that has the stated poles a theorem is on, by a part of its name; else that of the grid."""


def recovered(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """No witness, where the search finds the parameters of the theorem: A or its diagonal; C too, or the inputs.

    They stand in theorems.json, so that the verifier need not search. Raises AuditError if the search finds others.
    """
    parameters, matrices = theorem["parameters"], stated_matrices(**TRIED)
    name = next((which for part, which in MATRICES.items() if part in theorem["name"]), "diagonal in steps")
    plant: dict[str, Any] = {**PLANT, "A": matrices[name], "diagonal": np.diag(matrices[name]).tolist()}
    if "C" in parameters:
        stated = TRIED["stated"]
        plant["C"] = recover_outputs(plant["A"], stated["gains"], stated["error_poles"], LARGEST_ENTRY)["C"]
    for parameter in parameters.keys() & plant.keys():
        if decimals(plant[parameter]) != parameters[parameter]:
            raise AuditError(
                f"theorems.json: {parameter} of {theorem['name']} is {parameters[parameter]}, the search finds "
                f"{decimals(plant[parameter])}; write that there, or mend the search"
            )
    return {}


def stated_design(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """An observer by Theorem 2 for an A that has the stated poles, all else as in Sec. IV-A."""
    recovered(theorem)
    parameters, C = theorem["parameters"], theorem["plant"]["C"]
    identity = np.eye(len(parameters["A"]), dtype=int).astype(str).tolist()
    plant = {"W": identity, "C": C, **{name: parameters[name] for name in ("A", "B_d", "D")}}
    schedule = {"sensors": list(range(len(C))), "periods": parameters["periods"], "offsets": parameters["offsets"]}
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
    "free-setting": recovered,
    "recovered-error-poles": recovered,
    "stated-design": stated_design,
}
make = partial(certificate, "okajima2023", MAKERS)
"""The certificate of one entry of theorems.json."""
