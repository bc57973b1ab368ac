"""Makes the certificates of the wanted theorems of this paper."""

from __future__ import annotations

from typing import Any

from papers.peet2019.experiments.scaling import SMALL_LEVEL
from papers.peet2019.method import lmi_gain, pade_model
from replication.certify.delay import dual as delay_dual
from replication.certify.delay import levels as delay
from replication.estimation.delay import DelayPlant
from replication.verify.subjects import subject

KEY = "peet2019"


def least(system: DelayPlant, order: int) -> float:
    """The least γ of LMI (3) with Padé sections."""
    return lmi_gain(pade_model(system, order)).gamma


MAKERS = {
    "delay.gain-upper": delay.gain_upper,
    "delay.gain-lower": delay.gain_lower,
    "delay.total-upper": delay.total_upper,
    "delay.narrow-upper": delay.narrow_upper,
    "delay.degree-lower": delay_dual.degree_lower,
    "delay.narrow-lower": delay_dual.narrow_lower,
    "delay.near-optimal": delay.near_optimal,
    "delay.pade-upper": lambda theorem: delay.pade_upper(theorem, least),
    "delay.pade-lower": delay.pade_lower,
    "delay.unstable": delay.unstable,
    "delay.not-unstable": delay.no_witness,
    "delay.dissipation-identity": delay.no_witness,
    "delay.operator-identity": delay.no_witness,
    "delay.observer-bound": delay.no_witness,
    "delay.present-only": delay.no_witness,
}


def make(name: str) -> dict[str, Any]:
    """The certificate of one entry of theorems.json; with one disturbance the infimum is zero: at a small level."""
    theorem = subject(KEY, name)
    if theorem["plant"]["name"].endswith("-single"):
        return {**theorem, **delay.gain_upper(theorem, repr(SMALL_LEVEL))}
    return {**theorem, **MAKERS[theorem["statement"]](theorem)}
