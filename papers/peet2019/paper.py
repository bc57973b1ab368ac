"""The audit of Peet and Gu (2019): what it is about, its tables and formulas, and what leads its page."""

import math
from typing import Any

from papers._common import POSITION, Told, common_levels, curve, dots, label, parts_of, signal
from papers.peet2019.claims import cost, examples, gains, theory
from papers.peet2019.errata import PROOFS
from papers.peet2019.experiments.declared import EXPERIMENTS, MOVED
from papers.peet2019.experiments.examples import LATE
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
    first=cost.FROM_PRODUCT,
)


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


def facts(results: Results) -> dict[str, Any]:
    """The numbers of the sentences that lead the page."""
    roots = [results["roots"]["roots"][f"{JORDAN[name]:g}"] for name in ("jordan-one", "jordan-negative")]
    levels = {e: results[f"sos.ex{e}.d3"]["tensor"]["gamma"] for e in EXAMPLES}
    return {
        "groups": len(theory.GROUPS),
        "of_our_copy": len(theory.OF_OUR_COPY),
        "worst": at_most(max(abs(level / gains.optimum_of(e, results) - 1.0) for e, level in levels.items()), 1),
        "wide": len(gains.conservative(results)) or "no",
        "misses": len(gains.missed(results)),
        "rules": len(RULES),
        "alone": at_most(100 * max(gains.lumped_errors("alone", results).values())),
        "lumped": 100 * max(map(abs, gains.lumped_errors("relative", results).values())),
        "one": JORDAN["jordan-one"],
        "negative": -JORDAN["jordan-negative"],
        "stable": [
            "stable" if ends["largest"] < 0.0 else "unstable" if ends["smallest"] > 0.0 else "unstable for some K"
            for ends in roots
        ],
        "ratio": at_most(cost.largest_ratio(cost.printed_seconds()), 3),
    }


PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(*parts_of(theory, gains, examples, cost)),
    experiments=EXPERIMENTS,
    errata=TOLD.errata(PROOFS),
    figures=TOLD.figures(FIGURES),
    findings=TOLD.findings(facts),
    brief=BRIEF,
    common=lambda results: common_levels(LATE, results["common"], f"L2 {POSITION}"),
    sensitivity=lambda results: tuple(
        move for example in MOVED for move in sensitivities(results[f"sensitivity.ex{example}"])
    ),
)
