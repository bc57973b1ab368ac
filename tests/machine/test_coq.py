"""Coq: certificates that hold are proved on no assumption, and changed certificates, decimals and files are refused.

A few changes; all of them with MUTANTS=all (`make mutants`).
"""

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from replication.audit.judge.proofs import sha256
from replication.audit.judge.proofs import wanted as proofs
from replication.errors import AuditError, InvalidInputError, ReplicationError
from replication.machine import sum_for
from replication.machine.generate import identifier, proposition, source
from replication.machine.run import CLOSED, PACKAGES, RECORD, Coq, audited, checked, counted, lines, prepared, wanted

ROOT = Path(__file__).parents[2]
PAPER = "okajima2023"
needs_coq = pytest.mark.skipif(shutil.which("coqc") is None, reason=f"Coq is missing: apt-get install {PACKAGES}")
ALL = os.environ.get("MUTANTS") == "all"
ENTRIES = wanted(PAPER, ROOT)


def certificate(name: str) -> dict:
    return json.loads((ROOT / "certificates" / PAPER / f"{name}.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def coq(tmp_path_factory: pytest.TempPathFactory) -> Coq:
    return prepared(PAPER, ROOT, tmp_path_factory.mktemp("coq"))


@needs_coq
@pytest.mark.slow
@pytest.mark.parametrize("name", ["optimum-1-1", "gains-38"])
def test_a_certificate_is_proved(coq: Coq, name: str) -> None:
    assert checked(coq, ENTRIES[name], certificate(name)).line() == f"proved {PAPER}/{name}"


def first(part: str, change: Callable[[int], int]) -> Callable[[str], str]:
    """Change the first number in the table of a definition."""

    def changed(text: str) -> str:
        pattern = rf"(Definition {part} := (?:map \()?over \d+\)? \[:: \[:: (?:\[:: )?)(-?(?:0x[0-9a-f]+|\d+))"
        return re.sub(pattern, lambda found: f"{found[1]}{change(int(found[2], 0))}", text, count=1)

    return changed


def bound(side: str, factor: int) -> Callable[[str], str]:
    """Multiply a bound by 1 + factor/10^6, in the definition and in the theorem; the other one stays beside it."""

    def changed(text: str) -> str:
        p, q = map(int, re.search(rf"Definition {side} := Qmake (\d+) (\d+)", text).groups())
        return text.replace(f"Qmake {p} {q}", f"Qmake {p * (10**6 + factor)} {q * 10**6}")

    return changed


def put(old: str, new: str) -> Callable[[str], str]:
    return lambda text: re.sub(old, new, text)


def both(*changes: Callable[[str], str]) -> Callable[[str], str]:
    def changed(text: str) -> str:
        for change in changes:
            text = change(text)
        return text

    return changed


CHANGES: dict[str, tuple[str, Callable[[str], str]]] = {
    "both bounds raised": ("optimum-1-1", both(bound("upper", 3), bound("lower", 3))),
    "both bounds lowered": ("optimum-1-1", both(bound("lower", -3), bound("upper", -3))),
    "bounds of a gain raised": ("gains-38", both(bound("upper", 3), bound("lower", 3))),
    "bounds of a gain lowered": ("gains-38", both(bound("lower", -3), bound("upper", -3))),
    "lower bound too far down": ("optimum-1-1", bound("lower", -3)),
    "lower above upper": ("optimum-1-1", bound("lower", 10)),
    "no room": ("optimum-1-1", put(r"Definition room := Qmake \d+ \d+", "Definition room := Qmake 0 1")),
    "too much room": ("optimum-1-1", put(r"Definition room := Qmake \d+ \d+", "Definition room := Qmake 1 8")),
    "storage not bounded": ("gains-38", put(r"Definition above := Qmake \d+ \d+", "Definition above := Qmake 1 100")),
    "storage": ("gains-38", first("storage", lambda x: 2 * x)),
    "factor": ("gains-38", first("factors", lambda x: 2 * x)),
    "gain of an optimum": ("optimum-1-1", first("gains", lambda x: -x)),
    "start": ("gains-38", first("way", lambda x: x + 1)),
    "cycle": ("optimum-1-1", first("cycle", lambda x: x + 1)),
    "cycle of a gain": ("gains-38", first("cycle", lambda x: x + 1)),
    "turn not orthogonal": ("gains-38", first("turn", lambda x: 2 * x)),
    "turned the other way": ("gains-38", first("turn", lambda x: -x)),
    "no way from rest": ("optimum-1-1", put(r"Definition way := [^.]*\.", "Definition way := [::] : seq table.")),
    "no cycle": ("optimum-1-1", put(r"Definition cycle := [^.]*\.", "Definition cycle := [::] : seq table.")),
    "offset": ("gains-38", put(r"\(1, 3, 0\)", "(1, 3, 1)")),
    "period": ("optimum-1-1", put(r"\(1, 1, 0\)", "(1, 2, 0)")),
    "sensor": ("optimum-1-1", put(r"\(1, 1, 0\)", "(0, 1, 0)")),
    "gains of another equation": ("gains-38", put("gains_38", "gains_39")),
}
SAMPLE = ("both bounds raised", "bounds of a gain lowered")


@needs_coq
@pytest.mark.slow
@pytest.mark.parametrize("what", CHANGES if ALL else SAMPLE)
def test_a_changed_certificate_is_refused(coq: Coq, what: str) -> None:
    name, change = CHANGES[what]
    text = source(certificate(name))
    assert change(text) != text
    with pytest.raises(ReplicationError, match="Error"):
        coq.compile(f"{PAPER}/changed_{identifier(what)}", change(text))


DECIMALS = {"A": "0.95", "B_d": "0.3", "C": "2.5", "D": "0]; [:: 0; 0.5", "W": "1; 0; 0]; [:: 0; 1", "gains": "0.276"}
"""Which decimal of the plant or the gains (38) is changed, in the words around it; the last number in them is."""


@needs_coq
@pytest.mark.slow
@pytest.mark.parametrize("what", DECIMALS if ALL else ["gains"])
def test_changed_decimals_are_refused(coq: Coq, what: str) -> None:
    text = (ROOT / "papers" / PAPER / "coq" / "Decimals.v").read_text(encoding="utf-8")
    old = DECIMALS[what]
    start, last = old[: old.rindex(" ") + 1] if " " in old else "", old.split(" ")[-1]
    assert old in text
    other = Coq(coq.folder, f"other_{what}")
    other.compile(f"{other.paper}/Decimals", text.replace(old, f"{start}{float(last) * 1.01:.4f}", 1), shared=True)
    changed = source({**certificate("gains-38"), "paper": other.paper})
    with pytest.raises(ReplicationError, match="Error"):
        other.compile(f"{other.paper}/gains_38", changed)


AUDITS: dict[str, Callable[[str], str]] = {
    "axiom": lambda text: re.sub(
        r"Proof\. move=> R; .* Qed",
        "Proof. by move=> R; case: cheat. Qed",
        text.replace("Theorem", "Axiom cheat : False.\nTheorem"),
    ),
    "admitted": lambda text: re.sub(r"Proof\. vm_cast_no_check \(erefl true\)\. Qed", "Admitted", text),
    "a plant of its own": lambda text: text.replace(
        "Definition plant :=",
        "Definition gains_38_plant := Plant (tA stable) (tBu stable) (tBd stable) (tC stable) [::] (tW stable).\n"
        "Definition plant :=",
    ).replace("Proof. vm_cast_no_check (erefl true). Qed", "Admitted"),
}


@needs_coq
@pytest.mark.slow
@pytest.mark.parametrize("what", AUDITS if ALL else ["axiom"])
def test_the_audit_refuses_what_is_not_proved(coq: Coq, what: str) -> None:
    text, name = source(certificate("gains-38")), f"audited_{identifier(what)}"
    assert AUDITS[what](text) != text
    coq.compile(f"{PAPER}/{name}", AUDITS[what](text))
    with pytest.raises(ReplicationError, match=r"assumptions|wanted|type"):
        audited(coq, ENTRIES["gains-38"], certificate("gains-38"), f"{PAPER}.{name}")


def test_every_level_of_the_paper_is_stated() -> None:
    assert len(ENTRIES) >= 17
    for name, entry in ENTRIES.items():
        stated = proposition(vars(entry), certificate(name)["bound"])
        assert stated in source(certificate(name))
        assert identifier(entry.plant) in stated


def test_the_decimals_are_those_of_the_printed_values() -> None:
    import tomllib

    text = (ROOT / "papers" / PAPER / "coq" / "Decimals.v").read_text(encoding="utf-8")
    printed = tomllib.loads((ROOT / "papers" / PAPER / "printed.toml").read_text(encoding="utf-8"))

    def rows(matrix: str) -> str:
        return "; ".join(f"[:: {'; '.join(row.split())}]" for row in matrix.strip("[]").split(";"))

    for key, matrix in printed["plant"]["value"].items():
        assert re.search(rf"\(\* {key} +\*\) \[:: {re.escape(rows(matrix))}\]", text), key
    for equation in ("33", "38", "39", "40"):
        zero = rows("[0 0; 0 0; 0 0]")
        found = [rows(matrix) for matrix in printed["gains"]["value"][equation]]
        wanted_text = "".join(";\n  " + ("unmeasured" if matrix == zero else f"[:: {matrix}]") for matrix in found)
        assert f"gains_{equation} : seq table := [::\n  {wanted_text[4:]}]." in text


def test_a_sensor_named_twice_is_refused() -> None:
    entry = ENTRIES["optimum-1-1"]
    given = {**entry.parameters, "sensors": [1, 1]}
    with pytest.raises(InvalidInputError, match="name one twice"):
        proposition({**vars(entry), "parameters": given}, certificate("optimum-1-1")["bound"])


def test_without_coq_it_says_what_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    with pytest.raises(InvalidInputError, match="apt-get install coq libcoq-mathcomp-algebra"):
        Coq(tmp_path, PAPER)


@needs_coq
def test_what_coq_prints_of_a_proof_without_assumptions(tmp_path: Path) -> None:
    coq = Coq(tmp_path, PAPER)
    assert coq.compile(f"{PAPER}/a", "Lemma a : True. Proof. exact I. Qed.\nPrint Assumptions a.").strip() == CLOSED
    with pytest.raises(ReplicationError, match="Error"):
        coq.compile(f"{PAPER}/b", "Lemma b : False. Proof. exact I. Qed.")


def test_the_documentation_shows_the_count_of_lines_which_is_short() -> None:
    count = counted(PAPER, "gains-38")
    assert count in (ROOT / "docs" / "machine-checked.md").read_text(encoding="utf-8")
    assert int(count.split()[0]) <= 60
    assert lines("(* one\n two *)\n\nDefinition a := 1. (* three *)\n") == 1


def test_the_report_calls_a_theorem_machine_checked_for_the_very_file_only(tmp_path: Path) -> None:
    for part in ("papers", "certificates"):
        shutil.copytree(ROOT / part / PAPER, tmp_path / part / PAPER)
    path = tmp_path / "certificates" / PAPER / "gains-38.json"
    kept = tmp_path / "papers" / PAPER / RECORD
    record = {
        "coq": "8",
        "statement": "Statement.v",
        "theory": sum_for(kept.parent),
        "certificates": {"gains-38": sha256(path), "gains-39": "0" * 64},
    }
    kept.write_text(json.dumps(record), encoding="utf-8")

    def named() -> list[str]:
        return [entry.name for entry in proofs(tmp_path, [PAPER])[0] if entry.machine]

    assert named() == ["gains-38"]
    path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert named() == []
    kept.unlink()
    assert named() == []
    kept.write_text("[]", encoding="utf-8")
    with pytest.raises(AuditError, match="not what `replication coq` writes"):
        named()
