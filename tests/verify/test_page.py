"""The check in the reader's browser against the verifier: the same word on true, altered, foreign and malformed files.

`check.js` runs in Node where that is installed, else in Chromium.
"""

import json
import os
import shutil
import subprocess
import tomllib
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import byhand
import corpus
import numpy as np
import pytest
from attacks import ATTACKS, Attack, certificates, encoded, own
from byhand import Certificate
from tampered import delayed as certificate
from tampered import refused

from replication.audit.report.evidence import MOST_BYTES, checkable
from replication.audit.report.templates import source
from replication.verify.run import check, verify
from replication.verify.subjects import subject
from replication.verify.theorem import Refused

ROOT = Path(__file__).parents[2]
Case = tuple[str, Mapping[str, Any] | None, Sequence[str]]
"""The text of a certificate, what it must be about, and printed numbers."""
Check = Callable[[Sequence[Case]], list[dict[str, Any]]]
EACH = "cases.map(([text, wanted, prints]) => checkProof(text, wanted, prints))"
IN_NODE = f"""
const fs = require("fs"), vm = require("vm");
const [code, asked, without] = process.argv.slice(1), context = vm.createContext({{}});
if (without) vm.runInContext(`delete globalThis.${{without}}`, context);
vm.runInContext(fs.readFileSync(code, "utf8"), context);
const cases = JSON.parse(fs.readFileSync(asked, "utf8")), {{ checkProof }} = context;
process.stdout.write(JSON.stringify({EACH}));
"""
WHOLE = os.environ.get("MUTANTS") == "all"
ATTACKS_OF_EACH = 60 if WHOLE else 12
ONE_IN = 1 if WHOLE else 12
"""Of the altered certificates, a sample, or all with MUTANTS=all (`make mutants`)."""
UNDECIDED = ("not decided", "may allow periods above", "is not proved")
"""What the verifier says where its balls are too wide; the exact ends of the page may still decide."""


def in_node(folder: Path, cases: Sequence[Case], without: str = "") -> list[dict[str, Any]]:
    (folder / "check.js").write_text(source("check.js"), encoding="utf-8")
    (folder / "cases.json").write_text(json.dumps(cases), encoding="utf-8")
    command = ["node", "-e", IN_NODE, str(folder / "check.js"), str(folder / "cases.json"), without]
    found: list[dict[str, Any]] = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return found


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Check:
    """What the script of the page says of certificates, in Node, or else in Chromium."""
    if shutil.which("node"):
        folder = tmp_path_factory.mktemp("node")
        return lambda cases: in_node(folder, cases)
    browser = request.getfixturevalue("browser")
    browser.get("about:blank")
    script = f"const code = document.createElement('script'); code.text = {json.dumps(source('check.js'))};"
    browser.execute_script(f"{script} document.head.append(code);")
    return lambda cases: [
        found
        for first in range(0, len(cases), 50)
        for found in browser.execute_script(f"const cases = arguments[0]; return {EACH}", cases[first : first + 50])
    ]


def wanted_of(certificate: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """What the paper's own data say that a certificate must be about; nothing for a plant of one's own."""
    return None if certificate["paper"] is None else subject(certificate["paper"], certificate["name"])


@cache
def all_certificates() -> dict[str, dict[str, Any]]:
    return certificates(ROOT)


@cache
def covered() -> tuple[str, ...]:
    """Those that a page holds."""
    paths = {name: ROOT / "certificates" / f"{name}.json" for name in all_certificates()}
    known = (name for name, one in all_certificates().items() if one["statement"] in checkable())
    return tuple(sorted(name for name in known if paths[name].stat().st_size <= MOST_BYTES))


def refusal(certificate: Mapping[str, Any]) -> str:
    """Why the verifier refuses a certificate; empty if it proves it."""
    try:
        check(certificate)
    except Refused as reason:
        return str(reason)
    return ""


def test_every_certificate_of_a_statement_that_it_knows_is_proved_with_the_same_answer(page: Check) -> None:
    names = covered()
    texts = [(ROOT / "certificates" / f"{name}.json").read_text(encoding="utf-8") for name in names]
    found = page([(text, wanted_of(json.loads(text)), []) for text in texts])
    assert len(names) >= 40, "the page is to hold at least forty of them"
    for name, outcome in zip(names, found, strict=True):
        theorem = verify(ROOT / "certificates" / f"{name}.json").theorem
        assert theorem is not None and outcome["proved"], (name, outcome["reason"])
        assert (outcome.get("holds") is False) is (theorem.holds is False), name


@pytest.mark.parametrize("attack", ATTACKS)
def test_no_attack_on_the_verifier_deceives_the_page(attack: Attack, page: Check) -> None:
    rng, all_, names = np.random.default_rng(31), all_certificates(), covered()
    cases: list[Case] = []
    for _ in range(ATTACKS_OF_EACH):
        name = names[rng.integers(len(names))]
        content = attack(rng, all_[name], all_)
        try:
            text = content.decode()
            altered = json.loads(text)
            wanted = None if altered["paper"] is None else subject(*_place(altered, name))
        except (ValueError, RecursionError, KeyError, TypeError):
            text, wanted = content.decode("utf-8", "replace"), subject(*name.split("/"))
        cases.append((text, wanted, []))
    for (text, _, _), outcome in zip(cases, page(cases), strict=True):
        assert not outcome["proved"] and outcome["reason"], text[:200]


def test_no_false_theorem_deceives_the_page_though_it_is_the_wanted_one(page: Check) -> None:
    rows = [row for row in refused("false") if all_certificates()[row.name]["statement"] in checkable()]
    false = [row.applied(deepcopy(all_certificates()[row.name])) for row in rows]
    found = page([(json.dumps(one), {field: one[field] for field in SUBJECT}, []) for one in false])
    assert found and not any(outcome["proved"] for outcome in found)


def _place(altered: Mapping[str, Any], name: str) -> list[str]:
    """Where an altered certificate would lie: at its own theorem, if there is one, else at that of the true one."""
    own_place = [altered["paper"], altered["name"]]
    there = all(isinstance(part, str) for part in own_place) and (ROOT / "certificates" / "/".join(own_place)).exists()
    return own_place if there else name.split("/")


def test_altered_certificates_get_the_word_of_the_verifier(page: Check) -> None:
    altered = [
        one
        for certificate in corpus.true().values()
        if certificate["statement"] in checkable()
        for one in corpus.altered(certificate)
    ][::ONE_IN]
    found = page([(json.dumps(one), wanted_of(one), []) for one in altered])
    agreed = {True: 0, False: 0}
    for one, outcome in zip(altered, found, strict=True):
        reason = refusal(one)
        undecided = outcome["proved"] and any(words in reason for words in UNDECIDED)
        assert outcome["proved"] is not bool(reason) or undecided, (one["name"], reason, outcome["reason"])
        agreed[outcome["proved"]] += 1
    assert agreed[True] > 20 and agreed[False] > 100


PRINTS = {
    "1.14": "below 1.135, where the numbers that round to the printed 1.14 begin",
    "1.12": "above 1.125, where the numbers that round to the printed 1.12 end",
    "1.13": "rounds to the printed 1.13",
    "1.134687": "does not decide whether 1.134687 is right",
    "1.1": "rounds to the printed 1.1",
    ".9": "round to the printed .9 end",
    "unstable": "",
}


def test_a_number_is_put_on_its_side_of_the_print(page: Check) -> None:
    text = (ROOT / "certificates/okajima2023/optimum-2-1.json").read_text(encoding="utf-8")
    wanted = subject("okajima2023", "optimum-2-1")
    found = page([(text, wanted, [printed]) for printed in PRINTS])
    bare = page([(text, wanted, [])])[0]["steps"]
    for (printed, words), outcome in zip(PRINTS.items(), found, strict=True):
        told = outcome["steps"][len(bare) :]
        assert [words in step for step in told] == [True] * bool(words), printed


def test_one_digit_of_a_witness_another_plant_and_a_damaged_text_are_told(page: Check) -> None:
    text = (ROOT / "certificates/okajima2023/optimum-2-1.json").read_text(encoding="utf-8")
    wanted = subject("okajima2023", "optimum-2-1")
    cases = {
        "the energy matrix P": text.replace('"P": [[["1264073889201/', '"P": [[["-1264073889201/'),
        "the disturbance does not reach the lower bound": text.replace("12190811/", "92190811/"),
        "the balance of energy at instant": text.replace("1247602294949", "1247601843654"),
        "plant is not that of the paper": text.replace('"19/20"', '"18/20"'),
        "no valid JSON": text.rstrip()[:-1],
        "statement is not that of the paper": text.replace(
            '"multirate.optimum-noncausal"', '"</script><script>alert(1)</script>"'
        ),
    }
    for (words, _), outcome in zip(cases.items(), page([(case, wanted, []) for case in cases.values()]), strict=True):
        assert not outcome["proved"] and words in outcome["reason"], (words, outcome["reason"])


@pytest.mark.skipif(not shutil.which("node"), reason="needs Node")
def test_without_exact_integers_the_page_says_so(tmp_path: Path) -> None:
    text = encoded(own(all_certificates()["okajima2023/optimum-1-1"])).decode()
    assert in_node(tmp_path, [(text, None, [])])[0]["proved"]
    (outcome,) = in_node(tmp_path, [(text, None, [])], "BigInt")
    assert not outcome["proved"] and "no BigInt" in outcome["reason"]


def test_its_code_is_short_enough_to_be_read() -> None:
    lines = source("check.js").splitlines()
    assert len(lines) <= 700 and "</script" not in source("check.js")


# Checks of the page's script can fail: an input that one alone refuses, and the fault that lets it through.


SUBJECT = ("paper", "name", "claims", "statement", "plant", "parameters")
OF_THE_PAPER = ("multirate.one-matrix", "dualrate.counterexample")
FAULTS_IN_NODE = """
const fs = require("fs"), vm = require("vm");
process.stdout.write(JSON.stringify(JSON.parse(fs.readFileSync(0, "utf8")).map(([code, text, wanted]) => {
  const context = vm.createContext({});
  vm.runInContext(code, context);
  return context.checkProof(text, wanted);
})));
"""


def slow(statement: str, a: str, bound: Mapping[str, str], witness: Mapping[str, Any], **plant: Any) -> Certificate:
    """x+ = a x + d, y = x + w, z = x, measured at each instant."""
    return byhand.own(
        f"multirate.{statement}",
        plant={"name": "own", "A": [[a]], "B_d": [["1"]], "C": [["1"]], "D": [["1"]], "W": [["1"]], **plant},
        parameters={"sensors": [0], "periods": [1], "offsets": [0]}
        | ({} if statement == "one-matrix" else {"relative": "1000"}),
        bound=bound,
        witness=witness,
    )


def weights(*diagonal: str) -> dict[str, Any]:
    return {"Z": [gram(3, {(i, i): x for i, x in enumerate(diagonal)})]}


def wide(lower: str = "1/10", upper: str = "10") -> dict[str, str]:
    return {"lower": lower, "upper": upper}


def ideal(a: str, y: str, **witness: Any) -> dict[str, Any]:
    return {"P": [[["2"]]], "Y": [[[y]]], "turn": [["1"]], "d": [[["1"]]], **witness}


def kept(p: str = "2", turn: str = "1", v: str = "1") -> dict[str, Any]:
    return {"P": [[[p]]], "turn": [[turn]], "v": [[[v], ["0"]]]}


HALF = {"L": [[["1/2"]]]}
NO_GAIN = {"L": [[["0"]]]}
SKEW = slow(
    "gain", "0", wide(), {"P": [[["2", "1/10"], ["0", "2"]]], "turn": [["1"]], "v": [[["1"], ["0"]]]},
    A=[["0", "0"], ["0", "0"]], B_d=[["1"], ["1"]], C=[["1", "0"]], W=[["1", "0"], ["0", "1"]], L=[[["0"], ["0"]]],
)  # fmt: skip


def loop(statement: str, witness: Mapping[str, Any], parameters: Mapping[str, Any], **plant: Any) -> Certificate:
    scalar = {"name": "own", "A": [["1"]], "B": [["1"]], "C": [["1"]], "K": [["-2"]], "L": [["2"]], "T": "1/1000"}
    return byhand.own(
        f"dualrate.{statement}", plant={**scalar, "M": "5", **plant}, parameters=parameters, bound={}, witness=witness
    )


def diverges(longest: str = "1/100", plant: Mapping[str, Any] | None = None, **change: Any) -> Certificate:
    text = (ROOT / "certificates/shao/counterexample.json").read_text(encoding="utf-8")
    witness = {"lyapunov": json.loads(text)["witness"]["lyapunov"] | change}
    return loop("counterexample", witness, {"ratios": [2], "longest": longest}, **(plant or {}))


def limited(**change: Any) -> Certificate:
    return loop("condition", diverges(**change)["witness"], {}, T="1/1000000")


def hidden(lower: str = "1/1000", state: tuple[str, str] = ("1", "0"), **plant: Any) -> Certificate:
    true = certificate("ex1-lower")
    witness = {"frequency": "0", "state": [[x] for x in state]}
    return byhand.own(
        "delay.gain-lower", plant=true["plant"] | plant, parameters={}, bound={"lower": lower}, witness=witness
    )


def gram(count: int, entries: Mapping[tuple[int, int], str]) -> list[list[str]]:
    places = {**entries, **{(j, i): x for (i, j), x in entries.items()}}
    return [[places.get((i, j), "0") for j in range(count)] for i in range(count)]


def two_delays(coupled: str, product: str) -> Certificate:
    """x' = w, z = y = x, of Gram matrices that balance and are not positive definite."""
    zero = [["0"]]
    plant = {
        "name": "own", "A0": zero, "A": [zero, zero], "delays": ["1", "2"], "B": [["1"]], "C10": [["1"]],
        "C1": [zero, zero], "C2": [["1"]],
    }  # fmt: skip
    supply = {(0, 0): "1", (1, 1): "1", (1, 2): product, (3, 4): coupled}
    witness = {
        "change": [["1"]],
        "storage": [gram(13, {(1, 2): coupled}), gram(5, {})],
        "dissipation": [gram(17, supply), gram(9, {})],
    }
    return byhand.own("delay.gain-upper", plant=plant, parameters={"degree": 1}, bound={"upper": "1"}, witness=witness)


ZERO = [["0", "0"], ["0", "0"]]
ROWS: dict[str, tuple[Certificate, str]] = {
    "unstable plant": (slow("optimum-noncausal", "2", wide(), ideal("2", "4")), "Lyapunov matrix of the plant"),
    "hiding noise": (slow("optimum-noncausal", "1/2", wide("1"), ideal("1/2", "1")), "does not reach"),
    "hiding noise of a predictor": (
        slow("optimum-causal", "1/2", wide("1"), {"P": [[["2"]]], "Y": [[["1"]]], "start": 0, "d": [[["1"]], [["0"]]]}),
        "does not reach",
    ),
    "energy not positive": (slow("gain", "2", wide(), kept("-1"), **NO_GAIN), "the energy matrix P"),
    "energy does not fall": (slow("gain", "1/2", wide(upper="1"), kept(), **HALF), "the balance of energy"),
    "not symmetric": (SKEW, "is not symmetric"),
    "no disturbance": (slow("gain", "1/2", wide(), kept(v="0"), **HALF), "the disturbance is zero"),
    "too small a disturbance": (slow("gain", "1/2", wide("3"), kept(), **HALF), "does not reach"),
    "turn that grows": (slow("gain", "1/2", wide(), kept(turn="2"), **HALF), "the turn is not orthogonal"),
    "weight not positive": (
        slow("one-matrix", "2", {"lower": "1"}, weights("1", "1", "-1/2"), **NO_GAIN),
        "the weight Z",
    ),
    "states gain nothing": (
        slow("one-matrix", "1/2", {"lower": "1"}, weights("4", "1", "1"), **NO_GAIN),
        "what the states gain",
    ),
    "P of an unstable loop": (
        loop("lyapunov", {"P": [["-1/2", "0"], ["0", "1/2"]]}, {}, K=[["0"]]), "P is not positive definite",
    ),
    "P of another loop": (loop("lyapunov", {"P": [["1", "0"], ["0", "1"]]}, {}), "does not solve"),
    "unstable feedback": (loop("hurwitz", {}, {"matrix": "feedback"}, K=[["0"]]), "the Lyapunov matrix of A + BK"),
    "condition open": (limited(low="1/1000000"), "is not decided"),
    "eigenvalue below low": (diverges(low="1"), "P − low·I"),
    "eigenvalue above high": (diverges(high="1/2"), "high·I − P"),
    "periods that (18) allows": (diverges("1/1000000000"), "may allow longer periods"),
    "another loop": (
        diverges("1/10", {"L": [["3"]]}, P=[["1/2", "1/3"], ["1/3", "7/12"]], low="1/10", high="2"), "needs A = B",
    ),
    "seen by y": (hidden(state=("0", "1")), "the state is seen by y"),
    "nothing moves": (hidden(A0=ZERO, A=[ZERO], C10=ZERO), "does not move z"),
    "level not reached": (hidden("10"), "is not proved to reach the level"),
    "a delay twice": (
        hidden(A=[ZERO, ZERO], C1=[ZERO, ZERO], delays=["1", "1"]), "the delays must increase",
    ),
    "Gram not positive": (two_delays("0", "-1"), "the Gram matrix"),
    "V couples two delays": (two_delays("1", "-1"), "the Gram matrix"),
    "balance broken": (two_delays("0", "0"), "the Gram matrix"),
}  # fmt: skip
"""By what is wrong: the certificate, and words of its refusal."""

FAULTS: dict[str, list[tuple[str, str]]] = tomllib.loads(
    Path(__file__).with_name("faults.toml").read_text(encoding="utf-8")
)
"""By the row that tells it: the changes of the script. Without the last one the row is still refused."""


@pytest.mark.skipif(not shutil.which("node"), reason="needs Node")
def test_each_check_of_the_script_refuses_an_input_that_its_fault_lets_through() -> None:
    assert set(FAULTS) == set(ROWS)
    asked: list[tuple[str, str, Any]] = []
    for name, changes in FAULTS.items():
        one = ROWS[name][0]
        wanted = {field: one[field] for field in SUBJECT} if one["statement"] in OF_THE_PAPER else None
        code = source("check.js")
        codes = [code]
        for before, after in changes:
            assert code.count(before) == 1, (name, before)
            code = code.replace(before, after)
            codes.append(code)
        asked += [(text, json.dumps(one), wanted) for text in (codes[0], codes[-2], codes[-1])]
    command = ["node", "-e", FAULTS_IN_NODE]
    ran = subprocess.run(command, input=json.dumps(asked), capture_output=True, text=True, check=True)
    outcomes = json.loads(ran.stdout)
    wrong = {}
    for i, (name, (_, words)) in enumerate(ROWS.items()):
        whole, all_but_one, faulty = outcomes[3 * i : 3 * i + 3]
        refused = not whole["proved"] and words in whole["reason"] and not all_but_one["proved"]
        if not (refused and faulty["proved"]):
            wrong[name] = (whole["reason"], all_but_one["reason"], faulty["reason"])
    assert not wrong, wrong
