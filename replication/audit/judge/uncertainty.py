"""What an uncertainty that a text prints says of a recomputed number: in standard deviations, not as a wall.

docs/verdicts.md has the rules, of which `weighed` is the code.
"""

import re
from fractions import Fraction
from statistics import NormalDist

from replication.audit.judge.numerals import short
from replication.audit.judge.printed import Entry
from replication.audit.model import Judgement, Verdict
from replication.errors import AuditError

SMALLEST_PROBABILITY = 0.01
"""A printed draw is compatible if a draw at least as extreme is at least this probable."""
BOUND, PROBABLE = "bound", "probable"
BY_DIGITS = {
    "sd": "What is printed beside it is a standard deviation of the data, and no uncertainty of it.",
    "none": "It was computed from the same data, and so has no uncertainty.",
}
_NORMAL = NormalDist()
_FORM = re.compile(r"([0-9]+(?:\.[0-9]+)?)\s*(sigma|σ|SD|SE|%)")
KINDS = ("1 sigma", "2 sigma", "68 %", "90 %", "95 %", "99 %", PROBABLE, BOUND, *BY_DIGITS)
"""Examples of what a claim may say; any number of sigma or per cent will do."""


def sigmas(uncertainty: str) -> Fraction | None:
    """How many standard deviations an uncertainty is; None for a bound. Raises AuditError for what it cannot be."""
    match = _FORM.fullmatch("50 %" if uncertainty == PROBABLE else uncertainty)
    number = Fraction(match[1]) if match else Fraction(0)
    if uncertainty == BOUND:
        return None
    if match is None or not 0 < number < (100 if match[2] == "%" else 1000):
        known = ", ".join(f'"{kind}"' for kind in KINDS)
        raise AuditError(
            f"uncertainty is {uncertainty!r}; write one of {known}, or another number of sigma or per cent"
        )
    return _rounded(_NORMAL.inv_cdf(0.5 + float(number) / 200)) if match[2] == "%" else number


def _rounded(number: float) -> Fraction:
    """Six decimals, which are the same on every machine."""
    return Fraction(f"{number:.6f}")


LIMIT = _rounded(_NORMAL.inv_cdf(1 - SMALLEST_PROBABILITY / 2))
"""Standard deviations beyond which a number is too improbable."""


def reach(entry: Entry, uncertainty: str) -> tuple[Fraction, Fraction]:
    """How far from the print, down and up, a number agrees with it."""
    assert entry.spread is not None
    times = sigmas(uncertainty) if uncertainty else None
    below, above = entry.spread
    return (below, above) if times is None else (below * LIMIT / times, above * LIMIT / times)


def weighed(entry: Entry, value: Fraction, uncertainty: str, judgement: Judgement, beyond: Judgement) -> Judgement:
    """The judgement on a number that does not come out in its digits, by the uncertainty beside them.

    judgement: for the interval of `reach`; beyond: for that of a probable error, the widest that is usual.
    """
    verdict, inside = judgement.verdict, judgement.verdict is Verdict.REPRODUCED
    assert entry.spread is not None
    if uncertainty == BOUND:
        words = "The text gives its uncertainty as a bound."
    elif uncertainty:
        verdict = Verdict.COMPATIBLE if inside else verdict
        times, off = sigmas(uncertainty) or Fraction(1), value - entry.value
        z = short(float(abs(off) * times / entry.spread[off > 0]), 3)
        of_print = "" if times == 1 else f", of which the printed {uncertainty} is {short(float(times), 3)}"
        words = f"It is off by z = {z} standard deviations{of_print}; {short(float(LIMIT), 3)} are allowed."
    elif beyond.verdict is Verdict.DIFFERS:
        words = "What its uncertainty is goes unsaid; it differs even by a probable error, the widest that is usual."
    else:
        verdict = Verdict.COMPATIBLE if inside else Verdict.UNDETERMINED
        words = "What its uncertainty is goes unsaid; it agrees with each that is usual."
        words += ' If the text prints a standard deviation of the data, say uncertainty="sd".'
        if not inside:
            words = f'By a probable error it would agree, by a bound not; say uncertainty="{KINDS[0]}", or what it is.'
    return judgement.further(words, verdict=verdict)
