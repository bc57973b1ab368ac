"""The second verifier proves what the first one proves and refuses what it refuses; each finds faults of the other."""

import ast
import json
import subprocess
import sys
from collections.abc import Callable
from contextlib import nullcontext
from fractions import Fraction
from functools import cache
from importlib import import_module
from math import e, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import replication.verify.run as first
from replication import twice
from replication.recheck import exact, interval
from replication.recheck import run as second
from replication.recheck.identities import same
from replication.recheck.multirate import levels
from replication.recheck.reading import Proof, Unproved
from replication.verify.statement import WORDINGS

ROOT = Path(__file__).parents[2]
FILES = {f"{path.parent.name}/{path.stem}": path for path in sorted((ROOT / "certificates").rglob("*.json"))}
LONG = {
    *("mustafa/range-1-upper", "mustafa/range-2-upper", "mustafa/range-2-lower", "mustafa/same-level-1"),
    *("mustafa/duration-1-upper", "mustafa/duration-2-upper", "mustafa/robust-design-1", "mustafa/robust-design-2"),
    *("peet2019/theorem-3-identity", "peet2019/ex3-pade-upper", "peet2019/own-3-near-optimal", "peet2019/ex3-d1-lower"),
    *(name for name in FILES if name.startswith("shao/errors-")),
}
"""What takes a verifier more than a few tenths of a second."""
SAMPLED = (
    "mustafa/robust-design-2",
    "mustafa/range-1-upper",
    "shao/errors-apo-corrected-fast-instants",
    "peet2019/own-3-near-optimal",
)


@cache
def theorem(name: str) -> first.Outcome:
    return first.verify(FILES[name])


def agreed(name: str) -> bool:
    found = second.check(FILES[name])
    pair = twice.compared(theorem(name), found)
    assert pair.conflict == "", f"{name}: {pair.conflict}"
    return pair.checked


@pytest.mark.slow
def test_both_prove_the_same_of_what_is_soon_checked() -> None:
    names = [name for name in FILES if name not in LONG]
    assert len(names) > 130
    assert [name for name in names if not agreed(name)] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLED)
def test_both_prove_the_same_of_what_takes_long(name: str) -> None:
    assert agreed(name)


Certificate = dict[str, Any]


def own(name: str) -> Certificate:
    """A true certificate as one about a plant of one's own, so that only the mathematics can refuse it."""
    return {**json.loads(FILES[name].read_bytes()), "paper": None, "claims": []}


def moved(certificate: Certificate, side: str, factor: Fraction) -> None:
    certificate["bound"][side] = str(Fraction(certificate["bound"][side]) * factor)


def shifted(number: str, by: Fraction) -> str:
    return str(Fraction(number) + by)


def lower_level(one: Certificate) -> None:
    moved(one, "upper", Fraction(999, 1000))


def higher_floor(one: Certificate) -> None:
    moved(one, "lower", Fraction(1001, 1000))


def other_storage(one: Certificate) -> None:
    one["witness"]["P"][0][0][0] = shifted(one["witness"]["P"][0][0][0], Fraction(-1, 2))


def other_schedule(one: Certificate) -> None:
    one["parameters"]["offsets"][-1] += 1


def other_plant(one: Certificate) -> None:
    one["plant"]["A"][0][0] = shifted(one["plant"]["A"][0][0], Fraction(1, 3))


def other_disturbance(one: Certificate) -> None:
    one["witness"]["w"][0][0] = ["0", "0"]


def other_gain(one: Certificate) -> None:
    one["witness"]["filter"]["G"].reverse()


def other_gram(one: Certificate) -> None:
    rows = one["witness"]["dissipation"][0]
    rows[0][0] = shifted(rows[0][0], Fraction(1, 10**6))


def other_weight(one: Certificate) -> None:
    weights = one["witness"]["functional"]["S"][0]
    weights[0][0] = shifted(weights[0][0], Fraction(-1, 2))


def other_rule(one: Certificate) -> None:
    one["parameters"]["rule"] = {"inner": "outer", "outer": "inner"}[one["parameters"]["rule"]]


def no_rule(one: Certificate) -> None:
    one["parameters"]["rule"] = "tensor"


def higher_degree(one: Certificate) -> None:
    one["parameters"]["degree"] += 1


def lower_degree(one: Certificate) -> None:
    one["parameters"]["degree"] -= 1


def other_root(one: Certificate) -> None:
    one["witness"]["root"][0] = shifted(one["witness"]["root"][0], Fraction(1, 5))


def other_circle(one: Certificate) -> None:
    one["witness"]["radius"] = "1/2"


def other_section(one: Certificate) -> None:
    one["witness"]["section"]["d"] = "-1"


def other_delay(one: Certificate) -> None:
    one["plant"]["delays"][0] = "1/3"


def other_end(one: Certificate) -> None:
    one["witness"]["right"] = shifted(one["witness"]["left"], Fraction(1, 10**9))


def other_solution(one: Certificate) -> None:
    one["witness"]["lyapunov"]["low"] = "1"


ALTERED: tuple[tuple[str, Callable[[Certificate], None]], ...] = (
    *(("okajima2023/gains-38", change) for change in (lower_level, higher_floor, other_storage, other_schedule)),
    *(("okajima2023/optimum-2-3", change) for change in (lower_level, higher_floor, other_storage, other_schedule)),
    *(("okajima2023/optimum-case-a", change) for change in (lower_level, higher_floor, other_plant)),
    *(("mustafa/nominal-1-upper", change) for change in (lower_level, other_plant)),
    *(("mustafa/printed-filter-lower", change) for change in (higher_floor,)),
    *(("mustafa/duration-1-lower", change) for change in (higher_floor, other_disturbance)),
    *(
        ("mustafa/stamped-1", change)
        for change in (lower_level, higher_floor, other_disturbance, other_plant, other_gain)
    ),
    *(("mustafa/floor-1", change) for change in (higher_floor,)),
    *(("peet2019/ex1-upper", change) for change in (lower_level, other_gram, other_delay)),
    *(("peet2019/ex1-lower", change) for change in (higher_floor,)),
    *(("peet2019/ex2-d1-lower", change) for change in (higher_floor,)),
    *(
        (f"peet2019/{name}-upper", change)
        for name in ("ex1-inner", "ex1-outer")
        for change in (lower_level, other_gram, other_delay, other_rule, no_rule, higher_degree, lower_degree)
    ),
    *(
        (f"peet2019/{name}-lower", change)
        for name in ("ex2-inner", "ex2-outer", "ex3-inner")
        for change in (higher_floor, other_weight, other_delay, other_rule, no_rule, higher_degree, lower_degree)
    ),
    *(("peet2019/ex1-pade-upper", change) for change in (lower_level, other_section)),
    *(("peet2019/ex1-unstable", change) for change in (other_end,)),
    *(("shao/radius-motor-apo", change) for change in (lower_level, higher_floor, other_root, other_plant)),
    *(("shao/stable-apo", change) for change in (other_circle,)),
    *(("shao/condition-scalar", change) for change in (other_solution,)),
)


@pytest.mark.parametrize(("name", "change"), ALTERED, ids=lambda value: getattr(value, "__name__", value))
def test_both_refuse_what_was_altered(name: str, change: Callable[[Certificate], None], tmp_path: Path) -> None:
    certificate, path = own(name), tmp_path / "own.json"
    path.write_text(json.dumps(certificate), encoding="utf-8")
    # Unaltered it is proved by both: it is the change that they refuse.
    assert twice.compared(first.verify(path), second.check(path)) == twice.Pair(True, "")
    assert isinstance(second.check(path), Proof)
    change(certificate)
    path.write_text(json.dumps(certificate), encoding="utf-8")
    assert first.verify(path).theorem is None
    found = second.check(path)
    assert isinstance(found, Unproved) and not str(found).startswith("the check ended in"), found


def test_a_certificate_of_a_paper_is_about_its_plant_schedule_and_claims() -> None:
    true = json.loads(FILES["okajima2023/gains-38"].read_bytes())
    assert isinstance(second.proof(true), Proof)
    for field, other in (("plant", {**true["plant"], "W": true["plant"]["A"]}), ("claims", []), ("statement", "x.y")):
        with pytest.raises(Unproved, match=f"{field} is not that of"):
            second.proof({**true, field: other})
    with pytest.raises(Unproved, match="parameters is not that of"):
        second.proof({**true, "parameters": {**true["parameters"], "offsets": [True, 0]}})


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('"sensors"', '"periods": [], "sensors"', "twice"),
        ('"1/1000000"', "0.5", "not exact"),
        ('"1/1000000"', '"1e-6"', "no rational"),
        ('"relative"', '"width"', "parameters is not that"),
        ('"bound"', '"bound', "no JSON"),
    ],
)
def test_a_malformed_file_is_refused(old: str, new: str, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "okajima2023" / "gains-38.json"
    path.parent.mkdir()
    text = FILES["okajima2023/gains-38"].read_text(encoding="utf-8")
    if reason == "no rational":
        text = json.dumps({**own("okajima2023/gains-38")})
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    found = second.check(path)
    assert isinstance(found, Unproved) and reason in str(found)


def test_a_fault_in_the_second_is_found_by_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    certificate, path = own("okajima2023/gains-38"), tmp_path / "own.json"
    lower_level(certificate)
    certificate["parameters"]["relative"] = certificate["bound"]["lower"] = "1"
    path.write_text(json.dumps(certificate), encoding="utf-8")
    assert twice.report([path]) == 1
    assert "DIFFER" not in capsys.readouterr().out
    monkeypatch.setattr(levels, "is_positive", lambda matrix: True)
    assert twice.report([path]) == 1
    assert f"THE VERIFIERS DIFFER on {path}: the second proves what the first refuses" in capsys.readouterr().out


def test_a_fault_in_either_is_found_on_true_certificates(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = FILES["okajima2023/gains-38"]
    assert twice.report([path]) == 0
    assert capsys.readouterr().out.endswith("1 of 1 certificates proved; 1 of them by both verifiers\n")
    with monkeypatch.context() as patched:
        patched.setattr(levels, "is_schur", lambda polynomial: False)
        assert twice.report([path]) == 1
        assert "DIFFER" in (said := capsys.readouterr().out) and "the second refuses: the error system" in said
    statement = first.STATEMENTS["multirate.common-period"]
    faulty = {**first.STATEMENTS, statement.name: lambda certificate, bounds: first.Theorem(sentence="false")}
    monkeypatch.setattr(first, "STATEMENTS", faulty)
    assert twice.report([FILES["okajima2023/common-period"]]) == 1
    assert "the lower bound is None for the first, 6 for the second" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("place", "value", "stable"),
    [
        (("parameters", "C", 1, 1), "3/2", True),
        (("parameters", "C", 1, 1), "-1", False),
        (("parameters", "C", 1, 1), "0", False),
        (("plant", "error_poles", 0), "-127/1000", True),
        (("plant", "error_poles", 2), "2499/5000", True),
    ],
)
def test_poles_of_other_plants_are_said_to_be_stable_by_both_or_by_none(
    place: tuple[Any, ...], value: str, stable: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if the paper were about another plant: what it is about is compared elsewhere."""
    monkeypatch.setattr(first, "subject", lambda *_: {})
    monkeypatch.setattr(second, "wanted", lambda *_: {})
    certificate = json.loads(FILES["okajima2023/section-4c-error-poles"].read_bytes())
    holder = certificate
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = value
    theorem, proof = first.check(certificate), second.proof(certificate)
    assert theorem.holds is proof.holds is stable
    outcome = first.Outcome(path=Path("altered"), theorem=theorem)
    assert twice.compared(outcome, proof) == twice.Pair(True, "")


def test_what_has_no_second_check_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    kept = {name: check for name, check in second.CHECKS.items() if name != "multirate.common-period"}
    monkeypatch.setattr(second, "CHECKS", kept)
    assert twice.main(["--both", str(FILES["okajima2023/common-period"]), str(FILES["okajima2023/rows"])]) == 0
    said = capsys.readouterr().out
    assert "2 of 2 certificates proved; 1 of them by both verifiers\nnot rechecked: common-period\n" in said


def test_every_statement_has_a_check_and_those_of_one_paper_are_known() -> None:
    assert set(second.CHECKS) == set(first.STATEMENTS)
    borrowed = {
        (statement.source, name)
        for name, statement in first.STATEMENTS.items()
        if statement.source and not WORDINGS.search(statement.sentence) and name in second.CHECKS
    }
    assert borrowed == {(paper, name) for paper, names in second.ABOUT.items() for name in names}


def test_it_imports_the_standard_library_alone() -> None:
    for path in (ROOT / "replication" / "recheck").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or "."] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert name.startswith("replication.recheck") or name.split(".")[0] in sys.stdlib_module_names, path


def test_it_runs_where_there_is_no_flint() -> None:
    code = (
        "import sys; sys.modules['flint'] = sys.modules['numpy'] = None\n"
        "from pathlib import Path\nfrom replication.recheck.run import report\n"
        f"raise SystemExit(report([Path({str(FILES['okajima2023/gains-38'])!r})]))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "the claim holds, lower" in done.stdout
    assert done.stdout.endswith("1 of 1 certificates proved by the second verifier\n")


def test_intervals_hold_what_they_enclose() -> None:
    third = interval.Interval.of(Fraction(1, 3))
    assert third.low < third.high and (third * 3).ends()[0] <= 1 <= (third * 3).ends()[1]
    assert not third * 3 < 1 and not third * 3 > 1 and third < Fraction(1, 2)
    for found, value in (
        (interval.exponential([[Fraction(1)]])[0][0], e),
        (interval.pi(), pi),
        (interval.wave(Fraction(7, 3))[1], sin(7 / 3)),
        (interval.logarithm(interval.exponential([[Fraction(9, 4)]])[0][0]), 2.25),
    ):
        low, high = found.ends()
        assert high - low < Fraction(1, 10**80) and abs(float(low) - value) < 1e-15
    # exp(a) exp(b) = exp(a + b) for all points of an interval.
    wide = interval.Interval.between(Fraction(-1, 4), Fraction(1, 2))
    grown = interval.exponential([[wide]])[0][0]
    assert grown.low <= interval.exponential([[Fraction(-1, 4)]])[0][0].low
    assert grown.high >= interval.exponential([[Fraction(1, 2)]])[0][0].high
    with pytest.raises(Unproved, match="zero"):
        wide.inverse()


@pytest.mark.parametrize(("corner", "positive", "semidefinite"), [(5, True, True), (4, False, True), (3, False, False)])
def test_definiteness_is_exact(corner: int, positive: bool, semidefinite: bool) -> None:
    matrix = [[Fraction(1), Fraction(2)], [Fraction(2), Fraction(corner)]]
    assert exact.is_positive(matrix) is positive
    assert exact.is_semidefinite(matrix) is semidefinite
    assert exact.is_semidefinite([[Fraction(0), Fraction(1)], [Fraction(1), Fraction(1)]]) is False


def test_roots_are_told_on_both_sides_of_the_circle_and_of_the_axis() -> None:
    for root, inside in ((Fraction(99, 100), True), (Fraction(1), False), (Fraction(-101, 100), False)):
        # (z - root)(z^2 + 1/4)
        assert exact.is_schur([-root / 4, Fraction(1, 4), -root, Fraction(1)]) is inside
    for real, stable in ((Fraction(-1, 100), True), (Fraction(0), False), (Fraction(1, 100), False)):
        assert exact.is_hurwitz([[real, Fraction(1)], [Fraction(-1), real]]) is stable


def test_an_identity_that_is_none_is_told() -> None:
    assert same(lambda draw: ((x := draw.number()) * x - 1, (x - 1) * (x + 1)))
    assert not same(lambda draw: ((x := draw.number()) * x - 2, (x - 1) * (x + 1)))


KINDS = 13
CASES = 3


@pytest.mark.parametrize("kind", range(KINDS))
def test_no_attack_on_the_first_is_accepted_by_the_second(
    kind: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same generator of attacks, but for those that ask for years of work, which need not end alike."""
    monkeypatch.syspath_prepend(ROOT / "tests" / "verify")
    attacks, cases = import_module("attacks"), import_module("test_attacks")
    attack, true, root = attacks.ATTACKS[kind], cases.true(), cases.project(tmp_path)
    assert attacks.ATTACKS.index(attacks.work_bomb) == KINDS
    rng, names = np.random.default_rng(21), sorted(true)
    for _ in range(CASES):
        name = names[rng.integers(len(names))]
        content = attack(rng, true[name], true)
        about = cases.subject_of(content, name) if attack in cases.ELSEWHERE else name
        path = root / ("own.json" if b'"paper": null' in content else f"certificates/{about}.json")
        path.write_bytes(content)
        listed = cases.wanted_as(root, json.loads(content)) if attack is attacks.false_wish else nullcontext()
        with listed:
            found = second.check(path, root)
        assert isinstance(found, Unproved), found
        assert not str(found).startswith("the check ended in"), found
