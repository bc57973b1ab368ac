"""What a guaranteed level is worth: the same measure without sensors, with a Kalman filter, and for a smoother."""

from __future__ import annotations

from replication.estimation.api.results import Evidence

LITTLE = 0.1
"""A level that lies less than this below that without sensors is told to be of little use."""
ADVICE = "measure more often, with less noise or something else, or do without these sensors"


def baselines(
    level: float,
    how: str,
    *,
    without: float | None,
    kalman: float | None = None,
    limit: float | None = None,
) -> tuple[Evidence, ...]:
    """Levels to compare a guaranteed `level` with, and advice where it is hardly below that without sensors.

    how: the measure, the same for all. without: of the estimate zero, None if it is infinite. kalman: of the Kalman
    filter. limit: of the best smoother, which knows all measurements, past and future; None leaves either out.
    """
    facts = [Evidence("level without sensors", "infinite" if without is None else without, f"estimate zero; {how}")]
    if kalman is not None:
        facts.append(Evidence("level of the Kalman filter", kalman, f"white noise of unit intensity; {how}"))
    if limit is not None:
        facts.append(Evidence("limit of any smoother", limit, f"all measurements, past and future; {how}"))
    if without is not None and level > (1 - LITTLE) * without:
        share = 1 - level / without
        told = f"only {100 * share:.2g} % below" if share > 0 else "not below"
        facts.append(Evidence("advice", f"{told} the level without sensors", ADVICE))
    return tuple(facts)
