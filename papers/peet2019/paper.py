"""The audit of Peet and Gu (2019): what it is about, its tables and formulas, and what leads its page."""

from __future__ import annotations

from papers._common import MULTIPLES
from papers.peet2019 import common
from papers.peet2019.brief import BRIEF
from papers.peet2019.claims.cost import EXAMPLE_4, largest_ratio, lowered, our_seconds, printed_seconds
from papers.peet2019.claims.examples import COMPARISON, EXAMPLES_1_TO_3, FIG_1
from papers.peet2019.claims.gains import attained, conservative, optimum_of
from papers.peet2019.claims.observer import CLOSED_LOOPS, IMPLEMENTATION, REMARKS, lumped_error
from papers.peet2019.claims.theory import COROLLARY_2, DEFINITIONS, INTRODUCTION, THEOREM_1, THEOREM_3, THEOREM_4
from papers.peet2019.errata import ERRATA, OF_THE_IDENTITY
from papers.peet2019.experiments.declared import EXPERIMENTS, MOVED
from papers.peet2019.experiments.readings import READINGS as RULES
from papers.peet2019.figures import cost, observer, optimum
from papers.peet2019.printed import COLUMNS, DATA, DELAY_COUNTS, EXAMPLES, STATES, seconds
from papers.peet2019.readings import JORDAN, READINGS
from replication.audit.declare import Part, paper
from replication.audit.judge.numerals import at_most
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Results
from replication.audit.parts import Formula, Sensitivity, Table
from replication.audit.project import about

FRAME = Part(
    "Abstract and Sec. XI",
    reason="They repeat Secs. I and X, which are checked, apart from the Abstract's remarks on observability and "
    "observer-based controllers, which nothing here tests; designs of others do not stand in this text.",
)

TABLES = (
    *(
        Table(
            place=f"Example {example}",
            caption="Least gain by degree and by Padé; CPU seconds, theirs and ours.",
            header=("", "d = 1", "d = 2", "d = 3", "Padé"),
            rows=(
                ("γ_min", *(f"claim:ex{example}.gamma-{column}" for column in COLUMNS)),
                ("CPU sec", *(f"claim:ex{example}.cpu-{column}" for column in COLUMNS)),
            ),
        )
        for example in EXAMPLES
    ),
    Table(
        place="Table I",
        caption=(
            "CPU seconds of Example 4 by number of states n and of delays K, theirs and ours (full cone, the small one "
            f"at n·K = {DATA['largest-product']}); machines and solvers do not compare."
        ),
        header=("K \\ n", *map(str, STATES)),
        rows=tuple(
            (str(k), *("N/A" if seconds(n, k) == "N/A" else f"claim:table1.n{n}k{k}" for n in STATES))
            for k in DELAY_COUNTS
        ),
    ),
)

FORMULAS = (
    Formula(
        text="The system with delays, eq. (1)",
        latex=r"\dot{x}(t) = A_0 x(t) + \sum_{i=1}^{K} A_i x(t - \tau_i) + B w(t), \qquad y(t) = C_2 x(t)",
    ),
    Formula(
        text="LMI (3) with D = 0, the case without delays",
        latex=(
            r"\begin{bmatrix} PA + ZC_2 + (PA + ZC_2)^T & -PB & C_{10}^T \\ -B^T P & -\gamma I & 0 \\"
            r" C_{10} & 0 & -\gamma I \end{bmatrix} \prec 0, \qquad L = P^{-1} Z"
        ),
    ),
)


def findings(results: Results) -> tuple[str, ...]:
    """The sentences that lead the page of this paper."""
    worst = max(abs(results[f"sos.ex{e}.d3"]["tensor"]["gamma"] / optimum_of(e, results) - 1.0) for e in EXAMPLES)
    ratios = [largest_ratio(cost) for cost in (printed_seconds(), lowered(our_seconds(results)))]
    one, negative = (results["roots"]["roots"][f"{JORDAN[name]:g}"] for name in ("jordan-one", "jordan-negative"))
    missed = len(conservative(results))
    lumped = max(abs(lumped_error(example, results)) for example in EXAMPLES)
    words = [
        "stable" if ends["largest"] < 0.0 else "unstable" if ends["smallest"] > 0.0 else "unstable for some K"
        for ends in (one, negative)
    ]
    return (
        f"Theorem 3 cannot be met as printed; once {len(OF_THE_IDENTITY)} groups of misprints are corrected, its "
        "identity "
        "and its bound hold.",
        f"If the degree counts in each variable, degree three exceeds each optimum by at most {at_most(worst, 1)} of "
        "it; "
        f"{missed or 'no'} other rules miss printed digits.",
        f"Examples 2 and 3, degree one: the printed gains are least under none of {len(RULES)} rules, and reached with "
        f"a positive ε under {len(attained(results))}.",
        f"With twenty lumped states per delay H∞ norms err by up to {at_most(100 * lumped)} % in Examples 1-3; the "
        "text "
        "names no accuracy.",
        "The text does not settle whether Example 4 is unstable: the eigenvalue of J is missing. "
        f"With {JORDAN['jordan-one']:g} it is {words[0]}, with −{-JORDAN['jordan-negative']:g} {words[1]}.",
        f"At equal n·K printed seconds differ by a factor of at most {at_most(ratios[0])}; ours, at the lowest γ "
        "solved, "
        f"by at most {at_most(ratios[1])}.",
    )


def _sensitivity(results: Results) -> tuple[Sensitivity, ...]:
    return tuple(move for example in MOVED for move in sensitivities(results[f"sensitivity.ex{example}"]))


PAPER = paper(
    **about(__file__),
    parts=(
        FRAME, INTRODUCTION, DEFINITIONS, THEOREM_1, COROLLARY_2, THEOREM_3, THEOREM_4, REMARKS, IMPLEMENTATION,
        COMPARISON, CLOSED_LOOPS, EXAMPLES_1_TO_3, FIG_1, EXAMPLE_4,
    ),
    readings=READINGS,
    experiments=EXPERIMENTS,
    errata=ERRATA,
    figures=(*observer.FIGURES, *optimum.FIGURES, *cost.FIGURES),
    tables=TABLES,
    formulas=FORMULAS,
    findings=findings,
    brief=BRIEF,
    common=lambda results: common.common(results["common"], list(MULTIPLES)),
    sensitivity=_sensitivity,
)  # fmt: skip
