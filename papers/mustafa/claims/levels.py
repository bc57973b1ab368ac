"""Claims of Sec. VI: both levels, what they hold for, the printed filter, the levels of others, Figs. 2 and 3."""

from __future__ import annotations

from collections.abc import Callable

from papers.mustafa import data
from papers.mustafa.names import BRACKET, DRAWS, DURATION, KEY, NOMINAL, ROBUST
from replication.audit.model import Claim, Evidence, Kind, Results, SolverRecord, Verdict

PRINTED_LEVEL = {1: data.GAMMA_1, 2: data.GAMMA_2}


def solvers(result: dict[str, object]) -> tuple[SolverRecord, ...]:
    """The solver records of an experiment."""
    return tuple(SolverRecord(**record) for record in result["solvers"])  # type: ignore[attr-defined]


def nominal_level(example: int) -> Callable[[Results], Evidence]:
    """An answer: the optimum of step 2 at the middle of the range."""

    def nominal_optimum(results: Results) -> Evidence:
        r = results[NOMINAL[example]]
        formula = r["formula"]
        return Evidence(
            method="Closed form of the optimum of (10) at the one period of the grid.",
            cross_check=f"Riccati bisection {r['riccati']:.12f}; LMI {r['lmi']['level']:.12f} ({r['lmi']['status']}), "
            f"exact norm of its filter {r['lmi']['norm']:.12f}.",
            value=formula,
            quantities={
                "Riccati over formula, relative": r["riccati"] / formula - 1,
                "LMI over formula, relative": r["lmi"]["level"] / formula - 1,
                "LMI through cvxpy over formula, relative": r["printed_lmi"]["level"] / formula - 1,
                "norm of the LMI's filter over formula, relative": r["lmi"]["norm"] / formula - 1,
            },
            solvers=solvers(r),
            note="It holds for one constant sampling period, the middle of the range, and for no other.",
        )

    return nominal_optimum


def guaranteed(example: int) -> Callable[[Results], Evidence]:
    """An answer: whether the printed level holds for every sequence in the range."""

    def true_worst_case(results: Results) -> Evidence:
        r = results[BRACKET[example]]
        printed = float(PRINTED_LEVEL[example])
        return Evidence(
            method="Worst-case l2 gain over all sampling sequences: a sequence that is at hand below, a path-dependent "
            "Lyapunov function for the continuum of periods above.",
            cross_check="The lower end is a simulated ratio; the upper one is checked without the solver.",
            lower=r["lower"],
            upper=r["upper"],
            value=r["lower"],
            holds=r["lower"] <= printed,
            margin=printed - r["lower"],
            quantities={
                "upper over lower": r["upper"] / r["lower"],
                "lower over printed": r["lower"] / printed,
                "one Lyapunov function": r["common"],
                "leaves of the context tree": float(r["leaves"]),
                "duration-weighted, lower": results[DURATION[example]]["lower"],
                "duration-weighted, upper": results[DURATION[example]]["upper"],
            },
            solvers=solvers(r),
            note="The paper says in Sec. V-A that the level is nominal; the abstract reads as if it were robust.",
        )

    return true_worst_case


def robustly_stable(example: int) -> Callable[[Results], Evidence]:
    """An answer: the exact stability test."""

    def stable_for_every_sequence(results: Results) -> Evidence:
        r = results[BRACKET[example]]
        margin = min(-r["plant_abscissa"], 1 - r["filter_radius"])
        return Evidence(
            method="Exact test: block-triangular with commuting Phi(h), so A Hurwitz and A_f Schur decide.",
            holds=margin > 0,
            margin=margin,
            quantities={"abscissa of A": r["plant_abscissa"], "spectral radius of A_f": r["filter_radius"]},
            note="It holds for every range of sampling periods; a grid is not needed for stability.",
        )

    return stable_for_every_sequence


def norm_of_printed_filter(results: Results) -> Evidence:
    """Exact norm of the printed filter at the period of its grid."""
    norm = results[BRACKET[2]]["nominal"]
    best = results[NOMINAL[2]]["formula"]
    return Evidence(
        method="Exact H-infinity norm of (5) with the printed filter at the printed grid period.",
        value=norm,
        quantities={"optimum": best, "printed filter over optimum, relative": norm / best - 1},
    )


def filter_matrix(name: str, column: int | None = None) -> Callable[[Results], Evidence]:
    """An answer: a matrix of the optimal filter, or one column of it."""

    def optimal_filter(results: Results) -> Evidence:
        rows = results[NOMINAL[2]]["filter"][name]
        picked = rows if column is None else [[row[column]] for row in rows]
        return Evidence(
            method="Riccati filter at the nominal optimum, which tends to K = Phi Gamma (C Gamma)^-1.",
            value=tuple(tuple(row) for row in picked),
            note="D = 0 makes the optimum degenerate: a solver stops beside it, and its gains with it.",
        )

    return optimal_filter


def second_column(results: Results) -> Evidence:
    """The second column of Phi(0.05): C does not see the second state, so A_f = Phi - B_f C keeps it."""
    Phi = results[NOMINAL[2]]["Phi"]
    return Evidence(method="Second column of Phi(0.05) by the matrix exponential.", value=tuple((r[1],) for r in Phi))


def first_column(results: Results) -> Evidence:
    """The first column of Phi(0.05) - B_f C with the printed B_f."""
    Phi, B = results[NOMINAL[2]]["Phi"], data.matrix(data.B_F)
    return Evidence(
        method="First column of Phi(0.05) - B_f C, with B_f as printed.",
        value=tuple((r[0] - b[0],) for r, b in zip(Phi, B, strict=True)),
    )


def better_than(example: int, others: dict[str, str]) -> Callable[[Results], Evidence]:
    """An answer to the comparison with levels of other papers: not like with like."""

    def compared(results: Results) -> Evidence:
        r = results[BRACKET[example]]
        told = ", ".join(f"{value} ({name})" for name, value in others.items())
        smallest = min(float(value) for value in others.values())
        return Evidence(
            method="The robust level of others against the true worst-case gain of the filter of this paper.",
            holds=r["upper"] < smallest,
            margin=smallest - r["lower"] if r["upper"] >= smallest else smallest - r["upper"],
            lower=r["lower"],
            upper=r["upper"],
            quantities={
                "robust design with one Lyapunov function": results[ROBUST[example]]["exchange"],
                "duration-weighted gain, upper": results[DURATION[example]]["upper"],
            },
            note=f"The levels of others, {told}, hold for every sequence; the printed one is nominal.",
        )

    return compared


def cited(reason: str) -> Callable[[Results], Evidence]:
    """An answer to a cited value."""

    def not_at_hand(results: Results) -> Evidence:
        return Evidence(method="", not_checkable=reason)

    return not_at_hand


def attenuated(results: Results) -> Evidence:
    """The ratio ||e|| / ||w|| over the draws."""
    r = results[DRAWS]
    ordered = sorted(r["ratios"])
    return Evidence(
        method=f"{r['seeds']} sequences of uniform random periods, the disturbance of the text.",
        holds=ordered[-1] < 1,
        margin=1 - ordered[-1],
        quantities={
            "smallest ratio": ordered[0], "median ratio": ordered[len(ordered) // 2], "largest ratio": ordered[-1],
            "attained worst-case gain": results[BRACKET[2]]["lower"],
        },
        note="Whatever the draw, the error is several times smaller than the disturbance; the worst case is not.",
    )  # fmt: skip


def _level_claims(example: int, section: str) -> tuple[Claim, ...]:
    settled = {1: Verdict.REPRODUCED, 2: Verdict.DIFFERS}
    return (
        Claim(
            id=f"{KEY}.gamma.{example}", place=section, kind=Kind.VALUE, printed=PRINTED_LEVEL[example],
            statement=f"The least level of step 2 in Example {example}.",
            expected=settled[example], answer=nominal_level(example), uses=(NOMINAL[example],),
        ),
        Claim(
            id=f"{KEY}.robust-level.{example}", place=f"{section}; abstract; Sec. VII", kind=Kind.FEASIBLE,
            statement=f"The level of Example {example} holds for all possible variations of the sampling period.",
            expected=Verdict.DIFFERS, answer=guaranteed(example), uses=(BRACKET[example], DURATION[example]),
        ),
        Claim(
            id=f"{KEY}.stable.{example}", place=section, kind=Kind.FEASIBLE,
            statement=f"The error system of Example {example} is robustly stable over the whole range.",
            expected=Verdict.CONSISTENT, answer=robustly_stable(example), uses=(BRACKET[example],),
        ),
    )  # fmt: skip


_CITED = "A level of a paper that is not at hand; its performance index is another one."

CLAIMS: tuple[Claim, ...] = (
    *_level_claims(1, "Sec. VI-A"),
    *_level_claims(2, "Sec. VI-B"),
    Claim(
        id=f"{KEY}.filter.norm", place="Sec. VI-B", kind=Kind.VALUE, printed=data.GAMMA_2,
        statement="The printed filter attains the printed level at the printed grid period.",
        expected=Verdict.REPRODUCED, answer=norm_of_printed_filter, uses=(BRACKET[2], NOMINAL[2]),
    ),
    Claim(
        id=f"{KEY}.filter.state-matrix", place="Sec. VI-B", kind=Kind.MATRIX, printed=data.A_F,
        statement="A_f of the optimal filter.", expected=Verdict.DIFFERS,
        answer=filter_matrix("A"), uses=(NOMINAL[2],),
    ),
    Claim(
        id=f"{KEY}.filter.input-matrix", place="Sec. VI-B", kind=Kind.MATRIX, printed=data.B_F,
        statement="B_f of the optimal filter.", expected=Verdict.DIFFERS,
        answer=filter_matrix("B"), uses=(NOMINAL[2],),
    ),
    Claim(
        id=f"{KEY}.filter.output-matrix", place="Sec. VI-B", kind=Kind.MATRIX, printed=data.C_F,
        statement="C_f of the optimal filter is L.", expected=Verdict.REPRODUCED,
        answer=filter_matrix("C"), uses=(NOMINAL[2],),
    ),
    Claim(
        id=f"{KEY}.filter.second-column", place="Sec. VI-B", kind=Kind.MATRIX, printed=data.A_F_SECOND_COLUMN,
        statement="The second column of A_f is that of Phi(0.05), as in an observer whose sensor sees the first state.",
        expected=Verdict.REPRODUCED, answer=second_column, uses=(NOMINAL[2],),
    ),
    Claim(
        id=f"{KEY}.filter.first-column", place="Sec. VI-B", kind=Kind.MATRIX, printed=data.A_F_FIRST_COLUMN,
        statement="The first column of A_f is that of Phi(0.05) - B_f C: the filter is an observer.",
        expected=Verdict.REPRODUCED, answer=first_column, uses=(NOMINAL[2],), tolerance="0.0001",
        tolerance_reason="B_f is printed to half a unit as well, and enters the difference.",
    ),
    *(
        Claim(
            id=f"{KEY}.cited.13-{name.replace(' ', '-')}", place="Sec. VI-A", kind=Kind.CITED, printed=value,
            statement=f"The level of the {name} filter of reference [13].", expected=Verdict.NOT_CHECKABLE,
            answer=cited(_CITED),
        )
        for name, value in data.GAMMA_13.items()
    ),
    Claim(
        id=f"{KEY}.cited.14", place="Sec. VI-B", kind=Kind.CITED, printed=data.GAMMA_14,
        statement="The level of the filter of reference [14].", expected=Verdict.NOT_CHECKABLE, answer=cited(_CITED),
    ),
    Claim(
        id=f"{KEY}.compare.13", place="Sec. VI-A", kind=Kind.ORDER,
        statement="The filter of Example 1 guarantees a smaller level than both filters of [13].",
        expected=Verdict.DIFFERS, answer=better_than(1, data.GAMMA_13), uses=(BRACKET[1], ROBUST[1], DURATION[1]),
    ),
    Claim(
        id=f"{KEY}.compare.14", place="Sec. VI-B", kind=Kind.ORDER,
        statement="The filter of Example 2 guarantees a smaller level than that of [14].",
        expected=Verdict.DIFFERS, answer=better_than(2, {"[14]": data.GAMMA_14}),
        uses=(BRACKET[2], ROBUST[2], DURATION[2]),
    ),
    Claim(
        id=f"{KEY}.figure.attenuated", place="Fig. 2", kind=Kind.STATISTICAL,
        statement="The disturbance is attenuated in the error.", expected=Verdict.CONSISTENT,
        answer=attenuated, uses=(DRAWS, BRACKET[2]),
    ),
)  # fmt: skip
