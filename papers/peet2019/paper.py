"""The audit of Peet and Gu (2019): what it is about, its tables and formulas, and what leads its page."""

from __future__ import annotations

import math

from papers._common import MULTIPLES, Told, curve, dots, label, signal
from papers.peet2019 import common
from papers.peet2019.claims.cost import EXAMPLE_4, FROM_PRODUCT, largest_ratio, printed_seconds
from papers.peet2019.claims.examples import COMPARISON, EXAMPLES_1_TO_3, FIG_1
from papers.peet2019.claims.gains import (
    CLOSED_LOOPS,
    IMPLEMENTATION,
    conservative,
    followed,
    lumped_error,
    missed,
    optimum_of,
)
from papers.peet2019.claims.theory import (
    COROLLARY_2,
    FRAME,
    GROUPS,
    INTRODUCTION,
    OF_OUR_COPY,
    THEOREM_1,
    THEOREM_3,
    THEOREM_4,
)
from papers.peet2019.errata import PROOFS
from papers.peet2019.experiments.declared import EXPERIMENTS, MOVED
from papers.peet2019.experiments.readings import READINGS as RULES
from papers.peet2019.figures import FIGURES
from papers.peet2019.printed import ACCURATE, COLUMNS, DATA, EXAMPLES, JORDAN, MEMORY, SAME
from replication.audit.brief import Draws, Entries, Sketch, Stroke
from replication.audit.declare import paper
from replication.audit.judge.numerals import at_most
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Results
from replication.audit.project import about

PAST, NOW = 164, 268
TOLD = Told.read(
    __file__,
    **ACCURATE,
    **JORDAN,
    **dict(zip(("near", "far"), SAME.values(), strict=True)),
    order=DATA["pade-order"],
    memory=MEMORY,
    largest=DATA["largest-product"],
    first=FROM_PRODUCT,
)
ERRATA = TOLD.errata(PROOFS)


def _estimate(x: float) -> float:
    """The estimate of the history, which errs most in its middle."""
    return signal(x) + 8 * math.sin(math.pi * (x - PAST) / (NOW - PAST))


BRIEF = TOLD.brief(
    picture=Entries(
        columns=("degree 1", "degree 2", "degree 3", "Padé"),
        rows=tuple((f"Example {e}", tuple(f"ex{e}.gamma-{column}" for column in COLUMNS)) for e in EXAMPLES),
        text="Least gain bound γ by polynomial degree, which we count per variable. Padé: the paper's comparison.",
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
)


def findings(results: Results) -> tuple[str, ...]:
    """The sentences that lead the page of this paper."""
    worst = max(abs(results[f"sos.ex{e}.d3"]["tensor"]["gamma"] / optimum_of(e, results) - 1.0) for e in EXAMPLES)
    ratio = largest_ratio(printed_seconds())
    one, negative = (results["roots"]["roots"][f"{JORDAN[name]:g}"] for name in ("jordan-one", "jordan-negative"))
    wide, misses = len(conservative(results)), missed(results)
    lumped = max(abs(lumped_error(example, results)) for example in EXAMPLES)
    alone = 100 * max(followed(example, results) for example in EXAMPLES)
    words = [
        "stable" if ends["largest"] < 0.0 else "unstable" if ends["smallest"] > 0.0 else "unstable for some K"
        for ends in (one, negative)
    ]
    return (
        "If Corollary 2 holds, nothing satisfies the conditions of Theorem 3 as printed: the sign of Sᵢ(−τᵢ) in D "
        "alone excludes every ε.",
        f"The identity behind Theorem 3 needs {len(GROUPS)} groups of corrections, the signs among them; "
        f"{len(OF_OUR_COPY)} may be slips of our copy.",
        "Once corrected, Theorem 3 passes every test: its identity is proved, and each closed loop tried keeps its "
        "level.",
        "Theorem 1 asks for a bounded 𝒵. That of Theorem 3 evaluates histories at −τᵢ, so it is unbounded unless Z₂ᵢ "
        "and Z₅ᵢⱼ vanish.",
        "Theorem 4 asks for 𝒫: X → X, which Theorem 3 does not give; its formulas, once corrected, give an inverse "
        "without that assumption.",
        f"Degree three is within the fraction {at_most(worst, 1)} of each optimum if it counts in each variable; "
        f"{wide or 'no'} other rules miss some printed digit.",
        f"From degree two on, {len(misses)} of {len(RULES)} degree rules miss some printed level of Examples 2 and 3; "
        "so these stay possible, not reproduced.",
        "Under no degree rule tried does the degree-one level of Example 2 or of Example 3 agree; a fitted ε proves "
        "nothing.",
        "If the observer alone is lumped, each delay in twenty states, its error along the plants' unstable motion is "
        f"at most {at_most(alone)} % of z.",
        f"If plant and observer are lumped, H∞ norms move by up to {100 * lumped:.1f} %, by the error of the lumped "
        "plant.",
        "The text calls Example 4 unstable but leaves out the eigenvalue of J: "
        f"with {JORDAN['jordan-one']:g} it is {words[0]}, with −{-JORDAN['jordan-negative']:g} {words[1]}.",
        f"At equal n·K printed seconds differ by a factor below {at_most(ratio, 3)}.",
    )


PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(
        FRAME, INTRODUCTION, THEOREM_1, COROLLARY_2, THEOREM_3, THEOREM_4, IMPLEMENTATION, COMPARISON, CLOSED_LOOPS,
        EXAMPLES_1_TO_3, FIG_1, EXAMPLE_4,
    ),
    experiments=EXPERIMENTS,
    errata=ERRATA,
    figures=TOLD.figures(FIGURES),
    findings=findings,
    brief=BRIEF,
    common=lambda results: common.common(results["common"], list(MULTIPLES)),
    sensitivity=lambda results: tuple(
        move for example in MOVED for move in sensitivities(results[f"sensitivity.ex{example}"])
    ),
)  # fmt: skip
