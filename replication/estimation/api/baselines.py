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
    what: str = "level",
    simpler: str = "",
) -> tuple[Evidence, ...]:
    """Levels to compare a guaranteed `level` with, and advice where it is hardly below one that costs less.

    how: the measure, the same for all, called `what`. without: of the estimate zero, None if it is infinite. kalman: of
    the Kalman filter. limit: of the best smoother, which knows all measurements, past and future; None leaves either
    out. simpler: what to do where a level is hardly below that of the Kalman filter; empty for no such advice.
    """
    limited = "limit" if what == "level" else f"{what}, limit"
    facts = [Evidence(f"{what} without sensors", "infinite" if without is None else without, f"estimate zero; {how}")]
    if kalman is not None:
        facts.append(Evidence(f"{what} of the Kalman filter", kalman, f"white noise of unit intensity; {how}"))
    if limit is not None:
        facts.append(Evidence(f"{limited} of any smoother", limit, f"all measurements, past and future; {how}"))
    if without is not None and level > (1 - LITTLE) * without:
        facts.append(Evidence("advice", f"{_below(level, without)} the {what} without sensors", ADVICE))
    elif simpler and kalman is not None and level > (1 - LITTLE) * kalman:
        facts.append(Evidence("advice", f"{_below(level, kalman)} the {what} of the Kalman filter", simpler))
    return tuple(facts)


def _below(level: float, other: float) -> str:
    share = 1 - level / other
    return f"only {100 * share:.2g} % below" if share > 0 else "not below"
