"""Pictures to move and ladders: what is drawn is what the tables and brackets hold."""

import math
import re
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from msgspec.structs import replace
from sample import KEY, brief, explorer
from tables import number, read_csv

from replication.audit.brief import Curve
from replication.audit.model import Policy, Verdict
from replication.audit.report import explore
from replication.audit.report.claim import targets, views
from replication.audit.report.evidence import Ladder, ladders
from replication.audit.report.explore import PictureView, explorers, scale_of, ticks
from replication.audit.store.records import ClaimRecord, ResultsFile
from replication.errors import AuditError

FIGURE = f"{KEY}-fig2"


def shown(made: ResultsFile, figures: Path, **more: Any) -> tuple[PictureView, ...]:
    with_it = replace(brief(), explorers=(explorer(**more),))
    paper = replace(made.papers[0], brief=with_it)
    ((_, pictures),) = explorers(paper, [FIGURE], figures, views(made.claims, targets(made.claims)))
    return pictures


def column(figures: Path, name: str) -> tuple[float, ...]:
    return read_csv(figures / f"{FIGURE}.csv")[name]


def test_values_are_those_of_the_table_at_each_place_of_the_slider(made: ResultsFile, figures: Path) -> None:
    moved, _ = shown(made, figures)
    first, second = column(figures, "error 1"), column(figures, "error 2")
    line, norm, band = moved.curves
    at = moved.begin
    assert moved.x == column(figures, "k")[at] == 20
    assert number(norm.values.split("|")[at]) == pytest.approx(math.hypot(first[at], second[at]), rel=1e-3)
    for place, text in enumerate(line.values.split("|")):
        assert number(text) == pytest.approx(first[place], rel=1e-3)
    for place, text in enumerate(band.values.split("|")):
        low, high = map(number, text.split(" to "))
        assert low <= first[place] and second[place] <= high, "a band is rounded outwards"
        assert (low, high) == (pytest.approx(first[place], rel=2e-3), pytest.approx(second[place], rel=2e-3))
    assert moved.steps + 1 == len(moved.places.split()) == len(line.values.split("|")) == len(line.heights.split())


def test_curves_keep_their_order_and_stay_in_the_frame(made: ResultsFile, figures: Path) -> None:
    line = shown(made, figures)[0].curves[0]
    points = [tuple(map(float, point)) for point in re.findall(r"(-?[0-9]+) (-?[0-9]+)", line.path)]
    assert len(points) == 61 and all(0 <= part <= 1000 for point in points for part in point)
    drawn = [y for _, y in points]
    data = column(figures, "error 1")
    assert drawn.index(min(drawn)) == data.index(max(data[:61])), "what is larger stands higher"


def test_the_picture_of_a_figure_that_failed_is_left_out(made: ResultsFile, figures: Path) -> None:
    assert [view.picture.label for view in shown(made, figures)] == ["Sensors that are slow, moved", "still"]
    paper = made.papers[0]
    assert explorers(paper, [], figures, views(made.claims, targets(made.claims))) == ()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"across": "time"}, "'time'.*columns k, error 1, error 2"),
        ({"claim": "nowhere"}, "'nowhere', which is no claim"),
        ({"log_y": True}, "nothing to draw"),
        ({"last": -1.0}, "nothing to draw"),
        ({"words": "word " * 16}, "a title has at most 15 words, this one 16"),
    ],
)
def test_what_cannot_be_drawn_is_named(made: ResultsFile, figures: Path, more: Any, message: str) -> None:
    with pytest.raises(AuditError, match=message):
        shown(made, figures, **more)


@pytest.mark.parametrize(("least", "drawn"), [(0.5, True), (0.0, False)])
def test_zero_has_no_place_on_a_logarithmic_axis(made: ResultsFile, figures: Path, least: float, drawn: bool) -> None:
    one = {"curves": (Curve(label="one", columns=("error 1",)),), "log_y": True, "limit": (1.0, "one")}
    with patch.object(explore, "_numbers", lambda *_: [[least] + [1.0] * 60]):
        if drawn:
            assert shown(made, figures, **one)
        else:
            with pytest.raises(AuditError, match="nothing to draw"):
                shown(made, figures, **one)


def test_the_ends_of_a_range_have_ticks_where_they_are_round() -> None:
    assert [at for at, _ in ticks((0.0, 10.0), False, lambda number: number)] == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
    assert [at for at, _ in ticks((0.01, 100.0), True, lambda number: number)] == [0.01, 0.1, 1.0, 10.0, 100.0]
    scale = scale_of((1.0, 100.0), True, 0.0)
    assert scale(10.0) == pytest.approx((scale(1.0) + scale(100.0)) / 2)


def rungs(made: ResultsFile) -> dict[str, Ladder]:
    found = ladders(made.papers[0], views(made.claims, targets(made.claims)))
    return {ladder.view.record.claim.id.removeprefix(f"{KEY}."): ladder for ladder in found}


def test_the_ladder_tells_the_distance_to_the_nearer_end(made: ResultsFile) -> None:
    found = rungs(made)
    assert found
    for ladder in found.values():
        low, high = (Fraction(end) for end in (ladder.view.record.evidence.lower, ladder.view.record.evidence.upper))  # type: ignore[arg-type]
        interval = ladder.entry.interval
        assert interval is not None
        assert ladder.inside is (interval[0] <= low and high <= interval[1])
        ends = [abs(end - mine) for end in interval for mine in (low, high)]
        assert Fraction(ladder.near) * (interval[1] - interval[0]) == pytest.approx(min(ends))
        assert ladder.bracket[0] <= low and high <= ladder.bracket[1]
        assert ladder.bracket[1] - ladder.bracket[0] < 4 * (high - low)
        first, second, third = (rung.factor for rung in ladder.rungs)
        assert first == 1 and second >= 1 and third >= 1


def inside(made: ResultsFile) -> tuple[str, Ladder, tuple[float, float]]:
    """The name of a claim that is proved to agree, its ladder, and the ends of what its print stands for."""
    name, ladder = next((name, ladder) for name, ladder in rungs(made).items() if ladder.inside)
    assert ladder.entry.interval is not None
    return name, ladder, (float(ladder.entry.interval[0]), float(ladder.entry.interval[1]))


def moved_to(made: ResultsFile, ladder: Ladder, value: float, width: float, *more: ClaimRecord, **judged: Any) -> Any:
    """The ladders where the claim of this one has another bracket and judgement, with more claims beside it."""
    record = ladder.view.record
    evidence = replace(record.evidence, value=value, lower=value - width, upper=value + width)
    moved = replace(record, evidence=evidence, judgement=replace(record.judgement, **judged))
    others = (moved if other.id == record.id else other for other in made.claims)
    return rungs(replace(made, claims=(*others, *more)))


def test_only_what_is_proved_and_beside_its_interval_has_a_ladder(made: ResultsFile) -> None:
    name, ladder, (edge, end) = inside(made)
    assert name in moved_to(made, ladder, edge + 2e-4, 1e-4)
    for verdict, drawn in ((Verdict.DIFFERS, True), (Verdict.COMPATIBLE, False)):  # outside, for what differs
        assert (name in moved_to(made, ladder, 2 * end - edge, 1e-9, verdict=verdict)) is drawn
    assert name not in moved_to(made, ladder, edge, 1e-4), "neither inside nor outside"
    unproved = [replace(r, judgement=replace(r.judgement, proved=False)) for r in made.claims]
    assert rungs(replace(made, claims=tuple(unproved))) == {}


def test_a_ladder_above_the_least_level_names_the_claim_that_finds_the_print(made: ResultsFile) -> None:
    name, ladder, (edge, _) = inside(made)
    record = ladder.view.record
    attained = replace(record, claim=replace(record.claim, id=f"{record.id}-attained"))
    elsewhere = replace(record, claim=replace(record.claim, id=f"{record.id}-elsewhere", place="another place"))
    least = {"verdict": Verdict.COMPATIBLE, "policies": (Policy.SOLVER,)}
    moved = moved_to(made, ladder, edge - 1e-4, 1e-9, attained, elsewhere, **least)[name]
    assert ladder.beside == () and [view.record.id for view in moved.beside] == [attained.id]
