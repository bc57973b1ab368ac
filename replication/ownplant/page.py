"""One self-contained HTML page on a design: what it guarantees, how that is known, its gains, its figure."""

from __future__ import annotations

from html import escape

import numpy as np

from replication.estimation.api.results import GainResult
from replication.estimation.validation import Array

STYLE = """
body { font: 1rem/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #1c1f23;
       background: #fff }
table { border-collapse: collapse; margin: 1rem 0; display: block; overflow-x: auto }
th, td { text-align: left; padding: .25rem .75rem .25rem 0; vertical-align: top; border-bottom: 1px solid #ccc }
th { font-weight: 600 } caption { text-align: left; font-weight: 600 }
code, pre { font-family: ui-monospace, monospace; overflow-x: auto } figure { margin: 1rem 0 } svg { max-width: 100% }
"""
MAX_PRINTED = 60
"""Gains of more numbers than this are in the files only."""


def page(title: str, result: GainResult, figure: str, call: str, files: tuple[str, ...]) -> str:
    """The page; figure: an SVG element, call: the command line that made it, files: what lies beside the page."""
    drawing = figure.replace("<svg ", f'<svg role="img" aria-label="{escape(_alt(result))}" ', 1)
    names = "".join(
        f'<tr><th scope="row">{kind}</th><td>{escape(", ".join(labels))}</td></tr>\n'
        for kind, labels in result.signals.to_dict().items()
        if isinstance(labels, list) and labels
    )
    links = ", ".join(f'<a href="{escape(name)}">{escape(name)}</a>' for name in files)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}: {result.method} estimator</title>
<style>{STYLE}</style>
</head>
<body>
<main>
<h1>{escape(title)}: {result.method} estimator</h1>
{result._repr_html_()}
<figure>
{drawing}<figcaption>{escape(_alt(result))}</figcaption>
</figure>
<h2>Signals</h2>
<table><tbody>
{names}</tbody></table>
<h2>Gains</h2>
{"".join(_gain(name, result.axes[name], gain) for name, gain in result.gains.items())}
<h2>Files</h2>
<p>{links}. All numbers there are in full precision; those on this page are rounded.</p>
<h2>Made by</h2>
<pre><code>{escape(call)}</code></pre>
</main>
</body>
</html>
"""


def _alt(result: GainResult) -> str:
    (panel,) = result.panels()
    return f"{panel.y_label} over {panel.x_label}; {', '.join(f'{name} {v:.4g}' for name, v in panel.levels.items())}"


def _gain(name: str, axes: str, gain: Array) -> str:
    heading = f"<h3>{escape(name)} {escape(axes)}, shape {gain.shape}</h3>\n"
    if gain.size > MAX_PRINTED:
        return f"{heading}<p>{gain.size} numbers, in the files.</p>\n"
    with np.printoptions(precision=6, linewidth=95, suppress=False):
        return f"{heading}<pre>{escape(str(gain))}</pre>\n"
