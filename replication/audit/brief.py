"""What leads the report on a paper: its result in a headline and a picture, sentences that link their claims, pictures
to move."""

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


class Curve(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One curve of a figure's table: a column, or the Euclidean norm of several.

    upper: a column above it; the curve is then the band between, of which only the two ends are known. quiet: whether
    it stands for comparison only.
    """

    label: str
    columns: tuple[str, ...]
    upper: str = ""
    quiet: bool = False


class Ticks(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """When a sensor measures: at `offset` and each `period` further, on the abscissa of the curves."""

    label: str
    period: int
    offset: int = 0


class Picture(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Curves from the table of one figure, over a column of it.

    label: its name among others. figure: its name in full. across: column of the abscissa. x, y: what the axes are,
    with unit. begin: where on the abscissa the slider begins; without it there is none. last: end of what is shown.
    limit: a height to mark, with its name. claim: the short name of the claim that this picture stands for.
    """

    label: str
    figure: str
    across: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    log_x: bool = False
    log_y: bool = False
    begin: float | None = None
    last: float | None = None
    limit: tuple[float, str] | None = None
    claim: str = ""
    sensors: tuple[Ticks, ...] = ()


class Explorer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Pictures to choose from, one at a time.

    title: the message. text: what is drawn. moves: what to try on a screen.
    """

    title: str
    text: str
    pictures: tuple[Picture, ...]
    moves: str = ""


class Traces(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """Curves from the table of one figure, each with its name and last value at its end.

    figure: its name in full. across: column of the abscissa. x, y: what the axes are, with unit. A quiet curve stands
    for comparison. text: what is drawn. last: end of what is shown.
    """

    figure: str
    across: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    text: str = ""
    last: float | None = None


class Pair(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A printed number and a bound that stands against it, by the short names of their claims."""

    label: str
    printed: str
    bound: str


class Bars(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """Bars of printed numbers beside those of lower bounds; printed, bound: what each is, in short; text: more."""

    pairs: tuple[Pair, ...]
    printed: str
    bound: str
    text: str = ""


class Entries(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """Entries of tables of the paper: of each row the print as a box and ours as a line in it.

    columns: headings. rows: a heading, and the short names of the claims in it. text: what the entries are.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[str, ...]], ...]
    text: str = ""


class Brief(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Topic, sketch, and sentences of at most 25 words and two numbers each. The opening of the report has of each
    paper `verdict` in two words, `headline`, the result, `card`, which explains it, and `picture`, which shows it.

    In a sentence `[words](name)` links a claim or an erratum by its short name, and says of it what the sentence is
    for: that it holds, that it does not as printed, or that it stays a guess. In `card`, which may say all three, the
    name begins with `+`, `-` or `?`. The report is not built if that is no longer so. `{name}` becomes the number
    that was computed for that claim, `{name:lower}` its lower bound rounded down, `{name:over:other}` that bound over
    the number printed for `other`, and `{name:not}` what the print should say, "not", and what it says. In `headline`
    and `verdict` a sign may be left out: the link then says nothing. explorers: pictures that a reader can move.
    terms: words of the paper with their meaning, to which their first mention on a page leads.
    """

    topic: str
    card: str
    holds: str
    correct: str
    guess: str
    sketch: Sketch
    explorers: tuple[Explorer, ...] = ()
    terms: dict[str, str] = {}
    verdict: str = ""
    headline: str = ""
    picture: Traces | Bars | Entries | None = None
