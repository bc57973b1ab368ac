"""The counter-example to play with: its arithmetic against the simulation and the theorem of the paper's package."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_page_proofs import certified

from papers.shao.experiments.motor import radius
from papers.shao.method.lyapunov import theorem_constants
from papers.shao.method.motor import simulate
from papers.shao.printed import APO, COUNTEREXAMPLE, FAST, RESTARTED
from replication.audit.report.evidence import checks, played
from replication.audit.report.templates import source
from replication.errors import InfeasibleError
from replication.estimation.dualrate.observers import Harmonic
from replication.estimation.dualrate.problem import DualRateDesign

ROOT = Path(__file__).parents[2]
LOOP = "certificates/shao/counterexample.json"
OBSERVERS = {"printed": APO, "restarted": RESTARTED, "fast": FAST}
SETTINGS = [
    {},
    {"M": 2},
    {"M": 20},
    {"T": 0.01, "M": 8},
    {"T": 0.178, "M": 12},
    {"K": -4.0, "L": 5.5},
    {"K": -1.5, "L": 1.1, "T": 0.05},
    {"K": -8.0, "L": 8.0, "T": 0.3, "M": 3},
    {"L": 0.5},
    {"K": -0.5},
    {"L": 1.0},
]
"""What the sliders are moved to, from the certified case; gains that the theorem does not allow among them."""
IN_NODE = """
const fs = require("fs"), vm = require("vm"), context = vm.createContext({});
vm.runInContext(fs.readFileSync(process.argv[1], "utf8"), context);
const { radius, condition, run } = context.dualRate, names = ["printed", "restarted", "fast"];
const said = (loop) => ({ condition: condition(loop), loops: Object.fromEntries(names.map((name) =>
  [name, { radius: radius(loop, name), x: run(loop, name, 4 * loop.M * loop.T) }])) });
process.stdout.write(JSON.stringify(JSON.parse(process.argv[2]).map(said)));
"""


def certified_loop() -> dict[str, Any]:
    loop: dict[str, Any] = json.loads(played(checks(certified(LOOP), ROOT))["shao"])
    return loop


def design(setting: Mapping[str, Any]) -> DualRateDesign:
    loop = certified_loop() | setting
    gains = {"feedback": np.array([[loop["K"]]]), "injection": np.array([[loop["L"]]])}
    return replace(COUNTEREXAMPLE, **gains, period=loop["T"], ratio=int(loop["M"]))


def test_the_sliders_start_at_the_certified_loop() -> None:
    assert certified_loop() == {"name": "play-shao", "a": 1, "b": 1, "c": 1, "K": -2, "L": 2, "T": 0.001, "M": 5}
    assert played(checks(certified(), ROOT)) == {}


@pytest.mark.skipif(not shutil.which("node"), reason="needs Node")
def test_condition_radius_and_course_are_those_of_the_paper_s_package(tmp_path: Path) -> None:
    (tmp_path / "play.js").write_text(source("play.js"), encoding="utf-8")
    loops = json.dumps([certified_loop() | setting for setting in SETTINGS])
    command = ["node", "-e", IN_NODE, str(tmp_path / "play.js"), loops]
    said = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    none = Harmonic(1.0, np.zeros(1))
    for setting, told in zip(SETTINGS, said, strict=True):
        made = design(setting)
        try:
            wanted = theorem_constants(made).condition
        except InfeasibleError:
            wanted = None
        assert told["condition"] == (wanted if wanted is None else pytest.approx(wanted, rel=1e-9)), setting
        for name, observer in OBSERVERS.items():
            found = told["loops"][name]
            assert found["radius"] == pytest.approx(radius(made, observer), rel=1e-9, abs=1e-12), (setting, name)
            trace = simulate(made, observer, none, np.ones(1), np.zeros(1), slow_periods=5, substeps=1)
            x = found["x"][: len(trace.output)]
            assert len(x) > 3 * made.ratio
            np.testing.assert_allclose(x, trace.output[: len(x)], rtol=1e-9, atol=1e-9)
    assert said[0]["condition"] < 1 < said[0]["loops"]["printed"]["radius"]


MOVE = """
  const [inputs, [at, value]] = [[...document.querySelectorAll(".play input")], arguments];
  inputs[at].value = value;
  inputs[at].dispatchEvent(new Event("input"));
  return document.querySelector(".play").innerText;
"""


@pytest.mark.browser
def test_titles_lamp_and_key_follow_the_sliders(browser: Any, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    data = json.dumps(certified_loop()).replace('"', "&quot;")
    page.write_text(
        f'<!DOCTYPE html><meta charset="utf-8"><div class="play" hidden role="group" data-play="{data}"></div>'
        f"<script>{source('play.js')}</script>",
        encoding="utf-8",
    )
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    browser.get(page.as_uri())
    begin = browser.find_element("css selector", ".play").text
    assert begin.startswith("Condition (18) is met, and the loop diverges all the same")
    assert browser.find_element("css selector", ".lamp").get_attribute("data-met") == "true"
    assert browser.execute_script(MOVE, 3, "6").startswith("The loop decays as printed; condition (18) is met")
    assert "is not Hurwitz" in browser.execute_script(MOVE, 2, "-0.5")
    slow = browser.execute_script(MOVE, 0, "45")
    assert "T = 0.178 s" in slow and "grows, ×" in slow
    browser.find_element("css selector", ".play button").click()
    assert browser.find_element("css selector", ".play").text == begin
    assert len(browser.find_elements("css selector", ".play path.line")) == len(OBSERVERS)
