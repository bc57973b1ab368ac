"""The audit of Peet and Gu (2019): what it is about, its tables and formulas, and what leads its page."""

from __future__ import annotations

from papers._common import MULTIPLES
from papers.peet2019 import common
from papers.peet2019.claims.cost import EXAMPLE_4
from papers.peet2019.claims.examples import COMPARISON, EXAMPLES_1_TO_3, FIG_1
from papers.peet2019.claims.observer import CLOSED_LOOPS, IMPLEMENTATION, lumped_error
from papers.peet2019.claims.theory import COROLLARY_2, THEOREM_3, THEOREM_4
from papers.peet2019.errata import ERRATA
from papers.peet2019.experiments.readings import READINGS, common_epsilon
from papers.peet2019.figures import FIGURES
from papers.peet2019.printed import COLUMNS, DELAY_COUNTS, EXAMPLES, STATES, seconds
from papers.peet2019.runs import EXPERIMENTS, MOVED
from replication.audit.declare import paper
from replication.audit.judge.perturb import sensitivities
from replication.audit.model import Formula, Results, Sensitivity, Table

TABLES = (
    *(
        Table(
            place=f"Example {example}",
            caption=f"Example {example}: least gain by degree and by Padé.",
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
        caption="CPU seconds of Example 4 by number of states n and of delays K.",
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
    second, third = (results[f"sos.ex{example}.d1"]["tensor"]["gamma"] for example in ("2", "3"))
    return (
        "The printed gains of degree 2 and 3 and of Padé are reproduced; those of degree 1 of Examples 2 and 3 "
        f"are not, by any degree rule ({second:.5f} and {third:.5f}); of {len(READINGS)} readings of the rule "
        f"{sum(common_epsilon(results['readings'], name) for name in READINGS)} give both with one ε.",
        "As printed, Theorem 3 has two wrong signs; corrected, it holds to "
        f"{results['identities']['theorem_3']['none']['largest']:.0e}.",
        "Twenty lumped states give the norm of the closed loop of Example 2 with an error of "
        f"{abs(lumped_error(results)):.1%}.",
    )


def _sensitivity(results: Results) -> tuple[Sensitivity, ...]:
    return tuple(move for example in MOVED for move in sensitivities(results[f"sensitivity.ex{example}"]))


PAPER = paper(
    key="peet2019",
    title="SOS for Systems with Multiple Delays: Part 2. H∞-Optimal Estimation",
    authors=("Matthew M. Peet", "Keqin Gu"),
    year=2019,
    venue="American Control Conference",
    doi="",
    summary=(
        "Observers for systems with several state delays that correct the estimate of the present state and of the "
        "history, designed by sums of squares so that the gain from disturbance to estimation error is least."
    ),
    notebook="delay",
    bibtex=(
        "@inproceedings{peet2019,\n"
        "  author = {Peet, Matthew M. and Gu, Keqin},\n"
        "  title = {{SOS} for Systems with Multiple Delays: Part 2. {$H_\\infty$}-Optimal Estimation},\n"
        "  booktitle = {Proceedings of the American Control Conference},\n"
        "  year = {2019}\n}"
    ),
    parts=(
        THEOREM_3, COROLLARY_2, THEOREM_4, IMPLEMENTATION, COMPARISON, CLOSED_LOOPS, EXAMPLES_1_TO_3, FIG_1, EXAMPLE_4,
    ),
    experiments=EXPERIMENTS,
    errata=ERRATA,
    figures=FIGURES,
    tables=TABLES,
    formulas=FORMULAS,
    findings=findings,
    common=lambda results: common.common(results["common"], list(MULTIPLES)),
    sensitivity=_sensitivity,
)  # fmt: skip
