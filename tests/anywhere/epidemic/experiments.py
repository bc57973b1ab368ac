"""The epidemic of Kermack and McKendrick, in steps of time."""


def epidemic(reproduction: float, days: float, step: float) -> dict[str, list[float]]:
    """The infected and all who have been, as parts of the population, until next to nobody is infected."""
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
    return {"time": times[::50], "infected": course[::50], "final": [1.0 - susceptible]}


def _change(susceptible: float, infected: float, reproduction: float, days: float) -> tuple[float, float]:
    catching = reproduction / days * susceptible * infected
    return -catching, catching - infected / days
