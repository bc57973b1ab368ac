"""H∞-optimal observers for systems with several state delays: synthesis by sums of squares, gains, closed loop."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.conic.sdpa import SdpaOptions
    from replication.estimation.delay.collocation import Scheme
    from replication.estimation.delay.exact.limit import Limit, limit
    from replication.estimation.delay.exact.loop import exact_gain, worst_gain
    from replication.estimation.delay.facade import analyse, design, simulate
    from replication.estimation.delay.general.observer import DelayObserver
    from replication.estimation.delay.general.plant import DelayPlant, plant_of
    from replication.estimation.delay.general.result import InnovationsResult
    from replication.estimation.delay.lmi import lmi_gain, riccati_gain
    from replication.estimation.delay.models import Model, chebyshev_model, from_control, pade_model, to_control
    from replication.estimation.delay.observer import ErrorSystem, error_system
    from replication.estimation.delay.operators.gains import GainValues, ObserverGains, evaluate, observer_gains
    from replication.estimation.delay.operators.galerkin import GalerkinCheck, check
    from replication.estimation.delay.response import Trajectory, hinf_norm
    from replication.estimation.delay.result import DelayAnalysis, DelayResult
    from replication.estimation.delay.sos.certificate import Certificate, certificate_at
    from replication.estimation.delay.sos.cone import DegreeRule
    from replication.estimation.delay.sos.least_gain import LeastGain, minimum_gain
    from replication.estimation.delay.spectrum import frequency_response, hinf_gain, rightmost_roots
    from replication.estimation.delay.system import DelaySystem, delay_system
else:
    from replication.estimation.lazy import lazy

    __getattr__ = lazy(
        __name__,
        {
            "collocation": "Scheme",
            "sos.cone": "DegreeRule",
            "exact.limit": "Limit limit",
            "exact.loop": "exact_gain worst_gain",
            "facade": "analyse design simulate",
            "general.observer": "DelayObserver",
            "general.plant": "DelayPlant plant_of",
            "general.result": "InnovationsResult",
            "operators.gains": "GainValues ObserverGains evaluate observer_gains",
            "operators.galerkin": "GalerkinCheck check",
            "sos.least_gain": "LeastGain minimum_gain",
            "lmi": "lmi_gain riccati_gain",
            "models": "Model chebyshev_model from_control pade_model to_control",
            "observer": "ErrorSystem error_system",
            "response": "Trajectory hinf_norm",
            "result": "DelayAnalysis DelayResult",
            ".conic.sdpa": "SdpaOptions",
            "spectrum": "frequency_response hinf_gain rightmost_roots",
            "sos.certificate": "Certificate certificate_at",
            "system": "DelaySystem delay_system",
        },
    )

__all__ = [
    "Certificate",
    "DegreeRule",
    "DelayAnalysis",
    "DelayObserver",
    "DelayPlant",
    "DelayResult",
    "DelaySystem",
    "ErrorSystem",
    "GainValues",
    "GalerkinCheck",
    "InnovationsResult",
    "LeastGain",
    "Limit",
    "Model",
    "ObserverGains",
    "Scheme",
    "SdpaOptions",
    "Trajectory",
    "analyse",
    "certificate_at",
    "chebyshev_model",
    "check",
    "delay_system",
    "design",
    "error_system",
    "evaluate",
    "exact_gain",
    "frequency_response",
    "from_control",
    "hinf_gain",
    "hinf_norm",
    "limit",
    "lmi_gain",
    "minimum_gain",
    "observer_gains",
    "pade_model",
    "plant_of",
    "riccati_gain",
    "rightmost_roots",
    "simulate",
    "to_control",
    "worst_gain",
]
