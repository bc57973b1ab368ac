"""Checks of matrices and scalars shared by all methods; each failure is an `InvalidInputError` naming the argument."""

from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
import scipy

from replication.errors import InvalidInputError

Array = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
Choice = TypeVar("Choice", bound=StrEnum)

if TYPE_CHECKING:
    from control import StateSpace as StateSpace
else:
    StateSpace = Any  # in annotations alone: python-control is loaded where it is needed

LARGEST = 1e120
"""Entries above are refused: products of a few would overflow."""
MOST = 2**31 - 1
"""Counts above are refused: compiled loops do not hold them."""


def as_matrix(name: str, value: Any, *, rows: int | None = None, columns: int | None = None) -> Array:
    """Return `value` as a read-only float matrix of the requested shape.

    Shapes: (rows, columns), None meaning any. A copy is made: the caller's array is left alone.
    Raises InvalidInputError if it is not numeric, not two-dimensional, not finite or of another shape.
    """
    matrix = _real_array(name, value)
    if matrix.ndim != 2:
        advice = "write a column as [[1], [2]]" if matrix.ndim else f"write a single number as [[{matrix}]]"
        raise InvalidInputError(f"{name} must have two dimensions, got shape {matrix.shape}; {advice}")
    for axis, (word, size) in enumerate((("rows", rows), ("columns", columns))):
        if size is not None and matrix.shape[axis] != size:
            raise InvalidInputError(f"{name} must have {size} {word}, got shape {matrix.shape}")
    matrix.flags.writeable = False
    return matrix


def as_array(name: str, value: Any, shape: tuple[int, ...], *, axes: str = "") -> Array:
    """Return `value` as a read-only float array of exactly `shape`; a copy, with the errors of `as_matrix`.

    axes: what the axes are, for the message, such as "(N, n, q)".
    """
    array = _real_array(name, value)
    if array.shape != shape:
        raise InvalidInputError(f"{name} must have shape {axes and f'{axes} = '}{shape}, got shape {array.shape}")
    array.flags.writeable = False
    return array


def _real_array(name: str, value: Any) -> Array:
    try:
        if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
            raise TypeError("entries are masked")
        entries = np.array(value)
        # A cast would drop imaginary parts, and read digits out of text, without a word.
        if entries.dtype.kind not in "biufO":
            raise TypeError(f"its entries are of type {entries.dtype}")
        for entry in entries.flat if entries.dtype.kind == "O" else ():
            if entry is None or isinstance(entry, (str, bytes, np.complexfloating)):
                raise TypeError(f"{entry!r} is not a number")
        array = entries.astype(float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInputError(f"{name} must be an array of real numbers, got {value!r}: {error}") from None
    largest = np.abs(array).max(initial=0.0)
    if largest <= LARGEST:  # no NaN is
        return array
    if not np.isfinite(largest):
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidInputError(f"{name} must be finite, entry {where} is {array[where]}; remove NaN and infinities")
    raise InvalidInputError(
        f"{name} has an entry of size {largest:.3g}, and its products leave the range of numbers; "
        f"choose other units, in which none exceeds {LARGEST:g}"
    )


def positive_scalar(name: str, value: Any, *, unit: str = "") -> float:
    """Return `value` as a positive finite float; raises InvalidInputError otherwise."""
    try:
        if isinstance(value, np.complexfloating):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInputError(f"{name} must be a real number, got {value!r}") from None
    if isinstance(value, (bool, np.bool_)) or not np.isfinite(number) or number <= 0:
        raise InvalidInputError(f"{name} must be positive and finite{unit and f' ({unit})'}, got {value!r}")
    return number


def positive_integer(name: str, value: Any) -> int:
    """Return `value` as an integer from 1 to MOST; raises InvalidInputError otherwise (True and 2.5 included)."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise InvalidInputError(f"{name} must be a whole number, got {value!r}")
    if value < 1:
        raise InvalidInputError(f"{name} must be at least 1, got {value}")
    if value > MOST:
        raise InvalidInputError(f"{name} must be at most {MOST}")
    return int(value)


def at_most(name: str, value: Any, most: int) -> int:
    """Return `value` as an integer from one to `most`; raises InvalidInputError otherwise."""
    whole = positive_integer(name, value)
    if whole > most:
        raise InvalidInputError(f"{name} must be at most {most}, got {whole}")
    return whole


def one_of(kind: type[Choice], value: Any) -> Choice:
    """The member of `kind` that `value` is or names; raises InvalidInputError that lists them."""
    try:
        return kind(value)
    except ValueError:
        known = ", ".join(repr(str(member)) for member in kind)
        raise InvalidInputError(f"{kind.__name__.lower()} must be one of {known}, got {value!r}") from None


def increasing_grid(name: str, values: Any) -> Array:
    """`values` as positive, increasing numbers, at least one; raises InvalidInputError."""
    grid: Array = as_matrix(name, [np.atleast_1d(values)])[0]
    if not grid.size or grid[0] <= 0 or np.any(np.diff(grid) <= 0):
        raise InvalidInputError(f"the {name} must be an increasing sequence of positive numbers, at least 1")
    return grid


def finite_vector(name: str, value: Any, size: int) -> Array:
    """`value` as `size` finite real numbers; raises InvalidInputError."""
    try:
        return np.array(as_matrix(name, [value], columns=size)[0])
    except InvalidInputError as error:
        raise InvalidInputError(f"{name} must be {size} finite real numbers, got {value!r}") from error


def undetectable_mode(state: Array, output: Array, *, discrete: bool, tolerance: float = 1e-9) -> complex | None:
    """Return an eigenvalue of `state` that is unstable and not seen by `output`, or None (Popov-Belevitch-Hautus test).

    Shapes: state (n, n), output (p, n). Stable means inside the unit circle (discrete) or the left half-plane.
    """
    for mode in hidden_modes(state, output, tolerance=tolerance):
        if abs(mode) >= 1.0 - tolerance if discrete else mode.real >= -tolerance:
            return mode
    return None


def hidden_modes(state: Array, output: Array, *, tolerance: float) -> list[complex]:
    """The eigenvalues of `state` (n, n) that `output` (p, n) does not see; of (A', B') those that B does not move."""
    size = state.shape[0]
    # Balancing undoes units of the states that would make every other mode look lost beside the largest entries.
    # The scaling may be beyond the integers to which scipy casts a permutation that is not asked for.
    with np.errstate(invalid="ignore"):
        state, (units, _) = scipy.linalg.matrix_balance(state, permute=False, separate=True)
    output = output * units
    scale = 1.0 + np.linalg.norm(state, 2)
    # Rows are normalised so that a large unit of measurement does not hide, nor a small one feign, a lost mode.
    norms = np.linalg.norm(output, axis=1, keepdims=True)
    rows = np.divide(output, norms, out=np.zeros_like(output), where=norms > 0) * scale
    modes = np.linalg.eigvals(state)
    pencils = np.empty((size, size + len(rows), size), dtype=modes.dtype)
    pencils[:, :size], pencils[:, size:] = state - modes[:, None, None] * np.eye(size), rows
    least = np.linalg.svd(pencils, compute_uv=False)[:, -1]
    return [complex(mode) for mode in modes[least <= tolerance * scale]]


class FrozenArrays(Mapping[str, Array]):
    """Read-only float copies by name; a copy by pickling is read-only again, as numpy's is not."""

    def __init__(self, arrays: Mapping[str, Any]) -> None:
        self._arrays = {name: np.array(array, dtype=float) for name, array in arrays.items()}
        for copy in self._arrays.values():
            copy.flags.writeable = False

    def __getitem__(self, name: str) -> Array:
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        return repr(self._arrays)

    def __reduce__(self) -> tuple[Any, tuple[dict[str, Array]]]:
        return FrozenArrays, (self._arrays,)


ROUNDING = 1e-9
"""Asymmetry, and size of a negative eigenvalue, that count as rounding, with every variance scaled to one."""


class NoiseFactors(NamedTuple):
    """Q, R, S = F F' + E E', D D', E D' with white noise: d = F v + E w drives the plant, D w disturbs the sensors."""

    F: Array
    E: Array
    D: Array


def noise_factors(Q: Any, R: Any, S: Any, *, disturbances: int, sensors: int) -> NoiseFactors:
    """Factors of the joint covariance [[Q, S], [S', R]] of m disturbances and the noise of q sensors.

    Q (m, m): positive semidefinite; R (q, q), or (q,) variances: positive definite; S (m, q): None stands for zero.
    Raises InvalidInputError for another shape, a matrix that is no covariance, or S that does not fit the other two.
    """
    Q, R = covariance("Q", Q, disturbances), covariance("R", R, sensors)
    units = np.sqrt(np.diag(R))
    silent = np.flatnonzero(units == 0)
    if len(silent):
        raise InvalidInputError(f"R must be positive definite, R[{silent[0]}][{silent[0]}] is 0: give it some noise")
    try:
        D = units[:, None] * np.linalg.cholesky(R / np.outer(units, units))
    except np.linalg.LinAlgError:
        raise InvalidInputError(
            "R must be positive definite, but noises of several sensors determine each other; give each some of its own"
        ) from None
    E, rest = np.zeros((disturbances, sensors)), Q
    if S is not None:
        E = np.linalg.solve(D, as_matrix("S", S, rows=disturbances, columns=sensors).T).T
        rest = Q - E @ E.T
        if (least := _least_eigenvalue(rest, np.diag(Q))) < -ROUNDING:
            raise InvalidInputError(
                f"S does not fit Q and R: Q - S R^-1 S' has the eigenvalue {least:.3g} (every variance of Q scaled to "
                "one), and must be positive semidefinite; make S smaller"
            )
    return NoiseFactors(root(rest), E, D)


def covariance(name: str, value: Any, size: int) -> Array:
    """`value`, a matrix or a vector of variances, as a covariance matrix (size, size), read-only.

    Raises InvalidInputError unless it is symmetric and semidefinite.
    """
    matrix = np.diag(value) if np.ndim(value) == 1 else value
    sigma = as_matrix(name, matrix, rows=size, columns=size)
    scale = np.sqrt(np.abs(np.outer(np.diag(sigma), np.diag(sigma))))
    if np.any(np.diag(sigma) < 0):
        where = int(np.argmin(np.diag(sigma)))
        raise InvalidInputError(
            f"{name}[{where}][{where}] is a variance and must not be negative, got {sigma[where][where]:.6g}"
        )
    if np.any(np.abs(sigma - sigma.T) > ROUNDING * np.maximum(scale, np.abs(sigma))):
        raise InvalidInputError(f"{name} must be symmetric, as every covariance is; got {sigma.tolist()}")
    if np.any(np.abs(sigma) > scale * (1 + ROUNDING)) or _least_eigenvalue(sigma, np.diag(sigma)) < -ROUNDING:
        raise InvalidInputError(
            f"{name} must be positive semidefinite, as every covariance is; its covariances are too large for its "
            "variances"
        )
    return as_matrix(name, (sigma + sigma.T) / 2)


def _least_eigenvalue(matrix: Array, variances: Array) -> float:
    """With variances scaled to one, so that units do not matter; those of zero keep their unit."""
    units = np.sqrt(np.where(variances > 0, variances, 1.0))
    return float(np.linalg.eigvalsh(matrix / np.outer(units, units))[0])


def root(matrix: Array) -> Array:
    """F (n, n) with F F' = matrix, semidefinite up to rounding; in the units of its diagonal, so that none is lost."""
    variances = np.diag(matrix)
    units = np.sqrt(np.where(variances > 0, variances, 1.0))
    values, vectors = np.linalg.eigh(matrix / np.outer(units, units))
    return np.asarray(units[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
