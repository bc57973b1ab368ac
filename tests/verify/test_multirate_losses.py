"""Gains under losses: the verifier finds all cases by itself, proves what was made, and refuses what was altered."""

import json
from fractions import Fraction
from unittest.mock import patch

import numpy as np
import pytest
from tampered import Altered, Certificate, own, refused
from tampered import check_stated as check

from replication.certify.own import certificate
from replication.errors import InvalidInputError
from replication.estimation.multirate import MultiratePlant, design, losses
from replication.estimation.multirate.losses.automaton import automaton
from replication.estimation.multirate.problem import SensingSchedule
from replication.verify.multirate.losses import all_cases
from replication.verify.multirate.sensing import schedule
from replication.verify.theorem import Refused

LOST = "okajima2023/lost-samples-2-3"
SPRING = MultiratePlant(A=[[1, 0.2], [-0.1, 0.9]], B_d=[[0], [0.3]], C=[[1, 0], [0, 1]], D=np.diag([0.2, 0.4]))
DRIFT = MultiratePlant(A=[[1.05]], B_d=[[0.2]], C=[[1]], D=[[0.1]])
"""It is unstable, and seen by one sensor."""


def small(model: losses.InARow) -> Certificate:
    """Of a plant with one state, which is soon checked."""
    best = design(DRIFT, periods=(2,))
    return json.loads(json.dumps(certificate(losses.design(best, model), "drift")))


@pytest.mark.parametrize("row", refused("multirate_losses"), ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


@pytest.mark.parametrize(
    ("periods", "offsets", "misses", "together"),
    [
        ((1,), (0,), (2,), False),
        ((2, 3), (0, 0), (1, 2), False),
        ((2, 3), (0, 1), (2, 1), False),
        ((2, 3), (0, 0), (2,), True),
        ((1, 4), (0, 0), (0, 1), False),
        ((4, 6), (0, 1), (1,), True),
    ],
)
def test_all_cases_are_those_of_the_library(
    periods: tuple[int, ...], offsets: tuple[int, ...], misses: tuple[int, ...], together: bool
) -> None:
    plant = MultiratePlant(A=[[0.5]], B_d=[[1]], C=np.ones((len(periods), 1)), D=np.eye(len(periods)))
    best = design(plant, periods=periods, offsets=offsets)
    theirs = automaton(best.problem, losses.InARow(misses, together=together))
    sensors = range(len(periods))
    channels = [list(sensors)] if together else [[i] for i in sensors]
    ours = all_cases(schedule(periods, offsets), channels, misses)
    assert [(case.before, case.after) for case in ours] == [(edge.source, edge.target) for edge in theirs.edges]
    assert [case.arrived for case in ours] == [[i for i in sensors if edge.arrived[i]] for edge in theirs.edges]


def test_no_pattern_is_left_out() -> None:
    """Each choice of lost samples, as far as it has no more losses in a row than are allowed, is a walk."""
    planned, most = schedule([1, 2], [0, 0]), [2, 1]
    cases = all_cases(planned, [[0], [1]], most)
    rng = np.random.default_rng(7)
    refused = 0
    for _ in range(300):
        node, lost = 0, [0, 0]
        for k in range(12):
            due = planned[k % 2]
            came = [i for i in due if rng.random() < 0.5]
            lost = [0 if i in came else lost[i] + (i in due) for i in range(2)]
            found = [case for case in cases if case.before == node and case.arrived == came]
            if any(count > limit for count, limit in zip(lost, most, strict=True)):
                assert not found
                refused += 1
                break
            (case,) = found
            node = case.after
    assert 0 < refused < 300


def test_without_losses_it_is_the_gain_of_the_schedule() -> None:
    best = design(SPRING, periods=(1, 2))
    lossless = check(certificate(losses.analyse(best, losses.InARow(0))))
    gain = check(certificate(best))
    assert lossless.lower is not None and lossless.upper is not None
    assert gain.lower is not None and gain.upper is not None
    assert gain.lower <= lossless.upper and lossless.lower <= gain.upper
    assert float(lossless.upper) == pytest.approx(float(gain.upper), rel=1e-4)


def test_an_unstable_plant_under_losses() -> None:
    theorem = check(small(losses.InARow(1)))
    lower, upper = (Fraction(str(end)) for end in (theorem.lower, theorem.upper))
    assert lower < upper < lower * Fraction(101, 100)
    assert "at most [1] samples of each sensor in a row" in theorem.sentence
    assert "at most [1] packets in a row" in check(small(losses.InARow(1, together=True))).sentence


def test_the_bound_holds_along_drawn_patterns() -> None:
    """Energies of the error over those of the noise, along random patterns, stay below the proved level."""
    best = losses.design(design(DRIFT, periods=(2,)), losses.InARow(1))
    level = float(Fraction(certificate(best)["bound"]["upper"]))
    edges, L = best.automaton.edges, best.gains["L"]
    rng = np.random.default_rng(3)
    found = []
    for _ in range(50):
        node, error, output, noise = 0, np.zeros(1), 0.0, 0.0
        for _ in range(60):
            i = rng.choice(best.automaton.out[node])
            v = rng.standard_normal(2)
            output, noise = output + float(error @ error), noise + float(v @ v)
            error = (DRIFT.A - L[i] @ DRIFT.C) @ error + DRIFT.B_d @ v[:1] - L[i] @ DRIFT.D @ v[1:]
            node = edges[i].target
        found.append(np.sqrt(output / noise))
    assert 0.2 * level < max(found) < level


def test_what_no_statement_fits_says_so() -> None:
    best = design(SPRING, periods=(1, 2))
    with pytest.raises(InvalidInputError, match="no statement on mean errors"):
        certificate(losses.analyse(best, losses.Independent(0.1)))


def test_as_many_cases_as_are_allowed_and_one_more() -> None:
    one = own(LOST)
    count = len(one["witness"]["L"])
    with patch("replication.verify.multirate.losses.MOST_CASES", count):
        check(one)
    with patch("replication.verify.multirate.losses.MOST_CASES", count - 1), pytest.raises(Refused, match="more than"):
        check(one)


def test_too_many_cases_are_refused_before_any_work() -> None:
    one = own(LOST)
    one["parameters"] |= {"periods": [16, 17], "misses": [6, 6]}
    with pytest.raises(Refused, match="more than 2000 cases"):
        check(one)


def test_a_schedule_of_the_library_has_the_phases_of_the_verifier() -> None:
    assert [np.flatnonzero(row).tolist() for row in SensingSchedule((2, 3), (0, 1)).mask] == schedule([2, 3], [0, 1])
