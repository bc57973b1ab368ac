"""Certificates of plants of one state, soon checked, whose true gains can be found by hand or by lifting."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from tampered import refused

Certificate = dict[str, Any]


def own(statement: str, **groups: Any) -> Certificate:
    return {
        "format": "replication-certificate/1", "paper": None, "name": statement, "claims": [], "statement": statement,
        **groups,
    }  # fmt: skip


A, B, NOISE = Fraction(21, 20), Fraction(1, 5), Fraction(1, 10)
GAIN = Fraction(3, 4)


def lossy(level: str, stored: Sequence[str], gains: Sequence[Fraction] = (GAIN, GAIN, GAIN)) -> Certificate:
    """x+ = 21/20 x + d/5, y = x + w/10. From below the pattern in which every second sample is lost."""
    return own(
        "multirate.gain-under-losses",
        plant={
            "name": "drift", "A": [[str(A)]], "B_d": [[str(B)]], "C": [["1"]], "D": [[str(NOISE)]], "W": [["1"]],
        },
        parameters={"sensors": [0], "periods": [1], "offsets": [0], "together": 0, "misses": [1]},
        bound={"lower": "1/100", "upper": level},
        witness={
            "L": [[[str(gain)]] for gain in gains],
            "at": [0, 1],
            "to": [[0, 1], [0]],
            "P": [[[one]] for one in stored],
            "word": [1, 2],
            "turn": [["1"]],
            "v": [[["1"], ["0"]], [["0"], ["0"]]],
        },
    )  # fmt: skip


CELLS = (Fraction(0), Fraction(1, 2), Fraction(1))
CORRECTIONS = ((Fraction(9, 10), Fraction(0)), (Fraction(3, 5), Fraction(1, 10)))
"""G after short periods and after long ones: these leave 2/5 of the error, so that long after long is worst."""


def stamped(
    level: str,
    stored: Sequence[str],
    corrections: Sequence[tuple[Fraction, Fraction]] = CORRECTIONS,
    rate: str = "0",
    pattern: Sequence[tuple[str, int]] = (("1", 1),),
) -> Certificate:
    """x' = rate x + w, y = x, z = x at periods from 1 to 2 s: an integrator where the rate is zero."""
    count = sum(number for _, number in pattern)
    return own(
        "nonuniform.stamped-gain",
        plant={
            "name": "drive", "A": [[rate]], "B": [["1"]], "C": [["1"]], "D": [["0"]], "L": [["1"]],
            "h_l": ["1", "0"], "h_u": ["2", "0"],
        },
        parameters={},
        bound={"lower": "1/100", "upper": level},
        witness={
            "filter": {"cells": list(map(str, CELLS)), "G": [[[str(x)], [str(w)]] for x, w in corrections]},
            "T": [["1"]],
            "storage": {"cells": list(map(str, CELLS)), "before": [[0, 0]], "P": [[[one]] for one in stored]},
            "pattern": [list(run) for run in pattern],
            "turn": "0",
            "w": [[["1", "0"]]] * count,
        },
    )  # fmt: skip


LEVEL = "1"
STORED = ("3", "3/2")
WIDE = ("3/2", "3/2")


def phased() -> Certificate:
    """Two sensors, one after the other in every three instants, and one packet of which none is lost: the last gain
    stands where nothing is measured, and would spoil the error elsewhere."""
    certificate = lossy("3", ("3", "3", "6"))
    certificate["plant"] |= {"C": [["1"], ["1"]], "D": [[str(NOISE), "0"], ["0", str(NOISE)]]}
    certificate["parameters"] |= {
        "sensors": [0, 1], "periods": [3, 3], "offsets": [0, 1], "together": 1, "misses": [0],
    }  # fmt: skip
    certificate["witness"] |= {
        "L": [[["3/4", "0"]], [["0", "3/4"]], [["5", "5"]]],
        "at": [0, 1, 2],
        "to": [[1], [2], [0]],
        "word": [0, 1, 2],
        "v": [[["1"], ["0"], ["0"]]] * 3,
    }
    return certificate


def exact() -> Certificate:
    """Each sample that comes takes the whole error away, so that the lower bound is met exactly."""
    certificate = lossy(LEVEL, STORED, (A, A, A))
    certificate["bound"]["lower"] = str(B)
    certificate["witness"] |= _word(0)
    return certificate


def tight() -> Certificate:
    """Bounds near each other, so that a level or a noise of another size is told."""
    certificate = lossy("109/200", ("33/10", "13/8"))
    certificate["bound"]["lower"] = "133/250"
    certificate["witness"]["v"] = [[["27/50"], ["0"]], [["79/100"], ["-3/10"]]]
    return certificate


def certificates() -> dict[str, Certificate]:
    """Of each kind a true one."""
    made = {
        "lossy": lossy(LEVEL, STORED),
        "phased": phased(),
        "exact": exact(),
        "tight": tight(),
        "stamped": stamped("27/10", WIDE),
    }
    return {f"own/{name}": {**one, "name": name} for name, one in made.items()}


def _word(*word: int) -> Mapping[str, Any]:
    return {"word": list(word), "v": [[["1"], ["0"]]] * len(word)}


def attacked(kind: str) -> Certificate:
    """The true certificate of a kind that is altered."""
    return lossy(LEVEL, STORED) if kind == "lossy" else stamped("27/10", WIDE)


ATTACKS = refused("byhand")
"""Each breaks one requirement, and most that alone."""


def attacks() -> dict[str, Certificate]:
    """None of them is true; each has a name of its own."""
    return {str(row): {**row.applied(attacked(row.name)), "name": f"by-hand-{i}"} for i, row in enumerate(ATTACKS)}
