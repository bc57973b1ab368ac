"""A periodic observer as a MATLAB function with a memory; it runs in GNU Octave, too."""

from __future__ import annotations

import re
from collections.abc import Sequence
from string import Template

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.export import IDENTIFIER
from replication.estimation.api.phase import Recursion
from replication.estimation.validation import Array

RESERVED = re.compile(
    "break|case|catch|classdef|continue|else|elseif|end|for|function|global|if|otherwise|parfor|persistent|return|spmd|"
    "switch|try|while"
)
SOURCE = Template(
    """\
function [estimate, missed] = $name(u, y)
% $upper  $comment
%   $name('reset') or $name('reset', start) begins again at instant 0; start has $starts entries.
%   estimate = $name(u, y) goes on by one instant: u has $inputs known inputs ([] if none), y has
%   $measurements measurements, NaN where one did not come. missed counts those.
persistent state instant lost_so_far
transition = $transition;
injection = $injection;
readout = $readout;
$known$tables
if isempty(instant) || ischar(u)
    state = zeros($order, 1);
    instant = 0;
    lost_so_far = 0;
end
if ischar(u)
    if nargin > 1
        state(1:$starts) = y(:);
    end
    estimate = readout{1} * state;
    missed = 0;
    return
end
u = u(:);
y = y(:);
if numel(u) ~= $inputs || numel(y) ~= $measurements || any(isnan(u)) || any(isinf(u)) || any(isinf(y))
    error('$name: u must be $inputs finite numbers, y $measurements that are finite or NaN');
end
k = mod(instant, $count) + 1;
$measured
state = transition{k} * state + injection{k} * y$driven;
instant = instant + 1;
k = mod(instant, $count) + 1;
estimate = readout{k} * state;
missed = lost_so_far;
end
"""
)
COMPLETED = """\
guess = expected{k} * state$through;
lost_so_far = lost_so_far + sum(isnan(y) & due{k});
left_out = isnan(y) | ~due{k};
y(left_out) = guess(left_out);"""
"""A measurement that should be there and is not is replaced by the one that is expected."""
WAITING = """\
if any(isnan(y)) && ~all(isnan(y))
    error('$name: a sample must be complete, or NaN as a whole');
end
lost_so_far = lost_so_far + sum(isnan(y));
if all(isnan(y))
    instant = instant + 1;
    estimate = readout{k} * state;
    missed = lost_so_far;
    return
end"""
"""A sample that does not come only makes the interval longer; one that is not complete is refused."""


def matlab_source(name: str, comment: str, recursion: Recursion) -> str:
    """The recursion as a function.

    Parameters
    ----------
    name : str
        Of the function, and of its file.
    comment : str
        What it is, for its help.
    recursion : Recursion
        What it does.

    Raises
    ------
    InvalidInputError
        `name` is no name of a function, or the observer has a gate.
    """
    if not isinstance(name, str) or not IDENTIFIER.fullmatch(name) or RESERVED.fullmatch(name):
        raise InvalidInputError(
            f"name must be one of a MATLAB function (letters, digits and _, at most 31, no reserved word), got {name!r}"
        )
    if recursion.limits is not None:
        raise InvalidInputError("an observer with a gate has no form in MATLAB; leave the gate out, or take its C form")
    phases, expected, through = recursion.phases, recursion.expected, recursion.through
    inputs, tables = phases[0].input.shape[1], ""
    if expected is not None:
        due = [phase.due[:, None] for phase in phases]
        if through is not None:
            tables = f"direct = {_cells([through])};\n"
        tables += f"expected = {_cells(expected)};\ndue = {_cells(due)};\n"
    return SOURCE.substitute(
        name=name,
        upper=name.upper(),
        comment=" ".join(comment.split()),
        starts=recursion.starts,
        inputs=inputs,
        measurements=phases[0].injection.shape[1],
        order=len(phases[0].transition),
        count=len(phases),
        transition=_cells([phase.transition for phase in phases]),
        injection=_cells([phase.injection for phase in phases]),
        readout=_cells([phase.readout for phase in phases]),
        known=f"drive = {_cells([phase.input for phase in phases])};\n" if inputs else "",
        tables=tables,
        driven=" + drive{k} * u" if inputs else "",
        measured=Template(WAITING if expected is None else COMPLETED).substitute(
            name=name, through="" if through is None else " + direct{1} * u"
        ),
    )


def _cells(matrices: Sequence[Array]) -> str:
    """A cell array with a matrix for each phase, a line for each."""
    return "{ ...\n" + ", ...\n".join(f"    {_matrix(matrix)}" for matrix in matrices) + "}"


def _matrix(matrix: Array) -> str:
    written = str.lower if matrix.dtype == np.bool_ else str  # str of a float is as exact as its repr
    return f"[{'; '.join(' '.join(written(str(entry)) for entry in row) for row in matrix.tolist())}]"
