"""A number on the page that the results do not hold stops the build."""

from __future__ import annotations

import shutil
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from sample import results

from replication.audit.report import sections, templates
from replication.audit.report.guard import numbers_of, require_sourced
from replication.audit.report.page import build_report
from replication.audit.store.records import ResultsFile
from replication.errors import AuditError

SOURCE: dict[str, Any] = {
    "places": ["Table 1, column (2,3)", "2024-02-29T12:00:00Z", "version 1.17.1"],
    "numbers": (0.63204, -1.7771, 3.7e-10, 73, 12345.6),
}


@pytest.fixture(scope="module")
def figures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("figures")


@pytest.fixture(scope="module")
def made(figures: Path) -> ResultsFile:
    return results(figures)


def sources_copied_to(directory: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the report's templates that is used from now on."""
    files = shutil.ignore_patterns("index.html", "results.json", "*-*")
    copied = shutil.copytree(templates.SOURCES, directory / "html", ignore=files)
    monkeypatch.setattr(templates, "SOURCES", copied)
    return copied


def shows(text: str) -> bool:
    try:
        require_sourced({"": text}, SOURCE)
    except AuditError:
        return False
    return True


@pytest.mark.parametrize(
    "text",
    [
        "<p>none</p>",
        "<p>0.63, 0.6320 and .63204</p>",
        "<p>−1.777 of 73</p>",
        "<p>3.7×10⁻¹⁰, and 4×10⁻¹⁰</p>",
        "<p>12346</p>",
        "<p>Table 1 of 2024-02-29, version 1.17.1</p>",
        '<p><span class="agreed">1.77</span><span class="off">7</span><span class="tail">1</span></p>',
        "<p>1.78</p><p>0.63</p>",
        "<p>N₁, H2 and x_17 are names</p>",
        "<code>9f8e 123456</code><pre>4711</pre><svg><text>4711</text></svg><script>4711</script><style>4711</style>",
        "<p>a&nbsp;&lt;&nbsp;0.632</p>",
        """<meta http-equiv="Content-Security-Policy" content="script-src 'sha256-4711/4711='">""",
    ],
)
def test_numbers_of_the_results_may_stand_on_the_page(text: str) -> None:
    assert shows(text)


@pytest.mark.parametrize(
    "text",
    [
        "<p>0.64</p>",
        "<p>0.631</p>",
        "<p>74 of 73</p>",
        "<p>12345</p>",
        "<p>about 4711 of them</p>",
        "<p>3.8×10⁻¹⁰</p>",
        "<p>below 10⁻⁹</p>",
        "<p>1.79s</p>",
        "<p>Table 5</p>",
        '<p><span class="agreed">1.77</span><span class="off">8</span></p>',
        '<figure aria-label="peaks at 4.5"></figure>',
        '<meta name="description" content="4711 of them">',
        "<svg><text>4711</text></svg><p>4711</p>",
        "<p>1&#46;9</p>",
    ],
)
def test_any_other_number_is_found(text: str) -> None:
    assert not shows(text)


def test_error_says_which_number_and_where() -> None:
    with pytest.raises(AuditError, match=r"'0\.64' in 'the level is 0\.64 here'.*take it from the results"):
        require_sourced({"": "<p>the level is 0.64 here</p>"}, SOURCE)


def test_texts_count_in_the_results_only() -> None:
    require_sourced({"": "<p>0.64</p>"}, SOURCE, {"derived": (Fraction(16, 25),)})
    with pytest.raises(AuditError, match=r"0\.64"):
        require_sourced({"": "<p>0.64</p>"}, SOURCE, {"sentence": "the level is 0.64"})


def test_an_exact_number_is_no_text_with_words() -> None:
    with pytest.raises(AuditError, match="4711"):
        require_sourced({"": "<p>4711</p>"}, {"intervals": (("4711/200", "5000/200"),)})


def test_numbers_are_found_at_any_depth(made: ResultsFile) -> None:
    found = list(numbers_of({"results": [made]}))
    assert made.claims[0].evidence.value in found
    assert made.experiments[0].inputs["tolerance"] in found
    assert not [number for number in found if isinstance(number, bool)]


def test_a_number_typed_into_a_template_stops_the_build(
    made: ResultsFile, figures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copied = sources_copied_to(tmp_path, monkeypatch)
    assert build_report(made, figures, tmp_path / "index.html").is_file()
    words = copied / "words.html.j2"
    words.write_text(words.read_text() + "<p>They were judged within 4711 seconds.</p>\n")
    with pytest.raises(AuditError, match="within 4711 seconds"):
        build_report(made, figures, tmp_path / "other.html")
    assert not (tmp_path / "other.html").exists()


def test_what_a_section_derives_is_handed_over_as_a_number(
    made: ResultsFile, figures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (sources_copied_to(tmp_path, monkeypatch) / "cite.html.j2").write_text("<p>{{ shown.text }}</p>\n")

    def shown(content: dict[str, Any]) -> None:
        monkeypatch.setattr(sections, "_SECTIONS", (("cite", "Derived", lambda results, read: content),))

    shown({"text": "0.4711"})
    with pytest.raises(AuditError, match=r"0\.4711"):
        build_report(made, figures, tmp_path / "index.html")
    shown({"text": "0.4711", "number": 0.4711})
    assert build_report(made, figures, tmp_path / "index.html").is_file()
