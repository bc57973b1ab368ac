"""The errors of this package: one root, and each message says what was wrong, with which value, and what to do."""


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
