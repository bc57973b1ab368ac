"""The audit of the nonuniform-sampling paper: its parts in the order of the text, and what is said of it."""

from __future__ import annotations

from papers._common import MINCX, Told, curve, dots, label, signal, ticks
from papers.mustafa import common
from papers.mustafa.claims.algorithm import ALGORITHM_1, ROBUST_PERFORMANCE
from papers.mustafa.claims.examples import LEVELS, RESPONSE
from papers.mustafa.claims.guarantees import ABSTRACT
from papers.mustafa.claims.main_results import THEOREM_1, THEOREM_2, THEOREM_3
from papers.mustafa.claims.preliminaries import LEMMAS, covers_as_step_3_prints, down, printed_runs, times, up
from papers.mustafa.errata import PROOFS
from papers.mustafa.experiments.declared import EXPERIMENTS, LIMIT, TRIED
from papers.mustafa.experiments.draws import LAWS
from papers.mustafa.experiments.levels import ABOVE
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


def findings(results: Results) -> tuple[str, ...]:
    """The levels, stability, what varying periods cost, what can be guaranteed, the grids."""
    worst = [times(results[f"bracket.{e}"]["lower"], GAMMA[e]) for e in EXAMPLES]
    kept = all(results[f"bracket.{e}"]["nominal"] <= upper_end(GAMMA[e]) for e in EXAMPLES)
    in_seconds = [down(results[f"bracket-duration.{e}"]["lower"]) for e in EXAMPLES]
    sizes = [results[f"grids.{e}"]["algorithm"][CORRECT.name]["size"] for e in EXAMPLES]
    by_modal = results["condition.1"]["modal_elements"]
    by_root = all(results[f"grids.{e}"]["intervals"]["corrected, root"]["covers"] for e in EXAMPLES)
    by_condition = [results[f"condition.{e}"]["elements"] for e in EXAMPLES]
    literal = {e: printed_runs(e, results) for e in EXAMPLES}
    ends = {run["end"] for runs in literal.values() for step_4 in (Step4.SET_MINUS, Step4.CUT) for run in runs[step_4]}
    uncut = literal[1][Step4.UNCUT]
    floor = times(results["curve.1"]["floor"], GAMMA[1])
    robust = [up(results[f"robust.{e}"]["guaranteed"]) for e in EXAMPLES]
    own = [times(results[f"own-grid.{e}"]["lower"], str(results[f"own-grid.{e}"]["level"])) for e in EXAMPLES]
    lowered = all(results[f"own-grid.{e}"]["upper"] < results[f"bracket.{e}"]["lower"] for e in EXAMPLES)
    return (
        f"{'Both' if kept else 'Not both'} printed levels hold, to their digits, at the middle period of the range; "
        "Theorem 3 and Sec. V-A promise no more.",
        f"If the period varies, Example 2's worst case is at least {worst[1]} times its level; Example 1's, with our "
        f"filter, at least {worst[0]} times.",
        "In Example 2 the printed filter reaches the printed level; the least level, which step 2 seeks, rounds to "
        f"{results['nominal.2']['formula']:.4f}.",
        "If the period varies, every stable filter of form (4) for Example 1 has a worst-case gain of at least "
        f"{floor} × {GAMMA[1]}.",
        "In Example 1 the newest measurement itself, which form (4) does not use, is a better estimate: worst-case "
        f"gain D = {DATA['example-1']['D']}.",
        "The error stays stable for every sequence of periods; this needs neither the grid nor condition (8).",
        "In Example 1 one grid element, the middle, violates condition (8) somewhere in the range, in any coordinates.",
        *(
            ()
            if covers_as_step_3_prints(results["grids.1"])
            else (
                "In Example 1, with step 3's α, one element does not cover the range by (9), U3 printed or corrected, "
                "whatever step 4 means.",
            )
        ),
        f"With U3 and, by inference, step 4 corrected, Algorithm 1 ends Example 1 with {sizes[0]} elements; by (8) in "
        f"modal coordinates {by_modal} would do.",
        *(
            (
                "With √α in step 3 too, where α is printed, and U3 corrected, both grids have one element; (8) fails "
                "in Example 1.",
            )
            if by_root
            else ()
        ),
        f"In Example 2 the corrected algorithm ends with {sizes[1]} grid elements; by condition (8) itself "
        f"{by_condition[1]:g} would do.",
        f"Filters of our own design guarantee the levels {robust[0]} in Example 1 and {robust[1]} in Example 2, "
        "for every sequence in the range.",
        f"Filters for the corrected grids {'lower' if lowered else 'do not always lower'} the worst case, but exceed "
        f"their own step 2 levels at least {own[0]}-fold (Example 1) and {own[1]}-fold (Example 2).",
        *(
            (
                "With its √α, step 4 adds no period in either example if read with a set-minus or cut to the range: "
                "Algorithm 1 never ends.",
            )
            if ends == {"STALLED"}
            else ()
        ),
        *(
            (
                "As an uncut union step 4 adds periods in Example 1, yet the range stays uncovered; step 1 stops at "
                f"N₀ = {LIMIT}, our choice.",
            )
            if {run["end"] for run in uncut} == {"LIMIT"}
            else ()
        ),
        f"With both norms weighted by the periods, worst cases are at least {in_seconds[0]} in Example 1, our filter, "
        f"and {in_seconds[1]} in Example 2, printed filter.",
    )


PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(
        ABSTRACT, LEMMAS, THEOREM_1, THEOREM_2, THEOREM_3, ALGORITHM_1, ROBUST_PERFORMANCE, LEVELS, RESPONSE
    ),
    experiments=EXPERIMENTS,
    errata=TOLD.errata(PROOFS),
    figures=TOLD.figures(FIGURES),
    findings=findings,
    brief=BRIEF,
    common=lambda results: common.common(results["common"], TRIED),
    sensitivity=lambda results: tuple(move for e in EXAMPLES for move in sensitivities(results[f"sensitivity.{e}"])),
)
