"""What a certificate states, without its proof, and the numerics that several papers share: plain NumPy in floats.

Of a certificate are read the plant, the parameters, the bounds, and of its witness only what its sentence names:
gains, filters, patterns, levels. The storage matrices, multipliers and disturbances of the proof stay unread.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

ROOT = Path(__file__).parents[3]
STORED = ("delay.gain-upper", "delay.total-upper", "delay.narrow-upper", "delay.near-optimal")
NAMED = {"L", "word", "level", "errors", "radius", "filter", "pattern", "left", "right"}
"""Entries of a witness that its sentence names."""
MEANT = {"nonuniform.grid-solution-fails": {"P"}, **{key: {"change", "storage", "sos", "hidden"} for key in STORED}}
"""The same of some statements: "a matrix", "the gains of its storage"."""
ROUNDING = 1e-9
"""Of floats, relative to the quantity compared."""

Matrix = NDArray[np.float64]
Data = dict[str, Any]
Check = Callable[[Data], None]


@cache
def _read(paper: str) -> dict[str, Data]:
    return {path.stem: json.loads(path.read_bytes()) for path in sorted((ROOT / "certificates" / paper).glob("*.json"))}


def names(paper: str) -> dict[str, str]:
    """The statement of each certificate."""
    return {name: told["statement"] for name, told in _read(paper).items()}


def checks(module: Mapping[str, Any], **others: Check) -> dict[str, Check]:
    """The test of each statement on a paper: the function of that name in a module, or another one that is named."""
    functions = {**module, **others}
    named = {statement: statement.partition(".")[2].replace("-", "_") for statement in names(module["PAPER"]).values()}
    return {statement: functions[name] for statement, name in named.items() if name in functions}


def certificate(paper: str, name: str) -> Data:
    """Plant, parameters, bound and what the sentence names of the witness, as a copy."""
    kept, told = ("name", "paper", "statement", "plant", "parameters", "bound"), _read(paper)[name]
    return deepcopy({key: told[key] for key in kept} | {"named": _named(told["statement"], told["witness"])})


def _named(statement: str, witness: Data) -> Data:
    return {key: witness[key] for key in witness.keys() & (NAMED | MEANT.get(statement, set()))}


def array(value: Any) -> Matrix:
    """Rationals, nested as they are, to floats."""
    if isinstance(value, list):
        return np.array([array(entry) for entry in value], dtype=float)
    return np.array(float(Fraction(value)))


def number(value: Any) -> float:
    return float(Fraction(value))


@cache
def _pinned() -> dict[str, Data]:
    pins: dict[str, Data] = json.loads((ROOT / "tests" / "verify" / "said.json").read_text(encoding="utf-8"))
    return pins


def spoken(told: Data) -> str:
    """The sentence of a certificate, as another test pins it."""
    return str(_pinned()[f"{told['paper']}/{told['name']}"]["sentence"])


def held(A: Matrix, B: Matrix, time: float) -> tuple[Matrix, Matrix]:
    """e^{At} and the integral of e^{As} B from 0 to t."""
    n, m = B.shape
    E = scipy.linalg.expm(np.block([[A, B], [np.zeros((m, n + m))]]) * time)
    return E[:n, :n], E[:n, n:]


@dataclass(frozen=True)
class Altered:
    """A certificate whose sentence is false: an entry, by its path, times a factor or replaced."""

    name: str
    path: tuple[str | int, ...]
    by: float | None = None
    to: Any = None

    def __str__(self) -> str:
        change = self.to if self.by is None else f"times {self.by}"
        return f"{self.name}: {'.'.join(map(str, self.path))} {change}"


def altered(paper: str, change: Altered) -> Data:
    told = certificate(paper, change.name)
    place = told
    for key in change.path[:-1]:
        place = place[key]
    old = place[change.path[-1]]
    place[change.path[-1]] = change.to if change.by is None else str(Fraction(old) * Fraction(repr(change.by)))
    return told


def largest(gain: Callable[[Matrix], Matrix], points: Matrix, zooms: int = 8) -> float:
    """The largest value of a gain over a grid of points, which is refined about the three highest of its places."""
    values = gain(points)
    peak = float(values.max())
    for i in np.argsort(values)[-3:]:
        low, high = points[max(i - 1, 0)], points[min(i + 1, len(points) - 1)]
        for _ in range(zooms):
            inner = np.linspace(low, high, 7)
            heights = gain(inner)
            j = int(np.argmax(heights))
            low, high = inner[max(j - 1, 0)], inner[min(j + 1, 6)]
            peak = max(peak, float(heights[j]))
    return peak


def spectral_radius(M: Matrix) -> float:
    return float(np.abs(np.linalg.eigvals(M)).max())


def smallest(M: Matrix) -> float:
    """The smallest eigenvalue of a symmetric matrix."""
    return float(np.linalg.eigvalsh((M + M.T) / 2)[0])


def within(low: float, value: float, high: float, slack: float = ROUNDING) -> None:
    assert low * (1 - slack) <= value <= high * (1 + slack), f"{value!r} is not between {low!r} and {high!r}"


def chain(steps: Sequence[tuple[Matrix, Matrix, Matrix, Matrix]]) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """The lifted system of steps x+ = F x + G v, z = H x + J v, one after the other: all v to all z."""
    n, widths = len(steps[0][0]), [G.shape[1] for _, G, _, _ in steps]
    state = np.hstack([np.eye(n), np.zeros((n, sum(widths)))])
    rows, start = [], n
    for (F, G, H, J), width in zip(steps, widths, strict=True):
        now = np.zeros((width, state.shape[1]))
        now[:, start : start + width] = np.eye(width)
        rows.append(H @ state + J @ now)
        state, start = F @ state + G @ now, start + width
    out = np.vstack(rows)
    return state[:, :n], state[:, n:], out[:, :n], out[:, n:]


def on_circle(angles: float | Matrix, A: Matrix) -> NDArray[np.complex128]:
    """zI - A at z = exp(j angle), for each angle."""
    return np.multiply.outer(np.exp(1j * np.asarray(angles)), np.eye(len(A))) - A


def norms(M: NDArray[Any]) -> Matrix:
    """The spectral norm of each matrix."""
    return np.asarray(np.linalg.norm(M, 2, axis=(-2, -1)))


def transfer(system: tuple[Matrix, Matrix, Matrix, Matrix], angles: float | Matrix) -> NDArray[np.complex128]:
    """D + C (zI - A)^-1 B at z = exp(j angle), for each angle."""
    A, B, C, D = system
    out: NDArray[np.complex128] = D + C @ np.linalg.solve(on_circle(angles, A), B)
    return out


def lifted_gain(steps: Sequence[tuple[Matrix, Matrix, Matrix, Matrix]], points: int = 181, zooms: int = 8) -> float:
    """The l2 gain of periodic steps: the H-infinity norm of the lifted system, infinite unless it is stable."""
    system = chain(steps)
    if spectral_radius(system[0]) >= 1:
        return np.inf
    return largest(lambda angles: norms(transfer(system, angles)), np.linspace(0, np.pi, points), zooms)
