"""The audit of Okajima, Hosoe and Hagiwara (2023): parts, tables, formulas and what the paper is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from papers._common import FIRST, LAST, MINCX, MULTIPLES, curve, dots, label, signal
from papers.okajima2023 import common
from papers.okajima2023.claims import blog, levels, simulation, theorems, unstable
from papers.okajima2023.claims.levels import counterexamples
from papers.okajima2023.claims.simulation import AS_PRINTED, G_SIM, all_draws
from papers.okajima2023.claims.unstable import PRINTED, radius_of
from papers.okajima2023.errata import ERRATA
from papers.okajima2023.experiments.declared import EXPERIMENTS, all_periods, pair, table_claim
from papers.okajima2023.figures import FIGURES
from papers.okajima2023.printed import TABLE_1
from papers.okajima2023.readings import READINGS
from replication.audit.brief import Brief, Curve, Draws, Entries, Explorer, Picture, Sketch, Stroke, Ticks
from replication.audit.declare import Part, paper
from replication.audit.judge.numerals import short
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Results
from replication.audit.parts import Formula, Table
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


_Y1, _Y2 = Ticks(label="y₁", period=2), Ticks(label="y₂", period=3)
_COMMON, _COMMON_2 = Ticks(label="y₁", period=6), Ticks(label="y₂", period=6)
SHOWN_LAST = 60.0
"""The last instant of the error curves, so that single measurements can be seen."""


def _case(label: str, name: str, claim: str, *sensors: Ticks) -> Picture:
    """The error of one observer of Sec. IV-A over that of the proposed one."""
    errors = {case: tuple(f"{case}_e_{i}" for i in (1, 2, 3)) for case in ("proposed", name)}
    reference = Curve(label="each at its own period", columns=errors["proposed"], quiet=True)
    return Picture(
        label=label,
        figure="okajima2023-fig2-5",
        across="k",
        x="instant k",
        y="size of the error |e(k)|",
        last=SHOWN_LAST,
        claim=f"gamma.{claim}",
        sensors=sensors,
        curves=(*((reference,) if name != "proposed" else ()), Curve(label="this observer", columns=errors[name])),
    )


BRIEF = Brief(
    topic="Sensors that tick at different rates",
    card="The least level there is {table1.n21}, {table1.n21:miss} % too low to round to the print. The print is valid "
    "as a level: [the paper's solver may stop there](-table1.n21). All levels of the [stable plant](+gamma.proposed) "
    "are valid. Sec. IV-C calls its plant unstable, but in our copy eq. (41) repeats "
    "[the stable matrix](?unstable.is-unstable).",
    holds="All levels of the stable plant as guarantees ([its own](gamma.proposed), [Cases A](gamma.case-a), "
    "[B](gamma.case-b), [C](gamma.case-c), Table 1), and the [level](gains.eq33) of all four printed gain sets.",
    correct="[Table 1, periods (2, 1)](table1.n21): {table1.n21:not}. In our copy eq. (41) repeats the stable matrix; "
    "with it the error [grows](unstable.stabilised).",
    guess="Is d in eq. (34) [d⁎ of (17)](denominator)? Which [plant](unstable.same-setting) does Sec. IV-C use?",
    verdict="holds, one last digit off",
    headline="Table 1, periods (2, 1): [{table1.n21:not}](table1.n21). All other entries are the rounded optima",
    picture=Entries(
        columns=tuple(f"{first}, {second}" for first, second in TABLE_1),
        text="Least level γ, by the periods N₁, N₂ of the two sensors.",
        rows=(("level γ", tuple(table_claim(periods) for periods in TABLE_1)),),
    ),
    sketch=Sketch(
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
    explorers=(
        Explorer(
            title="Reading each sensor at its own period gives the smallest level",
            moves="Choose what the observer reads.",
            text="Blue is the size of its estimation error under one draw of noise, grey that of the observer that "
            "reads both sensors at their own periods. For Cases A to C the gains are ours, none being printed. Ticks "
            "are measurements.",
            pictures=(
                _case("both sensors, each at its own period", "proposed", "proposed", _Y1, _Y2),
                _case("y₁ alone (Case A)", "A", "case-a", _Y1),
                _case("y₂ alone (Case B)", "B", "case-b", _Y2),
                _case("both at their common period (Case C)", "C", "case-c", _COMMON, _COMMON_2),
            ),
        ),
        Explorer(
            title="Timing alone changes the least level",
            moves="Move the offset.",
            text="Both sensors keep their periods; the second starts later by the offset. The best offset is "
            "not always zero. A curve ends where the timings repeat.",
            pictures=(
                Picture(
                    label="offset",
                    figure="okajima2023-timing",
                    across="offset",
                    x="offset θ₂ (instants)",
                    y="least level γ",
                    begin=1.0,
                    curves=tuple(
                        Curve(label=f"periods ({first}, {second})", columns=(f"gamma_{first}_{second}",))
                        for first, second in ((6, 6), (4, 6), (5, 5), (6, 3), (4, 4), (3, 3))
                    ),
                ),
            ),
        ),
    ),
)


def findings(results: Results) -> tuple[str, ...]:
    """The findings, most important first."""
    return (
        *_table_1(results),
        "With eq. (41) as in our copy, gains (42) make the error grow, in the long run "
        f"{radius_of(results[PRINTED]['error_poles']):.2f}-fold per six instants.",
        f"With C of Sec. IV-A, gains (42) stabilise {NONE_OF[len(results['unstable.diagonals']['found'])]} whose A "
        "differs on the diagonal only. For an A that differs elsewhere they can.",
        *_simulated(all_draws(results)),
        *_periods(results),
        _timing(results["timing-draws"]),
    )


NONE_OF = {1: "not the plant", 2: "neither plant"}
MILLIONTH = 1e-6
"""The relative distance to which optima and bounds of all estimators are compared in words."""


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
        f"With eq. (34) as in our copy, d alone, {'all' if below else 'not all'} {found['seeds']} draws exceed "
        "each published ratio, in Cases A to C with our gains."
    )
    yield (
        "With d⁎ of (17) for d, eq. (34) is the ratio that γ bounds; each published ratio is possible. Our copy may "
        "lack the star."
    )


def _periods(results: Results) -> Iterator[str]:
    """What shorter periods cost most, with sensors that start as in Table 1, and with the best timing."""
    table = all_periods(results)
    for timing, words in (
        ("synchronous", "both sensors starting together, as in Table 1"),
        ("best", "each with its best timing"),
    ):
        found = counterexamples(table, timing)
        if found:
            excess, shorter, longer = found[0]
            level = next(cell[timing]["lower"] for cell in table if cell["periods"] == longer)
            share = short(100 * excess / level, 2)
            yield (
                f"Shorter periods need not help: {tuple(shorter)} has a level {share} % above that of {tuple(longer)}, "
                f"{words}."
            )


def _timing(found: Mapping[str, Any]) -> str:
    best = max(found["least"], key=found["least"].__getitem__)
    return (
        f"Simulations like Figs. 6-8 favour {best.replace('timing-', 'Case ')}: with the printed gains it has the "
        f"least error energy in {100 * found['least'][best]:.0f} % of {found['seeds']} draws."
    )


PARTS = (
    Part("Abstract", reason="Says in short what is audited where the paper says it."),
    Part(
        "Sec. I, motivation and related work",
        reason="Statements about other papers, whose texts are not at hand, and about ease of implementation.",
    ),
    Part(
        "Sec. I, evaluation signals other than the estimation error",
        reason="The identities behind both theorems are checked with random W; the examples of the text have W = I.",
    ),
    theorems.EARLIER,
    theorems.FORMULATION,
    Part(
        "Fig. 1, block diagram",
        reason="A drawing without data; its schedules are audited, the D of the sentence on it is an erratum.",
    ),
    Part("Remark 1, on zero measurements", reason="An explanation: the observer knows S_k."),
    theorems.THEOREMS,
    levels.LEVELS,
    Part(
        "Input matrix B_u", reason="It cancels in the error system, as the check of eq. (16) with a random B_u shows."
    ),
    Part(
        "Symbols d_u, d_y1, d_y2 and “standard normal” before Fig. 2",
        reason="The symbols, which suggest a stacked d as in (17), are not defined in our copy, and “standard normal” "
        "is at odds with the deviations stated; read as d, w₁ and w₂ with those deviations, zero after k = 500. A "
        "common scale of all noises cancels in eq. (34).",
    ),
    simulation.SIMULATION,
    levels.TABLE,
    levels.TIMING,
    simulation.TIMED,
    unstable.UNSTABLE,
    Part(
        "The solver mincx, and computing times",
        reason="Its source is closed, and no time is printed. By its documentation it stops at a relative accuracy of "
        "1 % unless told otherwise.",
    ),
    Part("Sec. V, conclusion", reason="Repeats statements that are audited where they are made."),
    blog.BLOG,
    Part(
        "The author's own program, to which the blog links",
        reason="Public, and not used here. It has another plant and another schedule, and neither Table 1, eq. (34) "
        "nor Sec. IV-C, so it settles none of the open points. It calls mincx with its default options.",
    ),
    Part("Blog: other articles, courses and links", reason="About other works."),
)

TABLES = (
    Table(
        place="Table 1",
        caption="Smallest level for several sensing periods, both sensors at instant 0.",
        header=("N₁, N₂", *(f"{a}, {b}" for a, b in TABLE_1)),
        rows=(("γ", *(f"claim:{table_claim(periods)}" for periods in TABLE_1)),),
    ),
    Table(
        place="Sec. IV-A",
        caption="The multi-rate observer against three dual-rate ones, with a simulated ratio of each: one draw.",
        header=("Observer", "optimal level γ", "simulated ratio, eq. (34)"),
        rows=tuple(
            (who, f"claim:gamma.{'' if name == 'proposed' else 'case-'}{name.lower()}", f"claim:gsim.{name.lower()}")
            for name, who in simulation.WHO.items()
        ),
    ),
    Table(
        place="Sec. IV-B",
        caption="Three timings of two sensors of period 3: smallest level, and l2 gain with the printed gains.",
        header=("Timing", "optimal level γ", "l2 gain with the printed gains"),
        rows=tuple((f"Case {n}, θ₂ = {n - 1}", f"claim:timing.case-{n}", f"claim:gains.eq{37 + n}") for n in (1, 2, 3)),
    ),
)

FORMULAS = (
    Formula(
        text="Error system of the observer, eqs. (16) and (18)",
        latex=r"e(k+1) = (A - L_k S_k C)\,e(k) + B_d\,d(k) - L_k S_k D\,w(k), \qquad z(k) = W e(k)",
    ),
    Formula(
        text="Matrix inequality of Theorem 2, eq. (30), for every phase of the period",
        latex=(
            r"\begin{bmatrix} P_k & P_k A - Y_k S_k C & P_k B_d & -Y_k S_k D \\ \ast & P_{k-1} - W^T W & 0 & 0 \\"
            r" \ast & \ast & \gamma^2 I & 0 \\ \ast & \ast & \ast & \gamma^2 I \end{bmatrix} \succ 0,"
            r" \qquad L_k = P_k^{-1} Y_k"
        ),
    ),
    Formula(
        text="Periodic Riccati recursion used as the independent route, over the sensors measured at each instant",
        latex=(
            r"X_{k+1} = A (I + X_k G_k)^{-1} X_k A^T + B_d B_d^T, \qquad"
            r" G_k = (S_k C)^T (S_k D D^T S_k^T)^{+} S_k C - \gamma^{-2} W^T W"
        ),
    ),
    Formula(
        text="Non-causal bound: no estimator, not even a smoother that knows all measurements, has a smaller gain; T_x "
        "leads from d to W x, T_y from d to the measurements, each scaled so that its noise has unit size",
        latex=r"\gamma_{nc}^2 = \sup_\omega \lambda_{\max}\left(T_x^* T_x,\; I + T_y^* T_y\right)",
    ),
)

PAPER = paper(
    **about(__file__),
    parts=PARTS,
    readings=READINGS,
    experiments=EXPERIMENTS,
    errata=ERRATA,
    figures=FIGURES,
    tables=TABLES,
    formulas=FORMULAS,
    findings=findings,
    brief=BRIEF,
    common=lambda results: common.common(results["common"], list(MULTIPLES)),
    sensitivity=lambda results: sensitivities(results["sensitivity"]),
)
