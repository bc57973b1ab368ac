"""H∞-optimal observers for systems with several state delays: synthesis by sums of squares, gains, closed loop."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.conic.sdpa import SdpaOptions
    from replication.estimation.delay.exact.limit import Limit, limit
    from replication.estimation.delay.exact.loop import exact_gain, worst_gain
    from replication.estimation.delay.facade import analyse, design, simulate
    from replication.estimation.delay.galerkin import GalerkinCheck, check
    from replication.estimation.delay.general.lines import DelayObserver
    from replication.estimation.delay.general.plant import DelayPlant, plant_of
    from replication.estimation.delay.general.result import InnovationsResult
    from replication.estimation.delay.models import (
        Model,
        chebyshev_model,
        from_control,
        lmi_gain,
        pade_model,
        riccati_gain,
        to_control,
    )
    from replication.estimation.delay.observer import ErrorSystem, Trajectory, error_system, hinf_norm
    from replication.estimation.delay.operators import GainValues, ObserverGains, evaluate, observer_gains
    from replication.estimation.delay.result import DelayAnalysis, DelayResult
    from replication.estimation.delay.sos.certificate import Certificate, LeastGain, certificate_at, minimum_gain
    from replication.estimation.delay.sos.cone import DegreeRule
    from replication.estimation.delay.spectrum import Scheme, frequency_response, hinf_gain, rightmost_roots
    from replication.estimation.delay.system import DelaySystem, delay_system
else:
    from replication.estimation.lazy import lazy

    __getattr__ = lazy(
        __name__,
        {
            ".conic.sdpa": "SdpaOptions",
            "exact.limit": "Limit limit",
            "exact.loop": "exact_gain worst_gain",
            "facade": "analyse design simulate",
            "galerkin": "GalerkinCheck check",
            "general.lines": "DelayObserver",
            "general.plant": "DelayPlant plant_of",
            "general.result": "InnovationsResult",
            "models": "Model chebyshev_model from_control lmi_gain pade_model riccati_gain to_control",
            "observer": "ErrorSystem Trajectory error_system hinf_norm",
            "operators": "GainValues ObserverGains evaluate observer_gains",
            "result": "DelayAnalysis DelayResult",
            "sos.certificate": "Certificate LeastGain certificate_at minimum_gain",
            "sos.cone": "DegreeRule",
            "spectrum": "Scheme frequency_response hinf_gain rightmost_roots",
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
