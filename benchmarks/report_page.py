"""How fast the report is in Chromium, as it is and with made-up claims beside its own.

    python benchmarks/report_page.py [TIMES ..]

Each claim of report/results.json stands so many times (1 and 10), under names of its own. Interactive is when the page
is painted and its script has run, counted from the request; a keystroke is from the event in the search field to the
next painted frame.
The bars are those of a quiet machine: half a second as it is, at ten times the claims three seconds, and a fifth of a
second for a keystroke. Exit code 1 if one is missed.
"""

import statistics
import sys
import tempfile
from pathlib import Path

import msgspec
from selenium import webdriver

from benchmarks.readme import started
from replication.audit.report.page import render
from replication.audit.store.records import ClaimRecord, ResultsFile, read_results

ROOT = Path(__file__).resolve().parents[1]
BARS = {1: 0.5, 10: 3.0}
"""Seconds until the page is interactive, by how many times the claims there are."""
KEYSTROKE = 0.2
QUERY = "stability of table 1"
LOADS = 5
READY = """
const done = arguments[0], entry = performance.getEntriesByType("navigation")[0];
const wait = () => {
  const paint = performance.getEntriesByName("first-contentful-paint")[0];
  if (paint && entry.loadEventEnd) done(Math.max(paint.startTime, entry.loadEventEnd) / 1000);
  else setTimeout(wait, 5);
};
wait();"""
TYPED = """
const [text, done] = arguments, field = document.querySelector(".find input");
const begin = performance.now();
field.value = text;
field.dispatchEvent(new Event("input", {bubbles: true}));
requestAnimationFrame(() => setTimeout(() => done((performance.now() - begin) / 1000)));"""


def multiplied(results: ResultsFile, times: int) -> ResultsFile:
    """The results with each claim `times` times, under names of their own."""
    more = [_again(record, copy) for copy in range(1, times) for record in results.claims]
    return msgspec.structs.replace(results, claims=(*results.claims, *more))


def _again(record: ClaimRecord, copy: int) -> ClaimRecord:
    claim = msgspec.structs.replace(record.claim, id=f"{record.claim.id}.again-{copy}")
    return msgspec.structs.replace(record, claim=claim)


def measured(browser: webdriver.Chrome, page: Path) -> tuple[float, float]:
    """Seconds until the page is interactive, the median of some loads, and of the slowest keystroke of a query."""
    loads, keys = [], []
    for _ in range(LOADS):
        browser.get("about:blank")
        browser.get(page.as_uri())
        loads.append(float(browser.execute_async_script(READY)))
    for end in range(1, len(QUERY) + 1):
        keys.append(float(browser.execute_async_script(TYPED, QUERY[:end])))
    return statistics.median(loads), max(keys)


def main() -> int:
    """Measure the page at each number of claims, print a line for each, and say whether a bar is missed."""
    results = read_results(ROOT / "report" / "results.json")
    missed = False
    with tempfile.TemporaryDirectory() as folder, started() as browser:
        for times in map(int, sys.argv[1:] or BARS):
            made = multiplied(results, times)
            page = Path(folder) / f"times-{times}.html"
            page.write_text(render(made, ROOT / "figures"), encoding="utf-8")
            ready, key = measured(browser, page)
            missed |= ready > BARS.get(times, float("inf")) or key > KEYSTROKE
            size = page.stat().st_size / 1e6
            print(f"{len(made.claims):5} claims, {size:.2f} MB: interactive {ready:.2f} s, keystroke {key:.3f} s")
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
