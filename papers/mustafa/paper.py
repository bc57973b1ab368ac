"""The audit of the nonuniform-sampling paper: its parts in the order of the text, and what is said of it."""

from __future__ import annotations

from papers._common import curve, dots, label, signal, ticks
from papers.mustafa import common
from papers.mustafa.claims.algorithm import ALGORITHM_1, ROBUST_PERFORMANCE
from papers.mustafa.claims.examples import LEVELS, RESPONSE
from papers.mustafa.claims.guarantees import ABSTRACT
from papers.mustafa.claims.main_results import THEOREM_1, THEOREM_2, THEOREM_3
from papers.mustafa.claims.preliminaries import LEMMAS, down, times, up
from papers.mustafa.errata import ERRATA
from papers.mustafa.experiments.declared import EXPERIMENTS, TRIED
from papers.mustafa.figures import FIGURES
from papers.mustafa.method import AS_PRINTED, CORRECT, WITH_SET_MINUS
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA, upper_end
from papers.mustafa.readings import READINGS
from replication.audit.brief import Bars, Brief, Curve, Draws, Explorer, Pair, Picture, Sketch
from replication.audit.declare import Part, paper
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Results
from replication.audit.parts import Formula, Table
from replication.audit.project import about

SAMPLED = (14, 24, 49, 54, 92, 110, 116, 151, 159, 194, 203, 238, 246, 252, 289, 302)
DESIGNED = [14 + 19.2 * step for step in range(16)]


def _higher(x: float) -> float:
    """The signal, with room for two rows of ticks below."""
    return signal(x) - 14


def _example(number: int, begin: float, whose: str) -> Picture:
    """Gains at one constant period, and over all sequences of periods; whose: whose filter it is."""
    return Picture(
        label=f"Example {number}, {whose} filter",
        figure="mustafa-levels",
        across=f"h_{number}",
        x="constant period h (s)",
        y="worst-case gain",
        begin=begin,
        curves=(
            Curve(label="all sequences, bounds", columns=(f"lower_{number}",), upper=f"upper_{number}"),
            Curve(label=f"{whose} filter, this period", columns=(f"filter_{number}",)),
            Curve(label="least, this period", columns=(f"optimum_{number}",), quiet=True),
            Curve(label="printed level", columns=(f"published_{number}",), quiet=True),
        ),
    )


BRIEF = Brief(
    topic="Samples at irregular instants",
    terms={
        "form (4)": "a filter that uses each sample at the next instant.",
        "grid element": "a sampling period at which Algorithm 1 checks its inequality.",
    },
    card="At the middle of the range [both](+gamma.1) levels are [right](+filter.norm); Theorem 3 and Sec. V-A promise "
    "no more. In Example 1 every filter of form (4) has a worst-case gain of at least "
    "[{finite-grid:over:gamma.1}](+finite-grid) times the printed level, if the period varies. One number differs: "
    "in Example 1 [Algorithm 1](-grid.1), corrected, ends with {grid.1} grid elements, not one.",
    holds="Both levels at the middle period ([Example 1](gamma.1), [Example 2](filter.norm)); stability for every "
    "sequence of periods, in [both](stable.1) [examples](stable.2).",
    correct="One grid element does not cover the range of Example 1: with it [(8)](grid.1) fails. [Two](map) "
    "[maps](map-12) are misprinted, and perhaps [case U3](+u3).",
    guess="What does [step 4](algorithm) compute?",
    verdict="holds at one period",
    headline="The printed levels hold at one constant period, as stated; if it varies, Example 2's worst case is at "
    "least {robust-level.2:over:filter.norm} times its level",
    picture=Bars(
        printed="printed level, at the middle period",
        bound="in the worst case, if the period varies",
        pairs=(
            Pair(
                label="Example 1 (the paper prints no filter; this is ours)",
                printed="gamma.1",
                bound="robust-level.1",
            ),
            Pair(label="Example 2 (the printed filter)", printed="filter.norm", bound="robust-level.2"),
        ),
    ),
    sketch=Sketch(
        alt="A signal is sampled at irregular instants, while the filter is designed for one constant period.",
        strokes=(
            curve(Draws.TRUTH, _higher),
            dots(Draws.MEASURED, SAMPLED, _higher),
            ticks(Draws.TICK, DESIGNED, 118),
            ticks(Draws.TICK_OURS, SAMPLED, 147),
            label("designed for", 8, 106),
            label("sampled at", 8, 131, Draws.LABEL_OURS),
        ),
    ),
    explorers=(
        Explorer(
            title="A filter designed for one period does worse when the period varies",
            moves="Move the constant period.",
            text="Each filter has the printed level at the period for which it was designed. If the period varies, its "
            "worst-case gain lies in the band above. Example 1 prints no filter; ours takes its place. In the last "
            "picture the range of periods widens.",
            pictures=(
                _example(1, 0.0678, "our"),
                _example(2, 0.05, "printed"),
                Picture(
                    label="Example 1, our filter, wider range",
                    figure="mustafa-range",
                    across="h_u",
                    x="longest period h_u (s)",
                    y="worst-case gain, all sequences",
                    begin=0.1,
                    curves=(Curve(label="worst-case gain, bounds", columns=("lower",), upper="upper"),),
                ),
            ),
        ),
    ),
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
        f"{'Both' if kept else 'Not both'} printed levels are right at the middle period of the range; Theorem 3 and "
        "Sec. V-A promise no more.",
        f"If the period varies, Example 2's worst case is at least {worst[1]} times its level; Example 1's, with our "
        f"filter, at least {worst[0]} times.",
        "In Example 2 the printed filter reaches the printed level; the least level, which step 2 seeks, rounds to "
        f"{results['nominal.2']['formula']:.4f}.",
        f"In Example 1 every stable filter of form (4) has a worst-case gain of at least {floor} × {GAMMA[1]}.",
        "In Example 1 the measurement itself is a better estimate: its worst-case gain is "
        f"D = {DATA['example-1']['D']}, whatever the periods.",
        "The error stays bounded for every sequence of periods; this needs neither the grid nor condition (8).",
        "In Example 1 one grid element, the middle, violates condition (8) somewhere in the range, in any coordinates.",
        f"In Example 1 the corrected Algorithm 1 ends with {sizes[0]} grid elements, not one; even the weakest test "
        f"needs {by_modal}.",
        *(
            ("With √α in step 3, as in step 4, the algorithm would stop at one element, as printed; then (8) fails.",)
            if by_root
            else ()
        ),
        f"In Example 2 the corrected algorithm ends with {sizes[1]} grid elements; by condition (8) itself "
        f"{by_condition[1]:g} would do.",
        f"Filters of our own design guarantee the levels {robust[0]} in Example 1 and {robust[1]} in Example 2, "
        "whatever the periods.",
        f"The corrected grids do not help: some sequence still makes the gain {own[0]} times the level in Example 1, "
        f"{own[1]} times in Example 2.",
        *(
            (
                "As printed, step 4 adds no new period, so Algorithm 1 never ends; the set-minus sign missing from our "
                "copy does not change this.",
            )
            if ends == {"STALLED"}
            else ()
        ),
        f"Measured in seconds instead of samples, the worst cases are at least {in_seconds[0]} and {in_seconds[1]}, "
        "still above both levels.",
    )


FORMULAS = (
    Formula(
        text="Error system, eq. (5), with the sampling period in the plant's blocks only",
        latex=(
            r"\bar{x}_{k+1} = \begin{bmatrix} \Phi(h_k) & 0 \\ B_f C & A_f \end{bmatrix} \bar{x}_k"
            r" + \begin{bmatrix} \Gamma(h_k) \\ B_f D \end{bmatrix} w_k"
        ),
    ),
    Formula(
        text="Path-dependent Lyapunov inequality behind the proved level g: c begins the coming periods, d is next",
        latex=r"e^T e + \bar{x}_{+}^T P_d \bar{x}_{+} \le \bar{x}^T P_c \bar{x} + g^2 w^T w",
    ),
)

PARTS = (
    ABSTRACT,
    Part("Sec. I, related work", reason="Statements about other papers; their texts are not at hand."),
    Part(
        "Sec. II",
        reason="Definitions, by which gains are computed here. (3) gives x at the sampling instants if w is constant "
        "between them, which the text leaves unsaid; the levels are those of (3).",
    ),
    LEMMAS,
    Part("Fig. 1, block diagram", reason="A drawing without data; Lemma 2 is audited."),
    THEOREM_1,
    Part(
        "Eq. (9), cases L1, L2, U1 and U2",
        reason="L1 and L2 cannot occur for a stable A, since μ(−A) ≥ −tr(A)/n > 0. U1 and U2 are limits of the same "
        "integral as U3, as μ(A) tends to zero or below −α; no example meets them.",
    ),
    THEOREM_2,
    Part("Theorem 2, proof", reason="Its conclusion is proved in another way, without the condition (8)."),
    THEOREM_3,
    Part("Theorem 3, “for all h_i > 0”", reason="Read as for each period of its grid, i = 1 to N."),
    ALGORITHM_1,
    Part(
        "Algorithm 1, M ≤ #G + 1",
        reason="With the set-minus an interval falls into at most one part more than open intervals are taken from it: "
        "true, and nothing to compute.",
    ),
    ROBUST_PERFORMANCE,
    Part("Eq. (13)", reason="Announced, but missing from our copy; a reconstruction of ours is used."),
    Part(
        "Sec. V-A, trade-off by two performance measures",
        reason="A remark on (13), which is missing from our copy.",
    ),
    Part("Sec. V-B, continuous-time performance", reason="A remark without a computation."),
    LEVELS,
    Part(
        "Sec. VI, levels of [13] and [14] beside those of the examples",
        reason="Set side by side, in Example 1 with the remark that the indices differ; no order is claimed.",
    ),
    RESPONSE,
)

LEVELS_TABLE = Table(
    place="Sec. VI",
    caption="Printed levels, whether there is a level for every sampling sequence (norms count samples), and how many "
    "elements the grids have.",
    header=("Example", "level at one period", "with a level for every sequence", "elements of the grid"),
    rows=tuple((str(e), *(f"claim:{name}.{e}" for name in ("gamma", "robust-level", "grid"))) for e in EXAMPLES),
)

PAPER = paper(
    **about(__file__),
    parts=PARTS,
    experiments=EXPERIMENTS,
    errata=ERRATA,
    figures=FIGURES,
    tables=(LEVELS_TABLE,),
    formulas=FORMULAS,
    readings=READINGS,
    findings=findings,
    brief=BRIEF,
    common=lambda results: common.common(results["common"], TRIED),
    sensitivity=lambda results: tuple(move for e in EXAMPLES for move in sensitivities(results[f"sensitivity.{e}"])),
)
