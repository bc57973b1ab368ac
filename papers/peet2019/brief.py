"""What leads the report on this paper."""

from __future__ import annotations

import math

from papers._sketch import curve, dots, label, signal
from papers.peet2019.printed import COLUMNS, EXAMPLES
from replication.audit.brief import Brief, Curve, Draws, Entries, Explorer, Picture, Sketch, Stroke

PAST, NOW = 164, 268


def _estimate(x: float) -> float:
    """The estimate of the history, which errs most in its middle."""
    return signal(x) + 8 * math.sin(math.pi * (x - PAST) / (NOW - PAST))


BRIEF = Brief(
    topic="A state with memory",
    card="Theorems [3](-theory.theorem-3) and [4](-theory.theorem-4) hold once signs and factors are corrected. "
    "Degree-one gains of [Example 2](?ex2.gamma-d1) and [Example 3](?ex3.gamma-d1) need their own ε.",
    holds="All Padé gains ([Example 1](ex1.gamma-pade), [2](ex2.gamma-pade), [3](ex3.gamma-pade)), and every gain of "
    "[Example 1](ex1.gamma-d3) once Theorem 3 is corrected.",
    correct="[Theorem 1](theory.theorem-1) needs 𝒫 = 𝒫*, [Theorem 3](theory.theorem-3) other signs, and "
    "[Theorem 4](theory.theorem-4) other factors.",
    guess="What [a degree counts](ex2.gamma-d3); which ε gives the [gains of degree one](ex2.gamma-d1); the eigenvalue "
    "in [Example 4](ex4.unstable); how exact [twenty lumped states](observer.lumped-states) must be.",
    verdict="holds once corrected",
    headline="Theorems 1, 3 and 4 need corrected [signs](-theory.theorem-3) and [factors](-theory.theorem-4); "
    "degree-one "
    "gains of [Example 2](?ex2.gamma-d1) and [Example 3](?ex3.gamma-d1) need their own ε",
    picture=Entries(
        columns=("degree 1", "degree 2", "degree 3", "Padé"),
        rows=tuple((f"Example {e}", tuple(f"ex{e}.gamma-{column}" for column in COLUMNS)) for e in EXAMPLES),
    ),
    sketch=Sketch(
        alt="The observer estimates the present state and its history over the delay.",
        strokes=(
            Stroke(draws=Draws.BAND, points=((PAST, 8), (NOW, 8), (NOW, 124), (PAST, 124))),
            curve(Draws.TRUTH),
            curve(Draws.ESTIMATE, _estimate, PAST, NOW),
            dots(Draws.MEASURED, [NOW]),
            label("history", 192, 22),
            label("estimate", 96, 116, Draws.LABEL_OURS),
            label("now", 276, 96, Draws.LABEL_OURS),
            label("delay τ", 192, 142),
        ),
    ),
    explorers=(
        Explorer(
            title="In Example 2 delays above half a second cost accuracy that no observer regains",
            text="First: the delay of Example 2 grows; the least gain stays level at first. Second: how far a design "
            "is from the least gain, as the degree, counted in each variable, or the number of states grows.",
            pictures=(
                Picture(
                    label="delay",
                    figure="peet2019-tau",
                    across="tau",
                    x="delay τ (s)",
                    y="gain",
                    begin=1.0,
                    curves=(
                        Curve(label="Theorem 3, our design", columns=("sos",)),
                        Curve(label="least gain, lumped", columns=("chebyshev",), quiet=True),
                    ),
                ),
                Picture(
                    label="degree",
                    figure="peet2019-convergence",
                    across="order",
                    x="degree, or lumped states",
                    y="relative distance",
                    begin=2.0,
                    log_y=True,
                    curves=(
                        Curve(label="Theorem 3", columns=("sos",)),
                        Curve(label="Padé", columns=("pade",), quiet=True),
                        Curve(label="Chebyshev", columns=("chebyshev",), quiet=True),
                    ),
                ),
            ),
        ),
    ),
)
