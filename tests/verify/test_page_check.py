"""The check in the reader's browser against the verifier: the same word on true, altered, foreign and malformed files.

`check.js` runs in Node where that is installed, else in Chromium.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import corpus
import numpy as np
import pytest
from attacks import ATTACKS, Attack, certificates, encoded, false_wish, own, work_bomb

from replication.audit.publish.picture import started
from replication.audit.report.checks import MOST_BYTES, checkable
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
WHOLE = "REPLICATION_ATTACKS" in os.environ
ATTACKS_OF_EACH = 60 if WHOLE else 12
ONE_IN = 1 if WHOLE else 12
"""Of the altered certificates, a sample, or all with the environment variable REPLICATION_ATTACKS."""
UNDECIDED = ("not decided", "may allow periods above", "is not proved")
"""What the verifier says where its balls are too wide; the exact ends of the page may still decide."""


def in_node(folder: Path, cases: Sequence[Case], without: str = "") -> list[dict[str, Any]]:
    (folder / "check.js").write_text(source("check.js"), encoding="utf-8")
    (folder / "cases.json").write_text(json.dumps(cases), encoding="utf-8")
    command = ["node", "-e", IN_NODE, str(folder / "check.js"), str(folder / "cases.json"), without]
    found: list[dict[str, Any]] = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return found


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Check]:
    """What the script of the page says of certificates."""
    if shutil.which("node"):
        folder = tmp_path_factory.mktemp("node")
        yield lambda cases: in_node(folder, cases)
    elif shutil.which("chromium") and shutil.which("chromedriver"):
        browser = started()
        browser.get("about:blank")
        browser.execute_script(f"const code = document.createElement('script'); code.text = {json.dumps(source('check.js'))}; document.head.append(code);")  # type: ignore[no-untyped-call]  # fmt: skip  # noqa: E501
        yield lambda cases: [
            found
            for first in range(0, len(cases), 50)
            for found in browser.execute_script(f"const cases = arguments[0]; return {EACH}", cases[first : first + 50])  # type: ignore[no-untyped-call]
        ]
        browser.quit()
    else:
        pytest.skip("neither Node nor Chromium is installed; the check of the page is tried where one is")


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


@pytest.mark.parametrize("attack", [attack for attack in ATTACKS if attack is not work_bomb])
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
            if attack is false_wish:  # a list of theorems that wants just this
                wanted = {field: altered[field] for field in wanted or ()}
        except (ValueError, RecursionError, KeyError, TypeError):
            text, wanted = content.decode("utf-8", "replace"), subject(*name.split("/"))
        cases.append((text, wanted, []))
    for (text, _, _), outcome in zip(cases, page(cases), strict=True):
        assert not outcome["proved"] and outcome["reason"], text[:200]


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
