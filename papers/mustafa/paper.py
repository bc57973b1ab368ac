"""The audit of the nonuniform-sampling paper: its parts in the order of the text, and what is said of it."""

from typing import Any

from papers._common import MINCX, POSITION, Told, common_levels, curve, dots, label, parts_of, signal, ticks
from papers.mustafa.claims import algorithm, examples, guarantees, main_results, preliminaries
from papers.mustafa.claims.preliminaries import covers_as_step_3_prints, down, on_motor, printed_runs, times, up
from papers.mustafa.errata import PROOFS
from papers.mustafa.experiments.declared import EXPERIMENTS, LIMIT, TRIED
from papers.mustafa.experiments.draws import LAWS
from papers.mustafa.experiments.levels import ABOVE, IRREGULAR
from papers.mustafa.figures import FIGURES
from papers.mustafa.method import CORRECT, Step4
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA, upper_end
from replication.audit.brief import Draws, Sketch
from replication.audit.declare import paper
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Results
from replication.audit.project import about

SAMPLED = (14, 24, 49, 54, 92, 110, 116, 151, 159, 194, 203, 238, 246, 252, 289, 302)
DESIGNED = [14 + 19.2 * step for step in range(16)]


def _higher(x: float) -> float:
    """The signal, with room for two rows of ticks below."""
    return signal(x) - 14


PARTS = parts_of(guarantees, preliminaries, main_results, algorithm, examples)
TOLD = Told.read(__file__, mincx=MINCX, above=ABOVE, **LAWS)
BRIEF = TOLD.brief(
    Sketch(
        alt="A signal is sampled at irregular instants, while the filter is designed for one constant period.",
        strokes=(
            curve(Draws.TRUTH, _higher),
            dots(Draws.MEASURED, SAMPLED, _higher),
            ticks(Draws.TICK, DESIGNED, 118),
            ticks(Draws.TICK_OURS, SAMPLED, 147),
            label("designed for", 8, 106),
            label("sampled at", 8, 131, Draws.LABEL_OURS),
        ),
    )
)


def facts(results: Results) -> dict[str, Any]:
    """The levels, stability, what varying periods cost, what can be guaranteed, the grids."""
    brackets, grids = ([results[f"{name}.{e}"] for e in EXAMPLES] for name in ("bracket", "grids"))
    solutions = {e: results[f"own-grid.{e}"] for e in EXAMPLES}
    lowered = all(solutions[e]["upper"] < results[f"bracket.{e}"]["lower"] for e in EXAMPLES)
    literal = [printed_runs(e, results) for e in EXAMPLES]
    ends = {run["end"] for runs in literal for step_4 in (Step4.SET_MINUS, Step4.CUT) for run in runs[step_4]}
    agreement = all(bracket["nominal"] <= upper_end(GAMMA[e]) for e, bracket in zip(EXAMPLES, brackets, strict=True))
    return {
        "both": "Both" if agreement else "Not both",
        "worst": [times(bracket["lower"], GAMMA[e]) for e, bracket in zip(EXAMPLES, brackets, strict=True)],
        "least": results["nominal.2"]["formula"],
        "floor": times(results["curve.1"]["floor"], GAMMA[1]),
        "level": GAMMA[1],
        "D": DATA["example-1"]["D"],
        "one_element": not covers_as_step_3_prints(grids[0]),
        "sizes": [grid["algorithm"][CORRECT.name]["size"] for grid in grids],
        "by_modal": results["condition.1"]["modal_elements"],
        "by_condition": results["condition.2"]["elements"],
        "by_root": all(grid["intervals"]["corrected, root"]["covers"] for grid in grids),
        "robust": [up(results[f"robust.{e}"]["guaranteed"]) for e in EXAMPLES],
        "lowered": "lower" if lowered else "do not always lower",
        "own": [times(solution["lower"], str(solution["level"])) for solution in solutions.values()],
        "never_ends": ends == {"STALLED"},
        "uncut": {run["end"] for run in literal[0][Step4.UNCUT]} == {"LIMIT"},
        "limit": LIMIT,
        "in_seconds": [down(results[f"bracket-duration.{e}"]["lower"]) for e in EXAMPLES],
    }


PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(*map(on_motor, PARTS)),
    experiments=EXPERIMENTS,
    errata=TOLD.errata(PROOFS),
    figures=TOLD.figures(FIGURES),
    findings=TOLD.findings(facts),
    brief=BRIEF,
    common=lambda results: common_levels(IRREGULAR, results["common"], f"l2 {POSITION}", TRIED),
    sensitivity=lambda results: tuple(move for e in EXAMPLES for move in sensitivities(results[f"sensitivity.{e}"])),
)
