"""What a reader sees of a page in the browser, what is packed into the report, and violations that axe-core finds."""

import base64
import json
import re
import zlib
from pathlib import Path
from typing import Any

from sample import KEY
from selenium import webdriver

from replication.audit.report.claim import anchor


def evidence(page: str) -> dict[str, str]:
    """The evidence that is packed into a page, as HTML by the id of its claim or experiment."""
    found = re.search(r'<script type="text/plain" id="evidence">([A-Za-z0-9+/=]*)</script>', page)
    assert found is not None
    unpacked: dict[str, str] = json.loads(zlib.decompress(base64.b64decode(found[1])))
    return unpacked


def claim_id(name: str) -> str:
    return anchor("claim", f"{KEY}.{name}")


def shown(browser: webdriver.Chrome) -> list[str]:
    """The ids of the claims that are on the page that is open, in their order, also those in a fold."""
    seen = "return [...document.querySelectorAll('.claim')].filter((e) => e.checkVisibility()).map((e) => e.id)"
    found: list[str] = browser.execute_script(seen)
    return found


def resize(browser: webdriver.Chrome, width: int) -> None:
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)


def unfold(browser: webdriver.Chrome) -> webdriver.Chrome:
    """Open all pages and folds, and wait until all evidence is drawn and what scrolls has its stop."""
    browser.execute_async_script("""const done = arguments[0];
      document.querySelectorAll('.view').forEach((e) => {
        e.removeAttribute('hidden');
        e.style.contentVisibility = 'visible';  // laid out as if it were seen
      });
      document.querySelectorAll('details').forEach((e) => { e.open = true; });
      const frame = () => requestAnimationFrame(() => requestAnimationFrame(done));
      const open = () => document.querySelector('.claim > .evidence:not([data-drawn])');
      const wait = () => open() ? setTimeout(wait, 10) : frame();
      wait();""")
    return browser


_OVERLAPS = """
  const boxes = [];
  const walk = document.createTreeWalker(document.querySelector('main'), NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const text = walk.currentNode.data.trim(), host = walk.currentNode.parentElement;
    // Drawings and formulas are set by rules of their own; an index stands as near to its letter as it must.
    if (!text || !host.checkVisibility() || host.closest('svg, math, sub, sup, .unseen')) continue;
    const range = document.createRange();
    range.selectNodeContents(walk.currentNode);
    for (const box of range.getClientRects()) if (box.width > 1) boxes.push([box, text.slice(0, 40)]);
  }
  boxes.sort(([a], [b]) => a.top - b.top);
  return boxes.flatMap(([a, one], i) => {
    const found = [];
    for (let j = i + 1; j < boxes.length && boxes[j][0].top < a.bottom - 4; j++) {
      const [b, other] = boxes[j];
      if (a.left < b.right - 2 && b.left < a.right - 2) found.push([one, other]);
    }
    return found;
  });"""


def overlaps(browser: webdriver.Chrome) -> list[list[str]]:
    """Texts of the page that is open which lie over each other."""
    found: list[list[str]] = browser.execute_script(_OVERLAPS)
    return found


def pages_of(browser: webdriver.Chrome) -> int:
    """On how many sheets of paper the page that is open stands."""
    options = {"preferCSSPageSize": True, "printBackground": True}
    paper = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", options)["data"])
    return len(re.findall(rb"/Type\s*/Page\b", paper))


AXE = (Path(__file__).parent / "axe" / "axe.min.js").read_text(encoding="utf-8")
SMALLEST_CONTRAST = 4.5

_RUN = """const done = arguments[1];
axe.run(arguments[0] || document, {resultTypes: ["violations", "incomplete"]}).then(({violations, incomplete}) => {
  const found = violations.flatMap((rule) => rule.nodes.map((node) => [rule.id, node.html.slice(0, 120)]));
  const open = incomplete.filter((rule) => rule.id === "color-contrast").flatMap((rule) => rule.nodes);
  done([found, open.map((node) => node.target.at(-1))]);
}, (error) => done([[["axe", String(error)]], []]));"""

_FAINT = """const [targets, least] = arguments;
const canvas = document.createElement("canvas").getContext("2d", {willReadFrequently: true});
const parse = (colour) => {
  canvas.clearRect(0, 0, 1, 1);
  canvas.fillStyle = colour;
  canvas.fillRect(0, 0, 1, 1);
  const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
  return [r, g, b, a / 255];
};
const linear = (c) => c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4;
const luminance = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
const over = ([r, g, b, a], under) => [r, g, b].map((c, i) => a * c + (1 - a) * under[i]);
const paper = (element) => {
  if (!element) return parse("Canvas").slice(0, 3);
  const own = parse(getComputedStyle(element).backgroundColor);
  return own[3] === 1 ? own.slice(0, 3) : over(own, paper(element.parentElement));
};
const faint = [];
for (const target of targets) for (const element of document.querySelectorAll(target)) {
  const style = getComputedStyle(element), under = paper(element);
  const ink = over(parse(element instanceof SVGElement ? style.fill : style.color), under);
  const [low, high] = [luminance(ink), luminance(under)].sort((one, other) => one - other);
  const contrast = (high + 0.05) / (low + 0.05);
  if (contrast < least) faint.push(["contrast", `${contrast.toFixed(2)} ${element.outerHTML.slice(0, 100)}`]);
}
return faint;"""


def violations(page: Any, context: str | None = None) -> list[tuple[str, str]]:
    """Rule and element of each violation in the page that is open, or in the part of it that `context` selects.

    Where axe cannot say what is behind a text, its contrast with the nearest background is computed here.
    """
    if not page.execute_script("return 'axe' in window"):
        page.execute_script(AXE)
    found, undecided = page.execute_async_script(_RUN, context)
    return [(rule, html) for rule, html in [*found, *page.execute_script(_FAINT, undecided, SMALLEST_CONTRAST)]]
