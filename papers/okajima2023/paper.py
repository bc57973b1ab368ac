"""The audit of Okajima, Hosoe and Hagiwara (2023): parts, tables, formulas and what the paper is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any

from papers._common import FIRST, LAST, MINCX, POSITION, Told, common_levels, curve, dots, label, signal
from papers.okajima2023.claims import blog, levels, simulation, theorems, unstable
from papers.okajima2023.claims.levels import counterexamples
from papers.okajima2023.claims.simulation import AS_PRINTED, G_SIM, all_draws
from papers.okajima2023.errata import PROOFS
from papers.okajima2023.experiments.declared import (
    DIAGONAL_STEP,
    EXPERIMENTS,
    SECOND_DECIMALS,
    all_periods,
    pair,
    table_claim,
)
from papers.okajima2023.experiments.designs import LATE, SLOW
from papers.okajima2023.figures import FIGURES
from papers.okajima2023.method.recovery import DIAGONAL_RANGE
from papers.okajima2023.printed import TABLE_1
from replication.audit.brief import Draws, Entries, Sketch, Stroke
from replication.audit.declare import paper
from replication.audit.judge.numerals import short
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Results
from replication.audit.project import about

STEP = 24
FIRST_SENSOR, SECOND_SENSOR = range(22, LAST, 2 * STEP), range(22, LAST, 3 * STEP)


def _uncertainty() -> Stroke:
    """It grows between measurements and shrinks at each, more if both sensors measure."""
    upper, lower, width = [], [], 5.0
    for x in range(FIRST + 14, LAST, 4):
        width += 1.1
        for sensor, factor in ((FIRST_SENSOR, 0.65), (SECOND_SENSOR, 0.6)):
            if x in sensor:
                width *= factor
        upper.append((float(x), round(signal(x) - 10 - width, 1)))
        lower.append((float(x), round(signal(x) - 10 + width, 1)))
    return Stroke(draws=Draws.BAND, points=(*upper, *reversed(lower)))


TOLD = Told.read(
    __file__,
    mincx=MINCX,
    step=DIAGONAL_STEP,
    low=DIAGONAL_RANGE[0],
    high=DIAGONAL_RANGE[1],
    decimals=SECOND_DECIMALS,
    diagonal=", ".join(
        f"{float(Fraction(entry)):g}" for entry in unstable.FOUND["section-4c-poles"].parameters["diagonal"]
    ),
)
BRIEF = TOLD.brief(
    Sketch(
        alt="Two sensors with periods two and three; the uncertainty of the estimate grows between measurements and "
        "shrinks at each.",
        strokes=(
            _uncertainty(),
            curve(Draws.TRUTH, lambda x: signal(x) - 10),
            dots(Draws.MEASURED, FIRST_SENSOR, lambda x: 124),
            dots(Draws.MEASURED, SECOND_SENSOR, lambda x: 142),
            label("y₁", 0, 129, Draws.LABEL_OURS),
            label("y₂", 0, 147, Draws.LABEL_OURS),
        ),
    ),
    picture=Entries(
        columns=tuple(f"{first}, {second}" for first, second in TABLE_1),
        text="Least level γ, by the periods N₁, N₂ of the two sensors.",
        rows=(("level γ", tuple(table_claim(periods) for periods in TABLE_1)),),
    ),
)


def findings(results: Results) -> tuple[str, ...]:
    """The findings, most important first."""
    return (
        *_table_1(results),
        *_unstable(results),
        *_simulated(all_draws(results)),
        *_periods(results),
        _timing(results["timing-draws"]),
    )


MILLIONTH = 1e-6
"""The relative distance to which optima and bounds of all estimators are compared in words."""


def _unstable(results: Results) -> Iterator[str]:
    """Only where an A with other entries off its diagonal is stabilised, and none of the diagonals is."""
    diagonals = results[unstable.ALL_DIAGONALS]["found"]
    if results[unstable.ANY_ENTRIES]["radius"] < 1 <= min(row["radius"] for row in diagonals):
        yield (
            "With C of Sec. IV-A, gains (42) stabilise some A with the stated poles, but none tried that "
            "differs from (41) only on its diagonal."
        )


def _table_1(results: Results) -> Iterator[str]:
    columns = {periods: results[pair(periods)] for periods in TABLE_1}
    rounded = {periods: f"{column['optimum']:.2f}" for periods, column in columns.items()}
    wrong = {periods: printed for periods, printed in TABLE_1.items() if rounded[periods] != printed}
    for periods, printed in wrong.items():
        kept = "a valid level above it" if float(printed) > columns[periods]["upper"] else "below it"
        yield (
            f"Table 1, periods {periods}: the optimum rounds to {rounded[periods]}; the printed {printed} is {kept}."
        )
        if float(printed) < columns[periods]["lower"] * (1 + MINCX / 2):
            yield (
                f"The solver that the text names may return {printed} there: by default it stops within half a per "
                "cent of the optimum."
            )
    best = all(column["upper"] < column["noncausal"]["value"] * (1 + MILLIONTH) for column in columns.values())
    yield f"The other {len(columns) - len(wrong)} entries of Table 1 are the rounded optima."
    if best:
        yield "No estimator, causal or not, has a level more than one part in a million below our optima of Table 1."


def _simulated(found: Mapping[str, Any]) -> Iterator[str]:
    below = all(
        case["readings"][AS_PRINTED]["percentiles"]["0.0"] > G_SIM[name] for name, case in found["cases"].items()
    )
    yield (
        f"If d in eq. (34) is the process noise alone, each published ratio {'lies' if below else 'does not lie'} "
        f"below all {found['seeds']} draws; Cases A to C use our gains."
    )
    yield (
        "If it stacks all noises, as d⁎ of (17) does, eq. (34) is the ratio that γ bounds; each published ratio is "
        "possible."
    )


def _periods(results: Results) -> Iterator[str]:
    """What shorter periods cost most, with sensors that start as in Table 1, and with the best timing."""
    table = all_periods(results)
    for timing, words in (
        ("synchronous", "both sensors starting together"),
        ("best", "each with its best timing"),
    ):
        found = counterexamples(table, timing)
        if found:
            excess, shorter, longer = found[0]
            level = next(cell[timing]["lower"] for cell in table if cell["periods"] == longer)
            share = short(100 * excess / level, 2)
            yield (
                f"Beyond Table 1, shorter periods need not help: {tuple(shorter)} has a level {share} % above that of "
                f"{tuple(longer)}, {words}."
            )


def _timing(found: Mapping[str, Any]) -> str:
    best = max(found["least"], key=found["least"].__getitem__)
    return (
        f"Simulations like Figs. 6-8 favour {best.replace('timing-', 'Case ')}: with the printed gains it has the "
        f"least error energy in {100 * found['least'][best]:.0f} % of {found['seeds']} draws."
    )


PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(
        theorems.EARLIER,
        theorems.FORMULATION,
        theorems.THEOREMS,
        levels.LEVELS,
        simulation.SIMULATION,
        levels.TABLE,
        levels.TIMING,
        simulation.TIMED,
        unstable.UNSTABLE,
        blog.BLOG,
    ),
    experiments=EXPERIMENTS,
    errata=TOLD.errata(PROOFS),
    figures=TOLD.figures(FIGURES),
    findings=findings,
    brief=BRIEF,
    common=lambda results: tuple(
        row
        for sensor, name in ((SLOW, "slow"), (LATE, "late"))
        for row in common_levels(sensor, results["common"][name], f"l2 {POSITION}")
    ),
    sensitivity=lambda results: sensitivities(results["sensitivity"]),
)
