"""The errors of this package: one root, and each message says what was wrong, with which value, and what to do."""

import difflib
from collections.abc import Collection, Sequence


class ReplicationError(Exception):
    """Root of every error that this package raises on purpose."""


class InvalidInputError(ReplicationError, ValueError):
    """An argument does not describe a problem that can be solved; found before any solver is called."""


class InfeasibleError(ReplicationError):
    """The problem is well posed and has no solution at the requested level, or no finite one."""


class SolverError(ReplicationError):
    """A numerical solver did not reach the requested accuracy; carries its status in the message."""


class AuditError(ReplicationError):
    """A claim, a printed value, a result file or a request to the audit is not usable."""


LONGEST = 80
"""Characters that a message repeats of what was typed."""


SHOWN = 3
"""Names that a list of them shows; it counts the others."""


def listed(names: Sequence[str]) -> str:
    """The first names, and how many more there are."""
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return f"{', '.join(names[:SHOWN])}{more}"


def one_of(kind: str, name: str, known: Collection[str]) -> str:
    """Return `name` if it is known; raises AuditError that lists up to three similar names, or all if none is."""
    if name in known:
        return name
    raise AuditError(f"unknown {kind} {name[:LONGEST]!r}; {meant(name, known)}")


def meant(name: str, known: Collection[str]) -> str:
    """Up to three known names that are similar to one that is not, as a question; else all, up to ten of them."""
    shown = name[:LONGEST]
    near = difflib.get_close_matches(shown, known, n=3, cutoff=0.5) or [k for k in known if shown and shown in k][:3]
    if near:
        return f"did you mean {' or '.join(near)}?"
    return f"there {'are' if len(known) != 1 else 'is'}: {', '.join(sorted(known)[:10]) or 'none'}"
