"""The plant of every method, and the names and sampling period of its signals.

    x' or x+ = A x + B_u u + B_d d + B_w w,   y = C x + D_u u + D w,   z = W x

u is known, d and w are not, y is measured, z is wanted. A method's plant has those of the matrices that it uses, and
covariances Q of d, R of w, S of both and P0 of the start in place of factors. Where a paper has other letters, its own
plant keeps them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.validation import Array, StateSpace, as_matrix

ADDED = "under way"
"""What the states are called that a design adds to those of the plant."""


@dataclass(frozen=True)
class Signals:
    """Names of the states, the known inputs, the measurements and the estimated outputs.

    dt: sampling period in seconds; None if the plant is in continuous time or samples at no fixed period. units: of
    signals by name, for those that have one. disturbances: names of the inputs that disturb, where they are known.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    measurements: tuple[str, ...]
    outputs: tuple[str, ...]
    dt: float | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    disturbances: tuple[str, ...] = ()

    @classmethod
    def numbered(cls, n: int, m: int, q: int, outputs: int | None = None, dt: float | None = None) -> Self:
        """x[0], u[0], y[0], z[0] and so on: n, m and q of them; the outputs are the states unless there is a number."""
        states = numbered("x", n)
        return cls(
            states, numbered("u", m), numbered("y", q), states if outputs is None else numbered("z", outputs), dt
        )

    def to_dict(self) -> dict[str, Any]:
        """Names as lists, dt, and units if there are any: plain JSON values."""
        plain = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}
        return {name: value for name, value in plain.items() if value or name not in ("units", "disturbances")}

    def called(self, names: Iterable[str]) -> tuple[str, ...]:
        """The names, each with its unit in brackets where it has one: what a curve or a column is labelled with."""
        return tuple(f"{name} ({self.units[name]})" if name in self.units else name for name in names)

    def named(self, given: Mapping[str, Sequence[str] | None], units: Mapping[str, str] | None) -> Self:
        """With other names or units. Outputs that are the states follow their names; states that a design added keep
        theirs. Raises InvalidInputError for another number of names, one twice, or the unit of no signal."""
        own_states = sum(not name.startswith(f"{ADDED}[") for name in self.states)
        changed: dict[str, Any] = {}
        for name, names in given.items():
            if names is not None:
                counts = {own_states, len(self.states)} if name == "states" else {len(getattr(self, name))}
                changed[name] = _labels(name, names, counts)
        if "states" in changed:
            shown = len(self.outputs)
            if "outputs" not in changed and self.outputs == self.states[:shown]:
                changed["outputs"] = changed["states"][:shown]
            changed["states"] = (*changed["states"], *self.states[len(changed["states"]) :])
        every = replace(self, **changed)
        known = {name for names in (every.states, every.inputs, every.measurements, every.outputs) for name in names}
        if unknown := (units or {}).keys() - known:
            raise InvalidInputError(f"units: no signal {min(unknown)!r}; there are {', '.join(sorted(known))}")
        return replace(every, units=dict(units) if units is not None else self.units)


def _labels(kind: str, names: Sequence[str], counts: set[int]) -> tuple[str, ...]:
    if isinstance(names, str) or not all(isinstance(name, str) and name for name in names):
        raise InvalidInputError(f"{kind} must be a sequence of names, got {names!r}")
    if len(set(names)) < len(names) or len(names) not in counts:
        raise InvalidInputError(f"{kind} must be {min(counts)} different names, got {', '.join(names) or 'none'}")
    return tuple(names)


def numbered(letter: str, count: int) -> tuple[str, ...]:
    """x[0], x[1], ...: the names that python-control gives."""
    return tuple(f"{letter}[{i}]" for i in range(count))


def is_statespace(plant: Any) -> bool:
    """Whether `plant` is a `control.StateSpace`; nobody can hold one who has not imported python-control."""
    loaded = sys.modules.get("control")
    return loaded is not None and isinstance(plant, loaded.StateSpace)


def each_instant(names: Iterable[str], count: int) -> list[str]:
    """name@0 ... of all names, then name@1 ...: the names of signals over one period of `count` instants."""
    named = list(names)
    return [f"{name}@{k}" for k in range(count) for name in named]


def measured_outputs(system: StateSpace, measured: int | Sequence[int | str]) -> tuple[list[int], list[int]]:
    """Indices of the measured outputs and of the others, which are to be estimated.

    measured: how many of the first outputs, or their indices or labels. Raises InvalidInputError for an output that
    does not exist or is named twice, or if one of the two groups is empty.
    """
    labels = list(system.output_labels)
    if isinstance(measured, (np.ndarray, np.generic)):
        measured = measured.tolist()
    if isinstance(measured, int) and not isinstance(measured, bool):
        chosen = list(range(measured)) if 0 <= measured <= len(labels) else []
    elif isinstance(measured, (str, bool)) or not isinstance(measured, Sequence):
        raise InvalidInputError(f"measured must be a number of outputs or a list of them, got {measured!r}")
    else:
        chosen = [index_of(name, labels, "output") for name in measured]
    others = [i for i in range(len(labels)) if i not in chosen]
    if not chosen or not others or len(set(chosen)) < len(chosen):
        raise InvalidInputError(
            f"measured must name, once each, some of the {len(labels)} outputs {', '.join(labels)} and leave at least "
            f"one to be estimated, got {measured!r}"
        )
    return chosen, others


def index_of(name: int | str, labels: Sequence[str], kind: str) -> int:
    """The position of an input or output (`kind`) given by label or index; raises InvalidInputError listing all."""
    if isinstance(name, str) and name in labels:
        return labels.index(name)
    if isinstance(name, (int, np.integer)) and not isinstance(name, bool) and 0 <= name < len(labels):
        return int(name)
    raise InvalidInputError(f"no {kind} {name!r}; the {kind}s are {', '.join(labels)} (or their indices from 0)")


P = TypeVar("P")
NOT_GIVEN: Any = None
"""Default of a matrix that `LinearPlant` fills in."""


class LinearPlant:
    """Matrices of a plant as fields of a frozen dataclass, which calls `check` when it is made.

    `SHAPES` has them by name, with a letter each for rows and columns; equal letters are equal sizes. One that is None
    becomes the identity if it is in `IDENTITY`, else zero.
    """

    SHAPES: ClassVar[Mapping[str, str]]
    IDENTITY: ClassVar[frozenset[str]] = frozenset({"W"})
    FITTED: ClassVar[frozenset[str]] = frozenset({"B_w", "D_u"})
    """Those of which zeros fit any plant: they are left over where `dataclasses.replace` made this one."""
    NEEDED: ClassVar[Mapping[str, str]] = {
        "n": "A must have at least one state, got shape (0, 0)",
        "q": "C must have at least one row: a plant without sensors cannot be observed",
    }
    """Sizes that must not be zero, with what to say."""
    A: Array
    C: Array

    def check(self, **called: str) -> dict[str, int]:
        """Check and freeze all matrices; the sizes by letter. called: words for a matrix in messages, if not its name.

        Raises InvalidInputError for entries that are not finite and sizes that do not agree or are zero.
        """
        sizes: dict[str, int] = {}
        for name, letters in self.SHAPES.items():
            rows, columns = letters[0], letters[1]
            value, word = getattr(self, name), called.get(name, name)
            if value is None or (name in self.FITTED and not np.any(as_matrix(word, value))):
                shape = sizes.get(rows, 0), sizes.get(columns, 0)
                value = np.eye(shape[1]) if name in self.IDENTITY else np.zeros(shape)
            matrix = as_matrix(word, value, rows=sizes.get(rows), columns=sizes.get(columns))
            sizes.setdefault(rows, matrix.shape[0])
            if matrix.shape[1] != sizes.setdefault(columns, matrix.shape[1]):
                matrix = as_matrix(word, matrix, columns=sizes[columns])
            for letter in letters:
                if not sizes[letter] and letter in self.NEEDED:
                    raise InvalidInputError(self.NEEDED[letter])
            object.__setattr__(self, name, matrix)
        return sizes

    @property
    def order(self) -> int:
        """n, the number of states."""
        return len(self.A)


@dataclass(frozen=True, eq=False)
class Parts:
    """A `control.StateSpace` by what its signals are: d disturbs, u is known, y is measured, z is wanted.

    D_d and D_u: effect of d and u on y; `signals` has the names and dt.
    """

    A: Array
    B_d: Array
    B_u: Array
    C: Array
    D_d: Array
    D_u: Array
    W: Array
    signals: Signals


def parts_of(
    system: StateSpace,
    *,
    continuous: bool,
    disturbances: Sequence[int | str] | None = None,
    measured: int | Sequence[int | str] | None = None,
) -> Parts:
    """The one reader of a `control.StateSpace`, which must be in continuous time, or not.

    disturbances: inputs that disturb, by index or name, all unless given; the others are known. measured: outputs that
    are measured, all unless given; the others are wanted. Raises InvalidInputError for another type or kind of time, an
    input or output that does not exist or is named twice, or one that acts directly on what is wanted.
    """
    if not is_statespace(system):
        raise InvalidInputError(f"system must be a control.StateSpace, got {type(system).__name__}")
    if continuous and not system.isctime(strict=True):
        raise InvalidInputError(f"the plant must be continuous-time, got dt = {system.dt}; pass it before sampling")
    if not continuous and not system.isdtime(strict=True):
        raise InvalidInputError(
            f"system must be discrete-time, its dt is {system.dt}; sample it first (control.sample_system), or give dt"
        )
    labels, outputs = list(system.input_labels), list(system.output_labels)
    chosen = list(range(len(labels))) if disturbances is None else _chosen(disturbances, labels)
    known = [i for i in range(len(labels)) if i not in chosen]
    rows, targets = (list(range(len(outputs))), []) if measured is None else measured_outputs(system, measured)
    A, B, C, D = (np.asarray(part, dtype=float) for part in (system.A, system.B, system.C, system.D))
    if np.any(D[targets]):
        raise InvalidInputError("the estimated outputs must have no feedthrough from w: set these rows of D to zero")
    dt = None if continuous else 1.0 if system.dt is True else float(system.dt)
    inputs = tuple(labels[i] for i in known)
    measurements, shown = (tuple(outputs[i] for i in part) for part in (rows, targets))
    disturbing = tuple(labels[i] for i in chosen)
    signals = Signals(tuple(system.state_labels), inputs, measurements, shown, dt, disturbances=disturbing)
    D_d, D_u = D[np.ix_(rows, chosen)], D[np.ix_(rows, known)]
    return Parts(A, B[:, chosen], B[:, known], C[rows], D_d, D_u, C[targets], signals)


def _chosen(disturbances: Sequence[int | str], labels: list[str]) -> list[int]:
    if isinstance(disturbances, str) or not np.iterable(disturbances):
        raise InvalidInputError(f"disturbances must be a sequence of inputs, got {disturbances!r}; write a list")
    chosen = [index_of(name, labels, "input") for name in disturbances]
    if len(set(chosen)) < len(chosen):
        raise InvalidInputError(f"disturbances must name each input once, got {disturbances!r}")
    return chosen


def read_plant(
    plant: Any,
    kind: type[P],
    read: Callable[..., tuple[P, Signals]],
    options: Mapping[str, Any],
    *,
    arrays: str,
    refusal: str,
    advice: str = "",
) -> tuple[P, Signals]:
    """The plant that a user gave, checked, and its names: of a `kind` that has `signals`, or a `control.StateSpace`.

    read: takes the latter, and `options`, which say what its signals are. arrays: what makes a plant of arrays, for
    messages. refusal: what is said where options come with arrays. Raises InvalidInputError.
    """
    if isinstance(plant, kind):
        if any(value is not None for value in options.values()):
            raise InvalidInputError(refusal)
        signals: Signals = plant.signals  # type: ignore[attr-defined]
        return plant, signals
    if not is_statespace(plant):
        raise InvalidInputError(f"plant must be a {arrays} or a control.StateSpace, got {type(plant).__name__}{advice}")
    return read(plant, **options)
