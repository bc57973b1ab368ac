"""What Peet and Gu (SOS for Systems with Multiple Delays, Part 2) print, as strings: the digits are the tolerance.

Places refer to the paper. The examples are academic: no physical plant stands behind the matrices.
"""

from __future__ import annotations

from typing import Any

KEY = "peet2019"

# Section X, Examples 1-3: A_0, [A_1 ..], delays, B, C_10, C_2, as JSON values.
EXAMPLES: dict[str, dict[str, Any]] = {
    "1": {
        "a0": [[-3.0, 4.0], [2.0, 0.0]],
        "a": [[[0.0, 0.0], [1.0, 0.0]]],
        "delays": [0.3],
        "b": [[1.0, 0.0], [0.0, 1.0]],
        "c10": [[1.0, 0.0], [0.0, 1.0]],
        "c2": [[0.0, 7.0]],
    },
    "2": {
        "a0": [[0.0, 0.0], [0.0, 1.0]],
        "a": [[[-1.0, -1.0], [0.0, -0.9]]],
        "delays": [1.0],
        "b": [[1.0, 0.0], [0.0, 1.0]],
        "c10": [[1.0, 0.0]],
        "c2": [[0.0, 1.0]],
    },
    "3": {
        "a0": [[0.0, 0.0], [0.0, 1.0]],
        "a": [[[-0.5, -0.5], [0.0, -0.45]], [[-0.5, -0.5], [0.0, -0.45]]],  # the printed matrix over 2, twice
        "delays": [0.5, 1.0],
        "b": [[1.0, 0.0], [0.0, 1.0]],
        "c10": [[1.0, 0.0]],
        "c2": [[0.0, 1.0]],
    },
}

# The scalar systems whose gain is the optimum of Examples 2 and 3, where y does not see x_1: 1/(s + e^{-s}), ..
VISIBLE: dict[str, dict[str, Any] | None] = {
    "1": None,
    "2": {"a0": [[0.0]], "a": [[[-1.0]]], "delays": [1.0], "b": [[1.0]], "c10": [[1.0]], "c2": [[1.0]]},
    "3": {"a0": [[0.0]], "a": [[[-0.5]], [[-0.5]]], "delays": [0.5, 1.0], "b": [[1.0]], "c10": [[1.0]], "c2": [[1.0]]},
}

# Systems of ours (not of the paper) in which the observer matters: y sees every state. Last entry: the delayed z.
OWN_SYSTEMS: dict[str, dict[str, Any]] = {
    "own-1": {
        "a0": [[-1.0, 2.0], [0.5, -0.5]],
        "a": [[[-0.5, 0.3], [0.4, -1.0]]],
        "delays": [0.8],
        "b": [[1.0, 0.0], [0.0, 1.0]],
        "c10": [[1.0, 0.0]],
        "c2": [[1.0, 1.0]],
        "c1": [[[0.3, 0.0]]],
    },
    "own-2": {
        "a0": [[0.2, 1.0], [-1.0, -0.5]],
        "a": [[[0.3, 0.0], [0.2, -0.4]], [[-0.6, 0.2], [0.1, -0.3]]],
        "delays": [0.4, 1.1],
        "b": [[1.0, 0.0], [0.0, 1.0]],
        "c10": [[1.0, 0.0], [0.0, 0.5]],
        "c2": [[0.3, 1.0]],
    },
    "own-3": {
        "a0": [[0.0, 1.0], [-1.0, 0.1]],
        "a": [[[0.0, 0.0], [0.2, -0.4]], [[-0.3, 0.2], [0.1, -0.3]], [[0.2, 0.0], [0.1, -0.1]]],
        "delays": [0.3, 0.7, 1.0],
        "b": [[1.0, 0.0], [0.0, 1.0]],
        "c10": [[1.0, 0.0]],
        "c2": [[0.0, 1.0]],
    },
}

# The tables below Examples 1-3: least gain by degree and by Padé, and CPU seconds.
GAMMA = {
    "1": {"1": ".2357", "2": ".2357", "3": ".2357", "pade": ".2357"},
    "2": {"1": "2.3323", "2": "2.3270", "3": "2.3270", "pade": "2.3270"},
    "3": {"1": "1.3511", "2": "1.3501", "3": "1.3501", "pade": "1.3501"},
}
SECONDS = {
    "1": {"1": ".433", "2": ".918", "3": "2.29", "pade": "2.92"},
    "2": {"1": ".968", "2": ".668", "3": "1.99", "pade": "2.98"},
    "3": {"1": "4.77", "2": "7.57", "3": "33.59", "pade": "5.45"},
}
PADE_ORDER = 10

# The text of Examples 1 and 2, and the caption of Fig. 1.
TEXT_GAIN_1 = ".2357"
TEXT_GAIN_2 = "2.327"
CITED_1 = ".580"
CITED_2 = "22.8"
FIGURE_LEVEL = "2.33"
SINC_GAIN = "1.186"
SMALL_GAIN = "<.001"
LUMPED_STATES = "20"
LARGEST_PRODUCT = "50"

# Table I: CPU seconds by number of states n and of delays K; the entry for n = K = 10 is N/A.
STATES = (1, 2, 3, 5, 10)
DELAY_COUNTS = (1, 2, 3, 5, 10)
TABLE_1 = {
    1: (".516", ".218", ".375", "2.203", "24.094"),
    2: (".219", ".547", "2.141", "19.282", "875.137"),
    3: (".3910", "1.782", "9.484", "113.236", "4742.7"),
    5: ("1.375", "12.454", "109.939", "1859.9", "62069"),
    10: ("18.406", "582.945", "4717.2", "66033", "N/A"),
}


def seconds(states: int, delays: int) -> str:
    """The printed entry of Table I."""
    return TABLE_1[delays][STATES.index(states)]
