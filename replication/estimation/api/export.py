"""Gains for other programs: JSON, MATLAB's file format (level 5), and a C header; all return text or bytes."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.validation import Array

MAT_HEADER = b"MATLAB 5.0 MAT-file: gains of an estimator"
"""In place of scipy's, which holds the date: same gains, same bytes."""
MAT_HEADER_SIZE = 116
IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,30}")
C_KEYWORD = re.compile(
    "auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|"
    "restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while"
)


def to_json(values: Mapping[str, Any]) -> str:
    """Indented JSON that ends in a line feed; NaN and infinities are refused, for JSON has none."""
    return json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def to_mat(arrays: Mapping[str, Array]) -> bytes:
    """A MATLAB file (level 5) with one variable for each array; vectors become rows."""
    stream = io.BytesIO()
    scipy.io.savemat(stream, {name: np.asarray(array) for name, array in arrays.items()}, oned_as="row")
    return MAT_HEADER.ljust(MAT_HEADER_SIZE) + stream.getvalue()[MAT_HEADER_SIZE:]


def to_c_header(name: str, arrays: Mapping[str, Array], axes: Mapping[str, str], comment: str) -> str:
    """`static const double NAME_ARRAY[..]` in row-major order, each with its shape as macros NAME_ARRAY_DIM0 and so on.

    Raises InvalidInputError if `name` is no C identifier of at most 31 characters or is a keyword of the language.
    """
    guard = f"{c_name(name).upper()}_H"
    lines = [f"/* {comment_text(comment)} */", f"#ifndef {guard}", f"#define {guard}", ""]
    for key, array in arrays.items():
        symbol = f"{name}_{key}"
        lines.append(f"/* {key}: {comment_text(axes[key])}, row-major */")
        lines += [f"#define {symbol.upper()}_DIM{i} {size}" for i, size in enumerate(array.shape)]
        lines.append(c_array(symbol, array))
    return "\n".join([*lines, f"#endif /* {guard} */", ""])


def c_name(name: str) -> str:
    """The name itself; raises InvalidInputError unless it is a C identifier of at most 31 characters."""
    if not isinstance(name, str) or not IDENTIFIER.fullmatch(name) or C_KEYWORD.fullmatch(name):
        raise InvalidInputError(
            f"name must be a C identifier (letters, digits and _, at most 31, not a word of the language), got {name!r}"
        )
    return name


def c_array(symbol: str, array: Array, kind: str = "double") -> str:
    """A constant array in row-major order, and an empty line."""
    shape = "".join(f"[{size}]" for size in array.shape)
    return f"static const {kind} {symbol}{shape} = {_initialiser(array)};\n"


def _initialiser(array: Array) -> str:
    if array.ndim == 0:
        return repr(float(array)) if array.dtype == float else str(int(array))
    return "{" + ", ".join(_initialiser(part) for part in array) + "}"


def comment_text(comment: str) -> str:
    """Text that cannot end the comment that it stands in, on one line."""
    return " ".join(comment.split()).replace("*/", "* /").replace("/*", "/ *")
