"""Checks of the page's script can fail: an input that one alone refuses, and the fault that lets it through."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from byhand import Certificate, own
from delay_cases import certificate

from replication.audit.report.templates import source

ROOT = Path(__file__).parents[2]
SUBJECT = ("paper", "name", "claims", "statement", "plant", "parameters")
OF_THE_PAPER = ("multirate.one-matrix", "dualrate.counterexample")
IN_NODE = """
const fs = require("fs"), vm = require("vm");
process.stdout.write(JSON.stringify(JSON.parse(fs.readFileSync(0, "utf8")).map(([code, text, wanted]) => {
  const context = vm.createContext({});
  vm.runInContext(code, context);
  return context.checkProof(text, wanted);
})));
"""


def slow(statement: str, a: str, bound: Mapping[str, str], witness: Mapping[str, Any], **plant: Any) -> Certificate:
    """x+ = a x + d, y = x + w, z = x, measured at each instant."""
    return own(
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
    return own(
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
    return own("delay.gain-lower", plant=true["plant"] | plant, parameters={}, bound={"lower": lower}, witness=witness)


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
    return own("delay.gain-upper", plant=plant, parameters={"degree": 1}, bound={"upper": "1"}, witness=witness)


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

GRAM = ("positive(M, `the Gram matrix of ${Z.length} rows`);", "")
REACHED = ("demand(!below(made, times(times(level, level), spent))", "demand(true")
FAULTS: dict[str, tuple[tuple[str, str], ...]] = {
    "unstable plant": (('settles(plant.A, "the plant");', ""),),
    "hiding noise": (("squares(inputs[k]), hidden(k, x)]", "squares(inputs[k])]"),),
    "hiding noise of a predictor": (
        (", costOfHiding(plant, plant.schedule[(start + k) % plant.schedule.length], x)]", "]"),
    ),
    "energy not positive": (("positive(after, `the energy matrix P at instant ${k}`)", "0"),),
    "energy does not fall": (("positive(minus(room, product(transpose(step), P[k], step))", "positive(identity(1)"),),
    "not symmetric": (
        ("kept(read, same(read, transpose(read)),", "kept(read, true,"),
        ("demand(same(M, transpose(M)),", "demand(true,"),
    ),
    "no disturbance": (("demand(below(number(0), spent)", "demand(true"),),
    "too small a disturbance": (REACHED,),
    "turn that grows": (("demand(same(times(R, transpose(R)), identity(r))", "demand(true"),),
    "weight not positive": (("positive(M, `the weight Z at instant ${k}`);", ""),),
    "states gain nothing": (('positive(gained, "what the states gain by all weights");', ""),),
    "P of an unstable loop": (('positive(P, "P");', ""),),
    "P of another loop": (("demand(same(plus(times(transpose(J), P), times(P, J))", "demand(true || same(P"),),
    "unstable feedback": (("positive(X, `the Lyapunov matrix of ${what}`);", ""),),
    "condition open": (("demand(met || below(number(1), least)", "demand(true"),),
    "eigenvalue below low": (("positive(minus(P, scaled(identity(n), low))", "positive(identity(n)"),),
    "eigenvalue above high": (("positive(minus(scaled(identity(n), high), P)", "positive(identity(n)"),),
    "periods that (18) allows": (("demand(below(number(1), times(under, longest))", "demand(true"),),
    "another loop": (("demand([plant.A, plant.B, plant.C].every(", "demand(true || [plant.A].every("),),
    "seen by y": (("demand(same(times(plant.C2, x)", "demand(true || same(times(plant.C2, x)"),),
    "nothing moves": (("demand(below(number(0), made)", "demand(true"),),
    "level not reached": (("demand(!below(made, product(g, g, spent))", "demand(true"),),
    "a delay twice": (("below(delays[k - 1], tau)", "true"),),
    "Gram not positive": (GRAM,),
    "V couples two delays": (GRAM, ("demand(delay(i) === delay(j) ||", "demand(true ||")),
    "balance broken": (GRAM, ("demand(cancelled,", "demand(true,")),
}
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
    ran = subprocess.run(["node", "-e", IN_NODE], input=json.dumps(asked), capture_output=True, text=True, check=True)
    outcomes = json.loads(ran.stdout)
    wrong = {}
    for i, (name, (_, words)) in enumerate(ROWS.items()):
        whole, all_but_one, faulty = outcomes[3 * i : 3 * i + 3]
        refused = not whole["proved"] and words in whole["reason"] and not all_but_one["proved"]
        if not (refused and faulty["proved"]):
            wrong[name] = (whole["reason"], all_but_one["reason"], faulty["reason"])
    assert not wrong, wrong
