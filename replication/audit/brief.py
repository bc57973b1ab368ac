"""What a reader is told of a paper first: its topic, a sketch, and four sentences that link the claims they rest on."""

from __future__ import annotations

from enum import StrEnum

import msgspec


class Consequence(StrEnum):
    """What falls with a claim; the report ranks by it, in this order."""

    THEOREM = "theorem"
    HEADLINE = "headline"
    TABLE = "table entry"
    DIGIT = "digit"
    REMARK = "remark"


class Draws(StrEnum):
    """What the points of a stroke are: a line, an area, dots, ticks that hang from them, or the place of a text."""

    TRUTH = "truth"
    ESTIMATE = "estimate"
    BAND = "band"
    MEASURED = "measured"
    VIRTUAL = "virtual"
    TICK = "tick"
    TICK_OURS = "tick-ours"
    LABEL = "label"
    LABEL_OURS = "label-ours"


class Stroke(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One part of a sketch, in a frame of 320 by 150; text: that of a label, which ends at the right of the frame
    where it would not fit.
    """

    draws: Draws
    points: tuple[tuple[float, float], ...]
    text: str = ""


class Sketch(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A small picture that explains the topic; alt: the same in words."""

    alt: str
    strokes: tuple[Stroke, ...]


class Brief(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Topic, sketch, and sentences of at most 25 words and two numbers each.

    In a sentence `[words](name)` links a claim or an erratum by its short name, and says of it what the sentence is
    for: that it holds, that it does not as printed, or that it stays a guess. In `card`, which may say all three, the
    name begins with `+`, `-` or `?`. The report is not built if that is no longer so.
    """

    topic: str
    card: str
    holds: str
    correct: str
    guess: str
    sketch: Sketch
