"""Certificates of few bytes that ask for years of work."""

import copy
from collections.abc import Callable, Mapping
from typing import Any

Certificate = dict[str, Any]
Bomb = Callable[[Mapping[str, Certificate]], Certificate]


def filled(rows: int, columns: int, entry: str = "0") -> list[list[str]]:
    """A matrix of one number."""
    return [[entry] * columns for _ in range(rows)]


def unit(size: int) -> list[list[str]]:
    """The identity matrix."""
    return [["1" if i == j else "0" for j in range(size)] for i in range(size)]


def high_degree(others: Mapping[str, Certificate]) -> Certificate:
    """A functional on squares of degree 20: zero but for the supply."""
    made = copy.deepcopy(others["peet2019/ex2-d1-lower"])
    plant, degree = made["plant"], 20
    states, powers = len(plant["A0"]), 2 * degree + 1
    functions, disturbances, outputs = states * len(plant["delays"]), len(plant["B"][0]), len(plant["C10"])
    points = disturbances + outputs + states + functions
    P = filled(points, points)
    for i in range(disturbances + outputs):
        P[i][i] = "1"
    for i in range(outputs):
        here, there = disturbances + i, disturbances + outputs + i
        P[here][there] = P[there][here] = "1"
    square, row = filled(functions, functions), filled(points, functions)
    made["parameters"]["degree"], made["bound"] = degree, {"lower": "1/1000000"}
    several = [square] * powers
    made["witness"]["functional"] = {
        "P": P, "Q": [row] * powers, "S": several, "R": [several] * powers, "coupling": several
    }  # fmt: skip
    return made


def long_product(others: Mapping[str, Certificate]) -> Certificate:
    """The product of A_e over 1,000 phases, of a plant that one sensor sees: entries of 990 digits."""
    made, n = copy.deepcopy(others["okajima2023/product"]), 3
    made["parameters"] = {"periods": [1000], "offsets": [0]}
    A = [[str(10**989 + 7 * i + 13 * j + 1) for j in range(n)] for i in range(n)]
    made["plant"] |= {"A": A, "C": filled(1, n, "1"), "L": [filled(n, 1)] * 1000}
    return made


def long_powers(others: Mapping[str, Certificate]) -> Certificate:
    """The powers of a matrix of 40 states with entries of 900 digits."""
    made = copy.deepcopy(others["okajima2023/observable"])
    made["plant"]["A"] = [[str(10**899 + 7 * i + 13 * j * j + 1) for j in range(40)] for i in range(40)]
    made["plant"]["C"] = filled(2, 40, "1")
    return made


def many_zeros(others: Mapping[str, Certificate]) -> Certificate:
    """The energy of a motion of 50 states: 2,500 equations in balls."""
    made, n = copy.deepcopy(others["mustafa/floor-2"]), 50
    plant = {name: value for name, value in made["plant"].items() if name in ("name", "h_l", "h_u")}
    decaying = [["-1" if i == j else "0" for j in range(n)] for i in range(n)]
    made["plant"] = {**plant, "A": decaying, "B": filled(n, 1, "1"), "C": filled(1, n, "1"), "D": [["1"]]}
    made["plant"]["L"] = filled(1, n, "1")
    made["witness"]["start"] = ["1"] * n
    return made


def lossy(others: Mapping[str, Certificate], sensors: int, together: int) -> Certificate:
    """One state that nothing keeps, seen by so many sensors at every instant; one sample in a row may be lost."""
    made = copy.deepcopy(others["okajima2023/lost-samples-2-3"])
    noises = [[str(int(i == j)) for j in range(sensors)] for i in range(sensors)]
    matrices = {"A": [["0"]], "B_d": [["1"]], "W": [["1"]], "C": filled(sensors, 1, "1"), "D": noises}
    made["plant"] = {"name": "", **matrices}
    made["parameters"] = {
        "sensors": list(range(sensors)), "periods": [1] * sensors, "offsets": [0] * sensors,
        "together": together, "misses": [1] * (1 if together else sensors),
    }  # fmt: skip
    return made


def many_sensors(others: Mapping[str, Certificate]) -> Certificate:
    """22 sensors that lose their samples apart from each other: four million cases at the first instant."""
    return lossy(others, 22, 0)


def many_transitions(others: Mapping[str, Certificate]) -> Certificate:
    """400 storage functions on each of 400 cells of the range."""
    made, count = copy.deepcopy(others["mustafa/range-1-upper"]), 400
    one, storage = [["1"]], [["100", "0"], ["0", "100"]]
    made["plant"] |= {"A": [["-1"]], "B": one, "C": one, "D": one, "L": one}
    filter_ = made["parameters"]["filter"] if "filter" in made["parameters"] else made["plant"]["filter"]
    filter_ |= {"A": [["0"]], "B": [["0"]], "C": [["0"]]}
    made["witness"]["storage"] = {
        "cells": [f"{i}/{count}" for i in range(count + 1)],
        "before": [[(i + j) % count for j in range(count)] for i in range(count)],
        "P": [storage] * count,
    }
    made["bound"] = {"upper": "1000"}
    return made


def of_degree(degree: int) -> Bomb:
    """A storage whose squares would hold the powers up to this degree."""

    def made(others: Mapping[str, Certificate]) -> Certificate:
        altered = copy.deepcopy(others["peet2019/ex2-d1-upper"])
        altered["parameters"]["degree"] = degree
        return altered

    made.__name__ = f"degree_{degree}"
    return made


def many_delays(name: str) -> Bomb:
    """A plant of one state with 2,000 delays."""

    def made(others: Mapping[str, Certificate]) -> Certificate:
        altered, count, one = copy.deepcopy(others[name]), 2000, [["1"]]
        delays = [str(i + 1) for i in range(count)]
        altered["plant"] |= {"A0": one, "A": [one] * count, "delays": delays, "B": one, "C10": one, "C2": one}
        altered["plant"]["C1"] = [one] * count
        altered["witness"]["change"] = one
        if "degree" in altered["parameters"]:
            altered["witness"] |= {"storage": [one, one], "dissipation": [one, one]}
        return altered

    made.__name__ = f"many_delays_{name.rpartition('/')[2]}"
    return made


BOMBS: tuple[Bomb, ...] = (
    high_degree, long_product, long_powers, many_zeros, many_sensors, many_transitions,
    of_degree(3000), of_degree(999_999_999), many_delays("peet2019/ex2-d1-upper"),
    many_delays("peet2019/ex1-pade-upper"),
)  # fmt: skip
