"""axe-core in a page that is open: violations, and the contrast of text on which axe could not decide."""

from __future__ import annotations

from pathlib import Path
from typing import Any

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
