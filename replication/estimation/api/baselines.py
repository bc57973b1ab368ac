"""What a guaranteed level is worth: the same measure without sensors, with a Kalman filter, and for a smoother."""

from __future__ import annotations

from replication.estimation.api.results import Bracket, Evidence

LITTLE = 0.1
"""A level that lies less than this below that without sensors is told to be of little use."""
ADVICE = "measure more often, with less noise or something else, or do without these sensors"
OPEN = "the brackets overlap: more effort may tell which is less"


def baselines(
    level: float | Bracket,
    how: str,
    *,
    without: float | Bracket | None,
    kalman: float | None = None,
    limit: float | None = None,
    what: str = "level",
    simpler: str = "",
    others: str = "",
) -> tuple[Evidence, ...]:
    """Levels to compare a guaranteed `level` with, and advice where it is hardly below one that costs less.

    how: the measure, the same for all, called `what`. without: of the estimate zero, None if it is infinite. kalman: of
    the Kalman filter. limit: of the best smoother, which knows all measurements, past and future; None leaves either
    out. simpler: what to do where a level is hardly below that of the Kalman filter; empty for no such advice. others:
    the measure of these two, if it is another. A measure that is known within a bracket is given as one.
    """
    own, others = _bracket(level), others or how
    limited = "limit" if what == "level" else f"{what}, limit"
    facts = [_without(without, what, how)]
    if kalman is not None:
        facts.append(Evidence(f"{what} of the Kalman filter", kalman, f"white noise of unit intensity; {others}"))
    if limit is not None:
        facts.append(Evidence(f"{limited} of any smoother", limit, f"all measurements, past and future; {others}"))
    advice = () if without is None else _advice(own, _bracket(without), f"the {what} without sensors", ADVICE)
    if not advice and simpler and kalman is not None:
        advice = _advice(own, _bracket(kalman), f"the {what} of the Kalman filter", simpler)
    return (*facts, *advice)


def _bracket(level: float | Bracket) -> Bracket:
    return level if isinstance(level, Bracket) else Bracket(level, level, "")


def _without(without: float | Bracket | None, what: str, how: str) -> Evidence:
    name, meaning = f"{what} without sensors", f"estimate zero; {how}"
    if without is None:
        return Evidence(name, "infinite", meaning)
    if not isinstance(without, Bracket):
        return Evidence(name, without, meaning)
    return Evidence(name, without.upper, f"{meaning}; bracket from {without.lower:.6g}, {without.method}")


def _advice(own: Bracket, other: Bracket, name: str, advice: str) -> tuple[Evidence, ...]:
    """Not below, open, or only so much below: told of whole brackets, not of one end of each."""
    if own.lower >= other.upper:
        return (Evidence("advice", f"not below {name}", advice),)
    if own.upper >= other.lower:
        ends = f"[{own.lower:.6g}, {own.upper:.6g}] against [{other.lower:.6g}, {other.upper:.6g}]"
        return (Evidence("advice", f"open whether below {name}: {ends}", OPEN),)
    share = 1 - own.lower / other.upper
    return (Evidence("advice", f"only {100 * share:.2g} % below {name}", advice),) if share < LITTLE else ()
