"""The picture of the README: the answer as the report draws it, of a run whose sources were committed.

`make picture` takes it; Chromium and its driver must be on the path. The picture notes which commit and which verdicts
it shows, so that one that is out of date can be told.
"""

from __future__ import annotations

import hashlib
import io
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from replication.audit.project import find_project
from replication.audit.store.records import ResultsFile, read_results
from replication.errors import AuditError
from replication.files import write_atomically

if TYPE_CHECKING:
    from selenium import webdriver

WIDTH, HEIGHT = 1240, 2000
PART = "#rows"
"""The part of the report that is shown."""
STILL = """#rows { columns: 2; column-gap: 3rem; padding: 1rem 1.5rem 0; border: 0 }
#rows > .row { display: block; border: 0; break-inside: avoid; padding: .4rem 0 1rem }
.row a { text-decoration: none !important }
.row :is(.foot, .tally, .boxes + .hint), .row p:not(.who, .yl, .xl, .hint) { display: none }"""
"""Two columns; the sentences stand in the README."""
COMMIT, VERDICTS = "Commit", "Verdicts"
"""What the picture notes, as texts of the PNG."""
COLOURS = 64


def verdicts(results: ResultsFile) -> str:
    """A checksum of all claims with their verdicts."""
    lines = sorted(f"{claim.id} {claim.verdict}" for claim in results.claims)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def notes(results: ResultsFile) -> dict[str, str]:
    """What the picture is to note; raises AuditError for results of edited sources or with a changed verdict."""
    if results.run.dirty or not results.run.commit:
        raise AuditError("the results come from sources that are not committed; commit, then `make picture`")
    moved = [claim.id for claim in results.claims if claim.unexpected]
    if moved:
        raise AuditError(f"{len(moved)} verdicts are unexpected ({moved[0]}); settle them, then `make picture`")
    return {COMMIT: results.run.commit, VERDICTS: verdicts(results)}


def noted(picture: Path) -> dict[str, str]:
    """What a picture notes."""
    from PIL import Image

    with Image.open(picture) as image:
        return {name: str(image.info.get(name, "")) for name in (COMMIT, VERDICTS)}


def take(report: Path, results: ResultsFile, picture: Path) -> None:
    """Write the part of the report that shows the answer, in light colours, to `picture`."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    texts = PngInfo()
    for name, text in notes(results).items():
        texts.add_text(name, text)
    stream = io.BytesIO()
    with Image.open(io.BytesIO(_screenshot(report))) as image:
        image.convert("RGB").quantize(COLOURS).save(stream, "PNG", optimize=True, pnginfo=texts)
    write_atomically(picture, stream.getvalue())


def started() -> webdriver.Chrome:
    """Chromium without a window; raises AuditError if it or its driver is missing."""
    from selenium import webdriver

    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        raise AuditError("Chromium or its driver is missing; install both (Debian: chromium chromium-driver)")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"):
        options.add_argument(argument)
    return webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))


def _screenshot(report: Path) -> bytes:
    browser = started()
    try:
        size = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        scheme = [{"name": "prefers-color-scheme", "value": "light"}]
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": scheme})
        browser.get(report.resolve().as_uri())
        style = "document.head.append(Object.assign(document.createElement('style'), {textContent: arguments[0]}))"
        browser.execute_script(style, STILL)
        shown: bytes = browser.find_element("css selector", PART).screenshot_as_png
        return shown
    finally:
        browser.quit()


if __name__ == "__main__":
    root = find_project(Path.cwd()).root
    take(root / "report" / "index.html", read_results(root / "report" / "results.json"), root / "docs" / "answer.png")
