"""What the manuscript prints, from the file beside: motor, gains, rates, references and Table I."""

from __future__ import annotations

from pathlib import Path

from replication.audit.data import PrintedValue, read_printed

DATA = read_printed(Path(__file__).with_suffix(".toml"))

PARAMETERS = ("resistance", "flux", "inductance", "friction", "inertia", "torque_constant")
"""Parameters of the motor that are printed with a tolerance; the number of pole pairs has none."""
REFERENCES = tuple(DATA["table-1"])


def table_1(controller: str) -> tuple[PrintedValue, ...]:
    """The column of Table I of SRC, DRC-PMI or DRC-APO."""
    return tuple(row[controller] for row in DATA["table-1"].values())


def frequency(reference: str) -> float:
    """σ of a reference as Table I writes it, such as sin(3t/2), rad/s."""
    times, _, over = reference.removeprefix("sin(").removesuffix(")").partition("/")
    return float(times.removesuffix("t") or 1) / float(over or 1)
