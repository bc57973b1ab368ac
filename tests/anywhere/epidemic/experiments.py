"""The epidemic of Kermack and McKendrick, in steps of time."""

from math import exp, log
from typing import Any


def epidemic(reproduction: float, days: float, step: float) -> dict[str, Any]:
    """The infected as a part of the population, until next to nobody is infected, and what follows from that."""
    time, susceptible, infected = 0.0, 1.0 - 1e-6, 1e-6
    times, course = [time], [infected]
    while infected > 1e-9:
        # Both steps of Heun's method.
        first = _change(susceptible, infected, reproduction, days)
        second = _change(susceptible + step * first[0], infected + step * first[1], reproduction, days)
        susceptible += step * (first[0] + second[0]) / 2
        infected += step * (first[1] + second[1]) / 2
        time += step
        times.append(time)
        course.append(infected)
    rate = log(course[50] / course[0]) / times[50]
    found = {"growth": rate, "doubling": log(2) / rate, "final": 1.0 - susceptible}
    return {"time": times[::50], "infected": course[::50], **found}


def closed(reproduction: float, days: float) -> dict[str, float]:
    """The same numbers without a course; the final size is the root of z = 1 - exp(-R z), by bisection."""
    low, high = 0.5, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if middle < 1 - exp(-reproduction * middle) else (low, middle)
    rate = (reproduction - 1) / days
    return {"growth": rate, "doubling": log(2) / rate, "final": low}


def _change(susceptible: float, infected: float, reproduction: float, days: float) -> tuple[float, float]:
    catching = reproduction / days * susceptible * infected
    return -catching, catching - infected / days
