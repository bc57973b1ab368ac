"""The audit of Okajima, Hosoe and Hagiwara (2023): its parts, what leads its page, and what is misprinted.

Each misprint has the computation that shows what must be meant.
"""

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from papers._common import FIRST, LAST, MINCX, POSITION, Told, common_levels, curve, dots, label, parts_of, signal
from papers.okajima2023.claims import blog, levels, simulation, theorems, unstable
from papers.okajima2023.claims.levels import counterexamples
from papers.okajima2023.claims.simulation import ALL_NOISE, AS_PRINTED, G_SIM, READING_OF, all_draws
from papers.okajima2023.claims.unstable import ALL_DIAGONALS, PRINTED, RECOVERED, radius_of
from papers.okajima2023.experiments.declared import (
    DIAGONAL_STEP,
    EXPERIMENTS,
    PERIOD_TABLE,
    SECOND_DECIMALS,
    pair,
    table_claim,
)
from papers.okajima2023.experiments.designs import LATE, SLOW
from papers.okajima2023.figures import FIGURES
from papers.okajima2023.method.recovery import DIAGONAL_RANGE
from papers.okajima2023.printed import PLANT, TABLE_1
from replication.audit.brief import Draws, Entries, Sketch, Stroke
from replication.audit.declare import paper
from replication.audit.judge.numerals import short
from replication.audit.judge.printed import sensitivities
from replication.audit.judge.verdict import SMALLEST_PROBABILITY
from replication.audit.model import Proof, Results
from replication.audit.project import about


def denominator(text: str, results: Results) -> Proof:
    """Which readings of the denominator of eq. (34) make all four printed values possible."""
    record = all_draws(results)
    cases = record["cases"]
    least = {what: min(case["readings"][what]["probability"] for case in cases.values()) for what in READING_OF}
    possible = [what for what, probability in least.items() if probability >= SMALLEST_PROBABILITY]
    return Proof(
        holds=possible == [ALL_NOISE]
        and all(case["readings"][AS_PRINTED]["percentiles"]["0.0"] > G_SIM[name] for name, case in cases.items()),
        text=text.format(draws=record["seeds"], readings=len(READING_OF)),
        quantities={f"least probability of the four, {what}": probability for what, probability in least.items()},
    )


def diagonal(text: str, results: Results) -> Proof:
    """The diagonals of A that have the stated poles: one on a grid, and all real ones that have them exactly."""
    state = results[RECOVERED]["state"]
    _, second = results[ALL_DIAGONALS]["found"]
    literal = results[PRINTED]["poles"]
    return Proof(
        holds=len(state["fits"]) == 1 and not second["fits"],
        text=text.format(
            tried=state["tried"],
            step=state["step"],
            low=DIAGONAL_RANGE[0],
            high=DIAGONAL_RANGE[1],
            fit=tuple(state["fits"][0]),
            other=", ".join(f"{entry:.4f}" for entry in second["diagonal"]),
            bound=results[ALL_DIAGONALS]["bound"],
        ),
        quantities={
            **{f"modulus of pole {i + 1} of A as printed": abs(complex(*pole)) for i, pole in enumerate(literal)},
            "growth of the error per six instants, A as printed and gains (42)": radius_of(
                results[PRINTED]["error_poles"]
            ),
        },
    )


def sensor_index(text: str, results: Results) -> Proof:
    """S_k C needs as many rows and columns in S_k as there are sensors; the example has fewer sensors than states."""
    columns = len(results["schedule.sec-4a"]["diagonals"][0])
    states, sensors = len(PLANT["A"]), len(PLANT["C"])
    return Proof(
        holds=columns == sensors and columns != states,
        text=text,
        quantities={"sensors": sensors, "states": states, "entries of the diagonal of S_k in Sec. IV-A": columns},
    )


def noise_index(text: str, results: Results) -> Proof:
    """The second diagonal entry of D has the indices (2, 2); the entry (1, 2) of the example's D is zero."""
    D = PLANT["D"]
    return Proof(
        holds=D[0][1] == 0 and D[1][1] != 0,
        text=text,
        quantities={"entry (1, 2) of D in Sec. IV-A": D[0][1], "entry (2, 2)": D[1][1]},
    )


PROOFS = {
    "denominator": denominator,
    "diagonal-of-a": diagonal,
    "sensor-index": sensor_index,
    "noise-index": noise_index,
}
"""By the errata of told.toml."""


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
        text="Least bound γ on the gain from noise to error, by the periods N₁, N₂ of the two sensors.",
        rows=(("level γ", tuple(table_claim(periods) for periods in TABLE_1)),),
    ),
)


MILLIONTH = 1e-6
"""The relative distance to which optima and bounds of all estimators are compared in words."""


def facts(results: Results) -> dict[str, Any]:
    """What Table 1 has wrong, which A is stabilised, what (34) may be, what shorter periods cost, the best timing."""
    levels = {periods: results[pair(periods)] for periods in TABLE_1}
    rounded = {periods: f"{level['optimum']:.2f}" for periods, level in levels.items()}
    wrong = [
        {
            "periods": periods,
            "rounded": rounded[periods],
            "printed": printed,
            "kept": "a valid level above it" if float(printed) > levels[periods]["upper"] else "below it",
        }
        for periods, printed in TABLE_1.items()
        if rounded[periods] != printed
    ]
    cases = all_draws(results)["cases"]
    below = all(case["readings"][AS_PRINTED]["percentiles"]["0.0"] > G_SIM[name] for name, case in cases.items())
    timed = results["timing-draws"]
    best = max(timed["least"], key=timed["least"].__getitem__)
    radii = [row["radius"] for row in results[unstable.ALL_DIAGONALS]["found"]]
    return {
        "wrong": wrong,
        "solver": [
            entry for entry in wrong if float(entry["printed"]) < levels[entry["periods"]]["lower"] * (1 + MINCX / 2)
        ],
        "right": len(levels) - len(wrong),
        "no_estimator": all(level["upper"] < level["noncausal"] * (1 + MILLIONTH) for level in levels.values()),
        # Only where an A with other entries off its diagonal is stabilised, and none of the diagonals is.
        "stabilised": results[unstable.ANY_ENTRIES]["radius"] < 1 <= min(radii),
        "lies": "lies" if below else "does not lie",
        "draws": all_draws(results)["seeds"],
        "longer": list(_costly(results[PERIOD_TABLE])),
        "best": best.replace("timing-", "Case "),
        "share": 100 * timed["least"][best],
        "timed": timed["seeds"],
    }


def _costly(table: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """What shorter periods cost most, with sensors that start as in Table 1, and with the best timing."""
    for timing, words in (("synchronous", "both sensors starting together"), ("best", "each with its best timing")):
        for excess, shorter, longer in counterexamples(table, timing)[:1]:
            level = next(cell[timing]["lower"] for cell in table if cell["periods"] == longer)
            more = short(100 * excess / level, 2)
            yield {"shorter": tuple(shorter), "more": more, "than": tuple(longer), "words": words}


PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(*parts_of(theorems, levels, simulation, unstable, blog)),
    experiments=EXPERIMENTS,
    errata=TOLD.errata(PROOFS),
    figures=TOLD.figures(FIGURES),
    findings=TOLD.findings(facts),
    brief=BRIEF,
    common=lambda results: common_levels(
        f"l2 {POSITION}", {SLOW: results["common"]["slow"], LATE: results["common"]["late"]}
    ),
    sensitivity=lambda results: sensitivities(results["sensitivity"]),
)
