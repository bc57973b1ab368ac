"""Theorem 3 under readings of the degree rule, which Part 1 defines and this text does not.

A reading gives, for V and for the dissipation, the degree of Z_1, the degrees of Z_2 in its inner and outer variable
(or their total), and the degrees of the term weighted with -η(η+1): the same, or lower by one.
Theorem 3 is taken as corrected.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from papers.peet2019.experiments.examples import LOOSE, Json
from replication.estimation.conic.sdpa import one_process, solve_sdpa
from replication.estimation.delay.plant import DelayPlant, delay_system
from replication.estimation.delay.sos.cone import Blocks, ConeBlock
from replication.estimation.delay.sos.synthesis import assemble, program, reduced
from replication.estimation.delay.units import gain_scaled

MOST_SOLVED = 2
"""Degree up to which γ is solved under every reading."""


@dataclass(frozen=True)
class Rule:
    """A reading of the degree rule, of which told.toml has the words: its cones of degree d for V and dissipation."""

    storage: Callable[[int], Blocks]
    dissipation: Callable[[int], Blocks]


def cone(z1: int, inner: int, outer: int, *, total: bool = False, lower: int = 0) -> Blocks:
    """The two matrices of a cone, without and with the weight -η(η+1).

    Degree of Z_1, inner and outer degree of Z_2, total rule, and by how much the weighted term is lower.
    """
    plain = ConeBlock(z1, inner, outer, total, False)
    return plain, ConeBlock(z1 - lower, max(inner - lower, 0), max(outer - lower, 0), total, True)


CONES: dict[str, Callable[[int], Blocks]] = {
    "each": lambda d: cone(d, d, d, lower=1),
    "total": lambda d: cone(d, d, d, total=True, lower=1),
    "each-same": lambda d: cone(d, d, d),
    "total-same": lambda d: cone(d, d, d, total=True),
    "wide": lambda d: cone(d, d, 2 * d),
    "outer": lambda d: cone(d, 0, d),
    "inner": lambda d: cone(d, d, 0),
    "z1": lambda d: cone(d + 1, d, d),
    "next": lambda d: cone(d + 1, d + 1, d + 1, total=True),
}
"""By name the cones of degree d."""
HOUSE = "z2-each"
"""The rule of the library."""
READINGS = {
    f"z2-{name}": Rule(CONES[storage], CONES[dissipation])
    for name, storage, dissipation in (
        *((same, same, same) for same in ("each", "total", "each-same", "total-same", "wide", "outer", "inner")),
        ("total-wide", "total-same", "wide"),
        ("each-wide", "each-same", "wide"),
        ("total-z1", "total", "z1"),
        ("total-next", "total", "next"),
    )
}


def inside(small: Rule, big: Rule, degree: int) -> bool:
    """Whether every certificate of one rule is one of the other: the least γ of `big` is then no greater."""

    def members(block: ConeBlock) -> set[tuple[int, int]]:
        return set(zip(*(degrees.tolist() for degrees in block.kernel_basis()), strict=True))

    return all(
        a.degree <= b.degree and members(a) <= members(b)
        for left, right in ((small.storage, big.storage), (small.dissipation, big.dissipation))
        for a, b in zip(left(degree), right(degree), strict=True)
    )


def least(system: DelayPlant, reading: Rule, epsilon: float, degree: int = 1) -> float:
    """Least γ of Theorem 3 for one reading, in the units of the system, on which the meaning of ε depends."""
    blocks = reading.storage(degree), reading.dissipation(degree)
    count = 4 * degree + 3  # holds every product of the readings: twice 2d, and the weight
    task = program(reduced(assemble(system, degree, blocks=blocks, count=count)), epsilon)
    return float(solve_sdpa(task, LOOSE).linear[0])


@one_process()
def least_gains(plants: dict[str, Json], degrees: dict[str, list[int]]) -> Json:
    """By reading, example and degree: γ at ε = 0.

    From degree 3 on only for readings that leave out a certificate of total degree d, which others contain.
    """
    narrow = READINGS["z2-total"]
    return {
        name: {
            example: {
                str(degree): least(delay_system(**plants[example]), reading, 0.0, degree)
                for degree in listed
                if degree <= MOST_SOLVED or not inside(narrow, reading, degree)
            }
            for example, listed in degrees.items()
        }
        for name, reading in READINGS.items()
    }


@one_process()
def readings(plants: dict[str, Json], printed: dict[str, str], epsilon: float) -> Json:
    """For each reading and example, degree 1: γ at ε = 0, and where it may be below every print, ε > 0 for the print.

    gamma and rescaled are the same infimum in two units; where they differ it is not sharply defined numerically.
    epsilon: for the print, were γ linear between 0 and `epsilon`; solved: γ where it is solved there.
    """
    targets = {example: float(number) for example, number in printed.items()}
    systems = {example: delay_system(**plant) for example, plant in plants.items()}
    record: Json = {
        name: {
            example: {
                "gamma": least(system, reading, 0.0),
                "rescaled": targets[example] * least(gain_scaled(system, targets[example]), reading, 0.0),
            }
            for example, system in systems.items()
        }
        for name, reading in READINGS.items()
    }
    for name in attainable(record, targets):
        for example, part in record[name].items():
            slope = (least(systems[example], READINGS[name], epsilon) - part["gamma"]) / epsilon
            part["epsilon"] = (targets[example] - part["gamma"]) / slope
            part["solved"] = least(systems[example], READINGS[name], part["epsilon"])
    return record


def runs(record: Mapping[str, Any], name: str, example: str) -> list[float]:
    """γ at ε = 0 of one reading and example in every run; in exact arithmetic all are the same infimum."""
    return [record[name][example]["gamma"], record[name][example]["rescaled"]]


def attainable(record: Mapping[str, Any], printed: dict[str, float]) -> tuple[str, ...]:
    """The readings under which, for every example, some run is below the print: it is attained, though not least."""
    return tuple(name for name, parts in record.items() if all(min(runs(record, name, e)) < printed[e] for e in parts))
