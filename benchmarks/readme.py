"""Examples of the documentation, run for the pages that show them; and what the README shows: the results of a run with
badges, an example, and a picture of the answer; and the published schema of the results.

`python -m benchmarks.readme` writes all but the picture of the answer, which `picture` takes.
"""

from __future__ import annotations

import ast
import contextlib
import hashlib
import io
import json
import re
import runpy
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from replication.audit.inspect.headline import theorems
from replication.audit.judge.policies import once
from replication.audit.project import find_project
from replication.audit.publish.archive import badges
from replication.audit.report.claim import standing
from replication.audit.report.told import BriefView, briefs
from replication.audit.store.records import PaperRecord, ResultsFile, read_results
from replication.drawing.panels import as_svg
from replication.errors import AuditError
from replication.files import write_atomically

if TYPE_CHECKING:
    from selenium import webdriver

FIGURE = "figure"
"""The variable in which an example leaves its picture, if it has one."""


@dataclass(frozen=True)
class Ran:
    """An example that was run.

    caption: first line of its docstring. code: without the docstring. drawing: stand-alone SVG, or nothing.
    """

    name: str
    caption: str
    code: str
    output: str
    drawing: str


def run_example(path: Path) -> Ran:
    """Run the script at `path`; raises AuditError that names it if it fails or says nothing of itself."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    said = ast.get_docstring(tree)
    if not said:
        raise AuditError(f"{path} has no docstring; its first line is the caption of what it draws")
    printed = io.StringIO()
    try:
        with contextlib.redirect_stdout(printed):
            names = runpy.run_path(str(path))
    except Exception as error:  # whatever an example raises
        raise AuditError(f"{path}: {type(error).__name__}: {error}; run it by itself and correct it") from error
    code = "\n".join(text.splitlines()[tree.body[0].end_lineno :]).strip()
    figure = names.get(FIGURE)
    drawing = "" if figure is None else as_svg(figure, path.stem)
    return Ran(path.stem, said.splitlines()[0], code, printed.getvalue().rstrip(), drawing)


BEGIN, END = "<!-- results: begin, written by `make readme` -->", "<!-- results: end -->"
BADGES = "docs/badges"


def results_block(results: ResultsFile) -> str:
    """Markdown: how many claims are proved, and of each paper its badge, its result and what explains it."""
    papers, told = {paper.key: paper for paper in results.papers}, briefs(results)
    said = {name: re.findall(r"<title>(.*?)</title>", svg) for name, svg in badges(results, BADGES, "claims").items()}
    image = {Path(name).stem: f"![{title}]({name})" for name, (title,) in said.items()}
    order = sorted(papers, key=lambda key: standing(c for c in results.claims if c.paper == key).rank)
    lines = [f"- **{papers[key].cited}** {image[key]} {_line(papers[key], told.get(key))}" for key in order]
    return "\n".join([BEGIN, "", *lines, "", f"{image['all']} {theorems(once(results.claims))}".strip(), "", END])


def _line(paper: PaperRecord, told: BriefView | None) -> str:
    """What the opening of the report says of the paper, without its links."""
    if told is None:
        return paper.findings[0] if paper.findings else ""
    return f"{told.headline.text}." if told.headline.text else told.card.text


def replace_block(text: str, block: str, begin: str = BEGIN, end: str = END) -> str:
    """`text` with the part between the markers replaced; raises AuditError if the markers are not there once each."""
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise AuditError(f"the README must hold the lines {begin!r} and {end!r} once each, in this order")
    return text[: text.index(begin)] + block + text[text.index(end) + len(end) :]


EXAMPLE_BEGIN, EXAMPLE_END = "<!-- example: begin, written by `make readme` -->", "<!-- example: end -->"
EXAMPLE = "docs/examples/multirate_cart.py"
DRAWN = "docs/pictures/multirate_cart.py"
"""What draws the picture beside the example."""
PICTURE = "docs/example.svg"
SHOWN_WIDTH = 300


SCHEMA = "docs/results.schema.json"


def schema_text() -> str:
    """The JSON Schema (2020-12) of results.json, in which all fields are there, with one newline at the end."""
    schema = msgspec.json.schema(ResultsFile)
    for definition in schema["$defs"].values():
        if "properties" in definition:
            definition |= {"required": list(definition["properties"]), "additionalProperties": False}
    whole = {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
    return json.dumps(whole, indent=2, ensure_ascii=False) + "\n"


def example_block(ran: Ran, drawn: Ran) -> str:
    """Markdown: code and output of an example, and a picture, which leads to what drew it."""
    picture = f'<img align="right" src="{PICTURE}" width="{SHOWN_WIDTH}" alt="{drawn.caption}">'
    picture = f'<a href="{DRAWN}">{picture}</a>'
    lines = ["```python", ran.code, "```", "", picture, "", "```text", ran.output, "```"]
    return "\n".join([EXAMPLE_BEGIN, "", *lines, "", EXAMPLE_END])


def update(root: Path, results: ResultsFile, ran: Ran, drawn: Ran) -> None:
    """Write the results of a run, an example with its picture, and the schema into the project at `root`."""
    readme = root / "README.md"
    text = replace_block(readme.read_text(encoding="utf-8"), results_block(results))
    text = replace_block(text, example_block(ran, drawn), EXAMPLE_BEGIN, EXAMPLE_END)
    written = {**badges(results, BADGES, "claims"), PICTURE: drawn.drawing, SCHEMA: schema_text()}
    for name, content in {**written, "README.md": text}.items():
        write_atomically(root / name, content.encode())


# The picture of the README: the answer as the report draws it, of a run whose sources were committed.
#
# `make picture` takes it; Chromium and its driver must be on the path. The picture notes which commit and which
# verdicts it shows, so that one that is out of date can be told.


WIDTH, HEIGHT = 1240, 1600
PART = "#rows"
"""The part of the report that is shown."""
STILL = """#rows { padding: .5rem 1.5rem; border: 0 }
.row a { text-decoration: none !important }
.traces .frame { height: 7rem !important }
.row :is(.foot, .proof, .boxes + .hint), .row > :first-child > p:not(.who) { display: none }"""
"""Without what a picture cannot do; the sentences stand in the README."""
COMMIT, VERDICTS = "Commit", "Verdicts"
"""What the picture notes, as texts of the PNG."""
COLOURS = 192


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
    now = read_results(root / "report" / "results.json")
    if sys.argv[1:] == ["picture"]:
        take(root / "report" / "index.html", now, root / "docs" / "answer.png")
    else:
        update(root, now, run_example(root / EXAMPLE), run_example(root / DRAWN))
