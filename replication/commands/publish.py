"""`replication report`, `notebooks`, `export`, `artifact`: what is written of results for readers."""

import argparse
from pathlib import Path

from replication.commands import (
    DIFFERENT,
    FINE,
    command,
    figures,
    option,
    output,
    project_root,
    results_of,
    results_path,
    say,
    say_report,
)


@command(
    "report",
    "build index.html from results.json, without computing anything",
    output("where results.json is and index.html goes"),
    figures("where the SVG and CSV files are"),
)
def report(chosen: argparse.Namespace) -> int:
    """Write index.html beside results.json."""
    page = results_path(chosen).with_name("index.html")
    say_report(results_of(chosen), chosen.figures or project_root() / "figures", page)
    return FINE


@command(
    "notebooks",
    "execute the tutorial notebooks and write them as pages that load nothing",
    option("names", nargs="*", metavar="NAME", help="notebooks in docs/notebooks (default: all)"),
    option("--to", type=Path, metavar="DIR", help="where the pages go (default: report/notebooks/)"),
)
def notebooks(chosen: argparse.Namespace) -> int:
    """Write the pages and say which notebooks had to be executed."""
    from replication.audit.publish.notebooks import build_notebooks

    root = project_root()
    for page, fresh in build_notebooks(root, chosen.to or root / "report" / "notebooks", chosen.names):
        say([f"{'executed' if fresh else 'unchanged'}: {page}"])
    return FINE


@command(
    "export",
    "write badges, JSON-LD, metadata for CODECHECK and Zenodo, and BibTeX from results.json",
    output("where results.json is"),
    option("--to", type=Path, metavar="DIR", help="where the files go (default: exports/ beside it)"),
)
def export(chosen: argparse.Namespace) -> int:
    """Write the exports, and what registers read at the root of the project, and name them."""
    from replication.audit.publish.archive import write_exports
    from replication.audit.publish.linked_data import read_software
    from replication.audit.publish.registers import write_registers

    results, root = results_of(chosen), project_root()
    say(map(str, write_exports(results, root, chosen.to or results_path(chosen).with_name("exports"))))
    say(write_registers(results, read_software(root), root))
    return FINE


def places(parser: argparse.ArgumentParser) -> None:
    """Add where the archive goes, or lies unpacked."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--to", type=Path, metavar="FILE", help="the zip (default: dist/ of the project)")
    group.add_argument("--check", type=Path, metavar="DIR", help="compare an unpacked archive with its checksums")


@command(
    "artifact",
    "pack sources, results, figures, report, this program and the way to rebuild into one zip with checksums",
    places,
    notes="""\
The same commit and results give the same bytes. Unpacked, the archive is a project again, which its REBUILD.md
rebuilds beside nothing but Python.

""",
)
def artifact(chosen: argparse.Namespace) -> int:
    """Write the archive, or name the files of an unpacked one that are not what they were."""
    from replication.audit.publish.archive import archive_name, changed_files, unfilled, write_archive

    if chosen.check is not None:
        changed = changed_files(chosen.check)
        say([*changed, f"{len(changed)} files changed"])
        return DIFFERENT if changed else FINE
    root = project_root()
    path = chosen.to or root / "dist" / archive_name(root)
    say([f"{path}: {write_archive(root, path)} files", *(f"note: {left}" for left in unfilled(root))])
    return FINE
