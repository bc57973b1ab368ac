"""Certificates of plants of one state, soon checked, whose true gains can be found by hand or by lifting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

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


def _lossy(change: Mapping[str, Any]) -> Certificate:
    certificate = lossy(LEVEL, STORED)
    for group in ("parameters", "bound", "witness"):
        certificate[group] |= {key: value for key, value in change.items() if key in certificate[group]}
    return certificate


def _word(*word: int) -> Mapping[str, Any]:
    return {"word": list(word), "v": [[["1"], ["0"]]] * len(word)}


LOSSY: Mapping[str, Mapping[str, Any]] = {
    "both lost": _word(1, 1),
    "twice after a loss": _word(2, 2),
    "no way back": _word(0, 1),
    "once too often": _word(1, 2, 1),
    "beyond the cases": _word(3),
    "one beyond the cases": _word(0, 3),
    "no pattern": _word(),
    "disturbance missing": {"word": [1, 2], "v": [[["1"], ["0"]]]},
    "no disturbance": {"v": [[["0"], ["0"]]] * 2},
    "above the pattern": {"lower": "3/5"},
    "below the gain": {"upper": "53/100"},
    "no loss followed": {"to": [[0], [0]]},
    "no loss told": {"to": [[0, 0], [0]]},
    "after no loss": {"to": [[0, 1], []]},
    "still lost": {"to": [[0, 1], [1]]},
    "one state": {"to": [[0, 1]], "at": [0], "P": [[["3"]]]},
    "begins after a loss": {"to": [[0]], "at": [1], "P": [[["3"]]]},
    "start exchanged": {"at": [1, 0], "to": [[1], [1, 0]], "P": [[["3/2"]], [["3"]]]},
    "no such state": {"at": [0, 2], "to": [[0, 1], []]},
    "a gain too few": {"L": [[["3/4"]]] * 2},
    "a gain too many": {"L": [[["3/4"]]] * 4},
    "a column too many": {"L": [[["3/4", "0"]]] * 3},
    "one column too many": {"L": [[["3/4"]], [["3/4"]], [["3/4", "0"]]]},
    "negative": {"P": [[["-1000"]]] * 2, "L": [[["0"]]] * 3},
    "two packets": {"together": 2},
    "true packets": {"together": True},
    "one more lost": {"misses": [2]},
    "twice the sensor": {"sensors": [0, 0]},
}
"""What is no longer so in the certificate of losses: each breaks one requirement, and most that alone."""
CUTS = {
    "filter": (["0", "1"], ["0", "1/3", "1"]),
    "storage": (["0", "1"], ["0", "3/4", "1"]),
    "both": (["0", "1/2"], ["1/2", "1"], ["0", "1/2", "9/10"], ["0", "1", "1"], ["0", "1", "1/2", "1"]),
}
"""Cells that leave out periods, or are those of the storage and not of the filter."""
STAMPED: Mapping[str, Mapping[str, Any]] = {
    "above the pattern": {"lower": "2501/1000"},
    "below the gain": {"upper": "249/100"},
    "no pattern": {"pattern": [], "w": []},
    "outside the range": {"pattern": [["11/10", 1]]},
    "no sample": {"pattern": [["1", 0]], "w": []},
    "disturbance missing": {"pattern": [["1", 2]]},
    "no disturbance": {"w": [[["0", "0"]]]},
    "negative": {"P": [[["-3/2"]], [["3/2"]]]},
    "flat": {"T": [["0"]]},
}


def _stamped(change: Mapping[str, Any]) -> Certificate:
    certificate = stamped("27/10", WIDE)
    for group in (certificate["bound"], certificate["witness"], certificate["witness"]["storage"]):
        group |= {key: value for key, value in change.items() if key in group}
    return certificate


def attacks() -> dict[str, Certificate]:
    """None of them is true; each has a name of its own."""
    found = {f"lossy {what}": _lossy(change) for what, change in LOSSY.items()}
    found |= {f"stamped {what}": _stamped(change) for what, change in STAMPED.items()}
    for part, listed in CUTS.items():
        for cells in listed:
            certificate = stamped("27/10", WIDE)
            for one in ("filter", "storage") if part == "both" else (part,):
                certificate["witness"][one]["cells"] = cells
            found[f"cells of {part} {cells}"] = certificate
    return {what: {**one, "name": f"by-hand-{i}"} for i, (what, one) in enumerate(found.items())}
