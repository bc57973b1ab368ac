"""The audit of the nonuniform-sampling paper: its parts in the order of the text, and what is said of it."""

from __future__ import annotations

from papers._common import MINCX, Told, curve, dots, label, signal, ticks
from papers.mustafa import common
from papers.mustafa.claims.algorithm import ALGORITHM_1, ROBUST_PERFORMANCE
from papers.mustafa.claims.examples import LEVELS, RESPONSE
from papers.mustafa.claims.guarantees import ABSTRACT
from papers.mustafa.claims.main_results import THEOREM_1, THEOREM_2, THEOREM_3
from papers.mustafa.claims.preliminaries import LEMMAS, down, times, up
from papers.mustafa.errata import PROOFS
from papers.mustafa.experiments.declared import EXPERIMENTS, TRIED
from papers.mustafa.experiments.draws import LAWS
from papers.mustafa.experiments.levels import ABOVE
from papers.mustafa.figures import FIGURES
from papers.mustafa.method import AS_PRINTED, CORRECT, WITH_SET_MINUS
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
    as_read = [reading.name for reading in (AS_PRINTED, WITH_SET_MINUS)]
    ends = {results[f"grids.{e}"]["algorithm"][name]["end"] for e in EXAMPLES for name in as_read}
    floor = times(results["curve.1"]["floor"], GAMMA[1])
    robust = [up(results[f"robust.{e}"]["guaranteed"]) for e in EXAMPLES]
    own = [times(results[f"own-grid.{e}"]["lower"], str(results[f"own-grid.{e}"]["level"])) for e in EXAMPLES]
    return (
        f"{'Both' if kept else 'Not both'} printed gains are right at the middle period of the range; Theorem 3 and "
        "Sec. V-A promise no more.",
        f"If the period varies, the printed filter of Example 2 has at least {worst[1]} times the gain, and our "
        f"filter of Example 1 {worst[0]} times.",
        "In Example 2 the printed filter has the printed gain; the least gain there, which step 2 seeks, rounds to "
        f"{results['nominal.2']['formula']:.4f}.",
        f"In Example 1 every stable filter of form (4) has a worst-case gain of at least {floor} × {GAMMA[1]}.",
        f"In Example 1, y_k itself as estimate gives the gain D = {DATA['example-1']['D']} for every sequence; filter "
        "(4) cannot, using y_k one step late.",
        "The error stays stable for every sequence of periods: a stable plant and (6) at one period suffice, without "
        "grid or condition (8).",
        "With the middle as its one grid element, Example 1 does not satisfy (8) over the range, whatever the "
        "coordinates.",
        f"One element does not cover the range of Example 1: corrected, Algorithm 1 ends with {sizes[0]} by (9), with "
        f"{by_modal} by (8) in modal coordinates.",
        *(
            (
                "With √α in step 3 too, and U3 corrected, one element comes out in both examples, as printed; but (8) "
                "fails in Example 1.",
            )
            if by_root
            else ()
        ),
        f"In Example 2 the corrected algorithm ends with {sizes[1]} elements by (9), and with {by_condition[1]:g} by "
        "condition (8) itself.",
        "Other filters, designed by us with one Lyapunov function, guarantee for every sequence of periods "
        f"{robust[0]} in Example 1 and {robust[1]} in Example 2.",
        f"With the corrected grids, along some sequence the gain is still {own[0]} times the level in Example 1 and "
        f"{own[1]} times in Example 2.",
        *(
            (
                "As printed, step 4 adds no new period, so Algorithm 1 never ends; the set-minus sign missing from our "
                "copy does not change this.",
            )
            if ends == {"STALLED"}
            else ()
        ),
        f"Counted in seconds instead of samples, the gains for varying periods are at least {in_seconds[0]} and "
        f"{in_seconds[1]}, still above both levels.",
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
