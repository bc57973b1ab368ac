"""Claims that claims.toml states: what they answer, and which mistakes are told."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lab import emptied, make_inside
from tables import rows

from replication.audit.declare import Part
from replication.audit.model import Evidence, Kind, Verdict
from replication.audit.numbers import Numbers, numbers
from replication.audit.run.assemble import Available
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError

CLAIM = """
[[claim]]
id = "rate"
place = "Sec. 1, the {key} rate"
printed = { slow = "0.25", fast = "1.50" }
unit = "1/d"
from = "model:rates:{key}"
statement = "The {key} rate."
method = "By the model."
check = "closed:{key}:0"
"""
SIZE = """
[[claim]]
id = "size"
place = "Table 2"
printed = "PRINT"
from = "model:size"
statement = "The size."
"""
RESULTS: dict[str, Any] = {
    "model": {"rates": {"slow": 0.25, "fast": 1.5, "P": 0.25}, "size": [1.0, 2.5]},
    "closed": {"slow": [0.2501], "fast": [1.5], "P": [0.25]},
}
TABLE = {"": ["a", "b", "b"], "n": [3.0, 1.0, 2.0], "low": [1.0, 2.0, 3.0], "high": [2.0, 3.0, "NA"]}
RECORDS = [{"term": "x", "est": 1.5}, {"term": "y", "est": 2.5}]
FILES: dict[str, Any] = {
    "out-t.csv": TABLE,
    "fit.json": {"list": RECORDS, "deep": [1.0, [2.0]], "a,b": 7.0, "flag": True},
}


def stated(folder: Path, text: str) -> Numbers:
    (folder / "claims.toml").write_text(text, encoding="utf-8")
    return numbers(str(folder / "paper.py"))


def answered(folder: Path, way: str, printed: str = "1.0", results: dict[str, Any] = FILES) -> Evidence:
    text = SIZE.replace("PRINT", printed).replace('"model:size"', way if way.startswith("[") else f'"{way}"')
    return stated(folder, text).parts[0].claims[0].answer(results)


def test_each_entry_is_a_claim_of_the_part_that_its_place_begins_with(tmp_path: Path) -> None:
    rates, size = stated(tmp_path, CLAIM + SIZE.replace("PRINT", "(1.0, 2.5)")).parts
    assert (rates.title, size.title) == ("Sec. 1", "Table 2")
    assert [claim.id for claim in rates.claims] == ["rate.slow", "rate.fast"]
    slow = rates.claims[0]
    assert (slow.statement, slow.printed, slow.place) == ("The slow rate.", "0.25", "Sec. 1, the slow rate")
    assert (slow.kind, slow.expected) == (Kind.VALUE, Verdict.REPRODUCED)
    assert (slow.unit, slow.reading) == ("1/d", "none")
    evidence = slow.answer(RESULTS)
    assert evidence.value == 0.25 and "0.2501" in evidence.cross_check and evidence.method == "By the model."
    assert size.claims[0].answer(RESULTS).value == (1.0, 2.5)


def test_a_print_of_the_printed_data_brings_its_place_and_unit(tmp_path: Path) -> None:
    text = '[rate]\nplace = "Fig. 3, {key}"\nunit = "m"\nnote = "faint"\nvalue = { P = "0.25" }\n'
    (tmp_path / "printed.toml").write_text(text, encoding="utf-8")
    claim = CLAIM.replace('{ slow = "0.25", fast = "1.50" }', '"data:rate"')
    (one,) = stated(tmp_path, claim).parts[0].claims
    assert (one.id, one.statement, one.place) == ("rate.p", "The P rate.", "Fig. 3, P")
    assert (one.unit, one.remark, one.answer(RESULTS).value) == ("m", "faint", 0.25)
    with pytest.raises(AuditError, match=r"unknown name in printed.toml, at .* 'rat'; did you mean rate\?"):
        stated(tmp_path, claim.replace("data:rate", "data:rat"))


@pytest.mark.parametrize(("printed", "kind"), [("(1.0, 2.5)", Kind.MATRIX), (">1", Kind.BOUND), ("1.0", Kind.VALUE)])
def test_the_kind_follows_from_the_print(tmp_path: Path, printed: str, kind: Kind) -> None:
    assert stated(tmp_path, SIZE.replace("PRINT", printed)).parts[0].claims[0].kind is kind


def test_a_number_in_another_unit_is_multiplied_and_a_name_may_have_blanks(tmp_path: Path) -> None:
    text = CLAIM.replace('slow = "0.25"', '"Too Slow" = "250"') + 'times = "1e3"'
    results = {"model": {"rates": {"Too Slow": 0.285}}, "closed": {"Too Slow": [0.2851]}}
    claim = stated(tmp_path, text.replace('"1.50"', '"1500"')).parts[0].claims[0]
    assert (claim.id, claim.answer(results).value) == ("rate.too-slow", 285)
    assert "closed:Too Slow:0 gives 285.1" in claim.answer(results).cross_check
    told = answered(tmp_path, 'out/t.csv:a:low"\ntimes = "0.1').method
    assert told.startswith("As it stands at out/t.csv:a:low, times 0.1. Nothing here makes")


@pytest.mark.parametrize("uncertainty", ["sd", "none"])
def test_a_number_and_what_is_printed_beside_it_are_checked_together(tmp_path: Path, uncertainty: str) -> None:
    text = CLAIM.replace('printed = { slow = "0.25", fast = "1.50" }', 'printed = "1.0 ± 0.3"').replace("{key}", "all")
    claim = stated(tmp_path, f'{text}uncertainty = "{uncertainty}"').parts[0].claims[0]
    results = {"model": {"rates": {"all": [1.0, 0.3]}}, "closed": {"all": [[1.01, 0.31]]}}
    assert claim.answer(results).value == (1.0, 0.3) and claim.uncertainty == uncertainty
    with pytest.raises(AuditError, match="more than half a printed place apart"):
        claim.answer({**results, "closed": {"all": [[1.01, 0.36]]}})


@pytest.mark.parametrize(("way", "value"), rows("ways"))
def test_a_way_leads_into_tables_and_json(tmp_path: Path, way: str, value: Any) -> None:
    assert answered(tmp_path, way).value == value


@pytest.mark.parametrize(("way", "said"), rows("no ways"))
def test_a_way_that_ends_is_told_with_what_is_there(tmp_path: Path, way: str, said: str) -> None:
    with pytest.raises(AuditError, match=rf"claims.toml:2: \[\[claim\]\]: .*{said}"):
        answered(tmp_path, way)


def test_what_is_meant_pins_its_verdict_and_may_hold_for_one_entry(tmp_path: Path) -> None:
    more = 'erratum = { fast = "digits" }\nmeant = { fast = "1.60" }\nreading = { slow = "slowly" }'
    slow, fast = stated(tmp_path, CLAIM + more).parts[0].claims
    assert (slow.erratum, slow.meant, slow.reading, slow.expected) == (None, "", "slowly", Verdict.REPRODUCED)
    assert (fast.erratum, fast.meant, fast.reading) == ("digits", "1.60", "none")
    assert fast.expected is Verdict.REPRODUCED_AFTER_ERRATUM
    pinned = stated(tmp_path, CLAIM + 'pinned = { fast = "differs" }').parts[0].claims
    assert [claim.expected for claim in pinned] == [Verdict.REPRODUCED, Verdict.DIFFERS]


def test_two_methods_that_differ_in_print_are_an_error(tmp_path: Path) -> None:
    claim = stated(tmp_path, CLAIM).parts[0].claims[0]
    with pytest.raises(AuditError, match=r"model:rates:slow is 0.25 and closed:slow:0 is 0.26, more than half"):
        claim.answer({**RESULTS, "closed": {"slow": [0.26]}})
    assert claim.answer({"model": {"rates": {"slow": 0.285}}, "closed": {"slow": [0.29]}}).value == 0.285


COMMAND = '[[command]]\nname = "fit"\nline = ["sh", "fit.sh"]\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (CLAIM + "colour = 1", r"claims.toml:2: \[\[claim\]\] rate: unknown field 'colour'"),
        (CLAIM + "chekc = 'a'", "unknown field 'chekc'; did you mean check"),
        (CLAIM + "meant = 3", r"\[\[claim\]\] rate: Expected a string, or a table by entry, got `int`"),
        (CLAIM.replace('id = "rate"', ""), "missing required field `id`"),
        (CLAIM.replace("place", "# "), "rate: give place and printed, or printed = \"data:NAME\""),
        (CLAIM.replace('{ slow = "0.25", fast = "1.50" }', "1.5"), "rate: is 1.5; write a printed number as a string"),
        (CLAIM.replace('{ slow = "0.25", fast = "1.50" }', "3"), "a claim is on a printed number, and 3 is none"),
        (CLAIM.replace("closed:{key}:0", "model:rates:{key}"), "check is 'model:rates:slow', the result itself"),
        (CLAIM.replace('from = "model:rates:{key}"', ""), "rate: give from, where the number stands, or a reason"),
        (CLAIM + 'times = "1/2"', r"\[\[claim\]\] rate: printed value '1/2': .* is not a number"),
        (CLAIM + 'reason = "Elsewhere."', "rate: give from, where the number stands, or a reason"),
        (CLAIM.replace("[[claim]]", "[claim]"), r"'claim' is no list of tables .*; write \[\[claim\]\]"),
        (CLAIM.replace("[[claim]]", "[[clam]]"), "'clam' is no list of tables that it may have; did you mean claim"),
        (COMMAND.replace("line", "lin"), "has the unknown field 'lin'; did you mean line"),
        (COMMAND.replace("line", "# "), "has no line; give name and line"),
        (COMMAND + "timeuot = 3", r"\[\[command\]\] has the unknown field 'timeuot'; did you mean timeout"),
        (COMMAND + 'reads = ["/etc"]', r"\[\[command\]\]: .*leads out of the project"),
        (COMMAND + 'reads = ["papers/"]', "reads 'papers/', and so what the paper prints"),
        (COMMAND + 'writes = ["a.csv"]\n' + COMMAND.replace("fit", "fat") + 'writes = ["a.csv"]',
         "'a.csv' is written by 'fit' and 'fat'; let one write it"),
        (CLAIM.replace('slow = "0.25"', 'slow = "12:30"'), r"rate: printed value '12:30'.* a time or a ratio"),
        ('[[data]]\nfile = "a.csv"', "missing required field `sha256`"),
        ('[[reading]]\nname = "a"', "missing required field `place`"),
        *((f'{CLAIM}{field} = {{ fats = "x" }}', f"{field} speaks of the entry 'fats'; did you mean fast") for field in
          ("erratum", "meant", "reading", "pinned")),
    ],
)  # fmt: skip
def test_a_field_that_does_not_do_names_file_and_line(tmp_path: Path, text: str, said: str) -> None:
    folder = tmp_path / "papers" / "roe"
    folder.mkdir(parents=True)
    with pytest.raises(AuditError, match=said):
        stated(folder, text)


def test_code_is_the_line_of_the_declaration(tmp_path: Path) -> None:
    tree = SourceTree({"papers": tmp_path})
    parts = stated(tmp_path, CLAIM + SIZE.replace("PRINT", "1")).parts
    assert [tree.location(claim.answer) for part in parts for claim in part.claims] == [
        "papers/claims.toml:2",
        "papers/claims.toml:2",
        "papers/claims.toml:12",
    ]
    here = Part("Sec. 1", reading="none")
    here.cited("time", "3", place="Sec. 1", statement="Seconds.", reason="Of that computer.")
    found = SourceTree({"tests": Path(__file__).parent}).location(here.claims[0].answer)
    line = int(found.removeprefix("tests/test_numbers.py:"))
    assert "here.cited" in Path(__file__).read_text(encoding="utf-8").splitlines()[line - 1]


def test_an_experiment_that_failed_is_told_as_that_and_counts_as_used(tmp_path: Path) -> None:
    results = Available({"closed": RESULTS["closed"]}, {"model": "experiment model failed: ValueError"})
    with pytest.raises(AuditError, match=r"^experiment model failed: ValueError$"):
        stated(tmp_path, CLAIM).parts[0].claims[0].answer(results)
    assert results.read == {"model"}


@pytest.mark.parametrize("ask", [lambda r: r["a"], lambda r: r.get("a"), lambda r: dict(r)["a"]])
def test_a_result_that_is_read_in_any_way_counts_and_is_a_copy(ask: Callable[[Available], Any]) -> None:
    held = {"a": [1.0]}
    results = Available(held, {})
    assert len(results) == 1 and "a" in results and results.read == set()
    ask(results).append(2.0)
    assert (held["a"], results["a"], results.read) == ([1.0], [1.0, 2.0], {"a"})


def test_an_experiment_that_is_asked_for_by_a_wrong_name_is_told_with_those_there_are() -> None:
    with pytest.raises(AuditError, match=r"there is no experiment modle; did you mean model\?"):
        Available({"model": 1.0}, {"closed": "failed"})["modle"]


TABLES = Path(__file__).parent / "texts" / "tables"
"""A paper without Python of its own."""
INIT = "from replication.audit.numbers import paper_of_tables\nPAPER = paper_of_tables(__file__)\n"
DATA = '"",est\n"treated",0.7512\n"control",1.213\n'


@pytest.mark.slow
def test_a_paper_of_tables_alone(tmp_path: Path) -> None:
    """A command makes a file, claims read it and a pinned one; a changed script, table or pin is noticed."""
    lab = emptied(make_inside(tmp_path / "lab"))
    sha = hashlib.sha256(DATA.encode()).hexdigest()
    texts = {f"{lab.package}/roe/{path.name}": path.read_text().replace("SHA", sha) for path in TABLES.iterdir()}
    texts |= {f"{lab.package}/roe/__init__.py": INIT, "data/d.csv": DATA}
    texts["fit.sh"] = "echo Fitting...; mkdir out; cp data/d.csv out/fit.csv\n"
    for name, text in texts.items():
        (lab.root / name).parent.mkdir(parents=True, exist_ok=True)
        (lab.root / name).write_text(text, encoding="utf-8")
    done = lab.cli("run")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "roe: 5 claims" not in done.stdout and "3 computed, 0 reused" in done.stdout
    found = json.loads((lab.root / "report" / "results.json").read_bytes())
    told = {one["claim"]["id"]: one for one in found["claims"]}
    assert {name: one["judgement"]["verdict"] for name, one in told.items()} == {
        "roe.slope.treated": "reproduced",
        "roe.slope.control": "differs",
        "roe.raw": "reproduced",
        "roe.time": "undetermined",
    }
    assert told["roe.raw"]["evidence"]["method"].endswith("Nothing here makes data/d.csv.")
    assert told["roe.slope.treated"]["claim"]["uses"] == ["roe.fit", "roe.out-fit.csv"]
    assert "0 problems in 4 claims" in lab.cli("check").stdout
    (lab.root / "fit.sh").write_text(texts["fit.sh"].replace("cp", "sed s/0.75/0.85/").replace("out/", "> out/"))
    again = lab.cli("run")
    assert again.returncode == 1 and "roe.slope.treated" in again.stdout and "2 computed, 1 reused" in again.stdout
    (lab.root / "data/d.csv").write_text(DATA + '"new",2\n', encoding="utf-8")
    other = lab.cli("run")
    assert other.returncode == 3 and f"not {sha}; it is another file than was declared" in other.stdout
