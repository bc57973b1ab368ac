"""Makes the certificates of the wanted theorems of this paper."""

from collections.abc import Mapping
from functools import partial

from papers._common import Maker, certificate
from papers.peet2019.experiments.scaling import SMALL_LEVEL
from papers.peet2019.method import lmi_gain, pade_model
from replication.certify.delay import dual as delay_dual
from replication.certify.delay import levels as delay
from replication.estimation.delay import DelayPlant

SMALL = repr(SMALL_LEVEL)
"""The level with one disturbance, of which the infimum is zero."""


def least(system: DelayPlant, order: int) -> float:
    """The least γ of LMI (3) with Padé sections."""
    return lmi_gain(pade_model(system, order)).gamma


MAKERS: Mapping[str, Maker] = {
    "gain-upper": lambda theorem: delay.gain_upper(
        theorem, SMALL if theorem["plant"]["name"].endswith("-single") else None
    ),
    "gain-lower": delay.gain_lower,
    "total-upper": partial(delay.gain_upper, rule="total"),
    "narrow-upper": delay.gain_upper,
    "degree-lower": delay_dual.degree_lower,
    "narrow-lower": delay_dual.degree_lower,
    "near-optimal": delay.near_optimal,
    "pade-upper": lambda theorem: delay.pade_upper(theorem, least),
    "pade-lower": delay.gain_lower,
    "unstable": delay.unstable,
}
make = partial(certificate, "peet2019", MAKERS)
"""The certificate of one entry of theorems.json."""
