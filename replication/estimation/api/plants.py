"""The plant of every method: matrices whose sizes agree, by one list of names, from arrays or a `control.StateSpace`.

    x' or x+ = A x + B_u u + B_d d + B_w w,   y = C x + D_u u + D w,   z = W x

u is known, d and w are not, y is measured, z is wanted. A method's plant has those of the matrices that it uses, and
covariances Q of d, R of w, S of both and P0 of the start in place of factors. Where a paper has other letters, its own
plant keeps them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.signals import Signals, index_of, is_statespace, measured_outputs
from replication.estimation.validation import Array, as_matrix

if TYPE_CHECKING:
    import control

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
            given, word = getattr(self, name), called.get(name, name)
            if given is None or (name in self.FITTED and not np.any(as_matrix(word, given))):
                shape = sizes.get(rows, 0), sizes.get(columns, 0)
                given = np.eye(shape[1]) if name in self.IDENTITY else np.zeros(shape)
            matrix = as_matrix(word, given, rows=sizes.get(rows), columns=sizes.get(columns))
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
    system: control.StateSpace,
    *,
    continuous: bool,
    disturbances: Sequence[int | str] | None = None,
    measured: int | Sequence[int | str] | None = None,
) -> Parts:
    """The one reader of a `control.StateSpace`.

    Parameters
    ----------
    system : control.StateSpace
        Of continuous or discrete time.
    continuous : bool
        Which of the two it must be.
    disturbances : sequence of int or str, optional
        Inputs that disturb, by index or name; all unless given. The others are known.
    measured : int, or sequence of int or str, optional
        Outputs that are measured; all unless given. The others are wanted.

    Raises
    ------
    InvalidInputError
        Another type or kind of time, an input or output that does not exist or is named twice, or disturbances or known
        inputs that act directly on what is wanted.
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
    seen, wanted = (list(range(len(outputs))), []) if measured is None else measured_outputs(system, measured)[:2]
    A, B, C, D = (np.asarray(part, dtype=float) for part in (system.A, system.B, system.C, system.D))
    if np.any(D[wanted]):
        raise InvalidInputError("the estimated outputs must have no feedthrough from w: set these rows of D to zero")
    dt = None if continuous else 1.0 if system.dt is True else float(system.dt)
    inputs = tuple(labels[i] for i in known)
    measurements, shown = (tuple(outputs[i] for i in part) for part in (seen, wanted))
    disturbing = tuple(labels[i] for i in chosen)
    signals = Signals(tuple(system.state_labels), inputs, measurements, shown, dt, disturbances=disturbing)
    D_d, D_u = D[np.ix_(seen, chosen)], D[np.ix_(seen, known)]
    return Parts(A, B[:, chosen], B[:, known], C[seen], D_d, D_u, C[wanted], signals)


def _chosen(disturbances: Sequence[int | str], labels: list[str]) -> list[int]:
    if isinstance(disturbances, str) or not np.iterable(disturbances):
        raise InvalidInputError(f"disturbances must be a sequence of inputs, got {disturbances!r}; write a list")
    chosen = [index_of(name, labels, "input") for name in disturbances]
    if len(set(chosen)) < len(chosen):
        raise InvalidInputError(f"disturbances must name each input once, got {disturbances!r}")
    return chosen


class PlantReader(ABC, Generic[P]):
    """A plant is of the method's own class, or a `control.StateSpace` with arguments that say what its signals are.

    Hooks: `signals_of` names the signals of the one, `read` makes the other into the one.
    """

    kind: ClassVar[type[Any]]
    arrays: ClassVar[str]
    """What makes a plant of arrays, for messages."""
    advice: ClassVar[str] = ""
    refusal: ClassVar[str] = ""
    """What is said where the arguments of a `control.StateSpace` come with arrays."""

    @abstractmethod
    def signals_of(self, plant: P) -> Signals:
        """Names of the signals of a plant of arrays."""

    @abstractmethod
    def read(self, system: Any, **given: Any) -> tuple[P, Signals]:
        """The plant in a `control.StateSpace`, with its names; raises InvalidInputError."""

    def __call__(self, plant: Any, **given: Any) -> tuple[P, Signals]:
        """The plant that a user gave, checked, and its names; raises InvalidInputError."""
        if isinstance(plant, self.kind):
            if any(value is not None for value in given.values()):
                raise InvalidInputError(self.refusal)
            return plant, self.signals_of(plant)
        if not is_statespace(plant):
            raise InvalidInputError(
                f"plant must be a {self.arrays} or a control.StateSpace, got {type(plant).__name__}{self.advice}"
            )
        return self.read(plant, **given)
