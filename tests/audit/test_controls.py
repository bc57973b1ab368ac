"""The controls of the report: alterations are tried wherever they fit, and one that goes unnoticed is told."""

from pathlib import Path

import pytest
from cases import altered
from msgspec.structs import replace
from sample import claim
from sample import results as sample

from replication.audit.inspect import controls as module
from replication.audit.inspect.controls import Control, moved
from replication.audit.judge.printed import parse
from replication.audit.judge.verdict import AGREES, rejudge
from replication.audit.model import Evidence, Judgement, Kind, Proof, Verdict
from replication.audit.report.claim import targets
from replication.audit.report.sections.lineage import lineages
from replication.audit.store.records import ResultsFile


def controls(results: ResultsFile) -> tuple[Control, ...]:
    return module.controls(results, targets(results.claims))


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> ResultsFile:
    return sample(tmp_path_factory.mktemp("figures"))


@pytest.mark.parametrize(
    ("printed", "expected"),
    [
        ("1.33", ["1.34", "1.32"]),
        (".2357", ["0.2358", "0.2356"]),
        ("−0.0000", ["-0.0001"]),
        ("[0.5 -1; 0 2]", ["[0.6 -1; 0 2]", "[0.4 -1; 0 2]", "[0.5 -2; 0 2]", "[0.5 -0; 0 2]", "[0.5 -1; 1 2]",
                           "[0.5 -1; 0 3]", "[0.5 -1; 0 1]"]),
        ("66,033", ["66034", "66032"]),
        ("1.2×10^-3", ["0.0013", "0.0011"]),
        ("1.2–1.4", ["(1.3, 1.4)", "(1.1, 1.4)", "(1.2, 1.5)", "(1.2, 1.3)"]),
        ("(1, 2±0.5i)", ["(2, 2±0.5i)", "(0, 2±0.5i)", "(1, 3±0.5i)", "(1, 1±0.5i)", "(1, 2±0.6i)", "(1, 2±0.4i)"]),
    ],
)  # fmt: skip
def test_each_number_is_moved_by_its_last_place(printed: str, expected: list[str]) -> None:
    assert list(moved(parse(printed))) == expected


def test_every_alteration_is_caught_where_nothing_wider_is_allowed(results: ResultsFile) -> None:
    strict = replace(results, claims=tuple(claim for claim in results.claims if claim.claim.tolerance is None))
    made = controls(strict)
    assert len(made) >= 4
    assert all(control.tried and control.caught == control.tried and not control.missed for control in made)


def test_of_a_misprinted_result_what_is_meant_is_moved(results: ResultsFile) -> None:
    more = {"erratum": results.errata[0].id, "meant": "269", "proof": Proof(holds=True, text="t")}
    evidence = Evidence(method="ln 2 / k", value=268.6617)
    made = claim("half", Kind.VALUE, Verdict.REPRODUCED_AFTER_ERRATUM, "296", evidence, **more)
    found = {control.altered: control for control in controls(replace(results, claims=(made,), certificates=()))}
    control = found["a printed number moved by a unit of its last place"]
    assert (control.tried, control.caught, control.missed) == (2, 2, ())


def test_a_judge_that_always_agrees_is_found_out(results: ResultsFile, monkeypatch: pytest.MonkeyPatch) -> None:
    blind = Judgement(verdict=Verdict.REPRODUCED, reason="always")
    monkeypatch.setattr(module, "rejudge", lambda record, errata, target, readings: blind)
    by_name: dict[str, Control] = {control.expected: control for control in controls(results)}
    assert by_name["no agreement"].caught == 0
    assert by_name["no agreement"].missed
    assert by_name["agreement"].caught == by_name["agreement"].tried


def test_a_tolerance_wider_than_a_unit_is_listed(results: ResultsFile) -> None:
    claim = next(c for c in results.claims if c.verdict is Verdict.REPRODUCED and c.judgement.deviation_ulp is not None)
    wide = altered(claim, tolerance="1000", tolerance_reason="for the test")
    (prints, *_) = controls(replace(results, claims=(wide,)))
    assert prints.missed == (wide,)
    assert prints.caught == 0


def test_lineage_joins_each_claim_to_its_experiments(results: ResultsFile) -> None:
    for drawing in lineages(results):
        claims = [claim for claim in results.claims if claim.paper == drawing.paper]
        known = {record.name for record in results.experiments if record.paper == drawing.paper}
        assert len(drawing.claims) == len(claims)
        assert len(drawing.lines) == sum(name in known for claim in claims for name in claim.claim.uses)
        assert len({node.y for node in drawing.claims}) == len(claims)
        assert f"{len(claims)} claims" in drawing.alt


def test_sections_are_left_out_without_claims(results: ResultsFile, tmp_path: Path) -> None:
    empty = replace(results, claims=())
    assert controls(empty) == ()
    assert lineages(empty) == ()


def test_what_is_denied_is_judged_as_a_statement_that_does_not_hold(results: ResultsFile) -> None:
    """And not refused as evidence that contradicts itself, which would count as noticed too."""
    errata, tried = {erratum.id: erratum for erratum in results.errata}, 0
    for made in results.claims:
        for name, record, known in module._alterations(made, errata, None):
            if name == "a statement that holds turned into one that does not":
                verdict = rejudge(record, known, readings=results.readings.get(made.paper, ())).verdict
                tried += 1
                assert verdict not in (Verdict.ERROR, *AGREES)
    assert tried >= 2
