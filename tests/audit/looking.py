"""What of the report a reader sees in the browser, and what is packed into it."""

from __future__ import annotations

import base64
import json
import re
import zlib

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
