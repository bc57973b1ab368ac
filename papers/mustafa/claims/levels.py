"""Claims of Sec. VI: both levels, what they hold for, the levels of others, Figs. 2 and 3."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from papers.mustafa import data
from papers.mustafa.draws import merged
from papers.mustafa.experiments import ABOVE
from papers.mustafa.names import BRACKET, CURVE, DRAWS, DURATION, KEY, NOMINAL, ROBUST
from replication.audit.model import Claim, Evidence, Kind, Results, SolverRecord, Verdict

PRINTED_LEVEL = {1: data.GAMMA_1, 2: data.GAMMA_2}
FILTER = {
    1: f"our filter at the optimum times 1 + {ABOVE:.0e} (the paper prints none)",
    2: "the printed filter",
}
"""The filter that stands for the paper's."""


def solvers(result: dict[str, object]) -> tuple[SolverRecord, ...]:
    """The solver records of an experiment."""
    return tuple(SolverRecord(**record) for record in result["solvers"])  # type: ignore[attr-defined]


def _routes(r: dict[str, Any]) -> tuple[str, dict[str, float]]:
    """The optimum of (10) at one period by three further routes: as text, and relative to the formula."""
    formula = r["formula"]
    told = (
        f"Riccati bisection {r['riccati']:.12f}; LMI {r['lmi']['level']:.12f} ({r['lmi']['status']}), exact norm of "
        f"its filter {r['lmi']['norm']:.12f}."
    )
    return told, {
        "Riccati over formula, relative": r["riccati"] / formula - 1,
        "LMI over formula, relative": r["lmi"]["level"] / formula - 1,
        "LMI through cvxpy over formula, relative": r["printed_lmi"]["level"] / formula - 1,
        "norm of the LMI's filter over formula, relative": r["lmi"]["norm"] / formula - 1,
    }


def _where_it_holds(example: int, results: Results) -> str:
    c = results[CURVE[example]]
    return (
        f"For {FILTER[example]} the level holds, to its printed digits, at constant sampling periods from "
        f"{c['holds_from']:.5f} to {c['holds_to']:.5f} s around the middle {c['middle']:.5f} s of the range."
    )


def nominal_optimum(results: Results) -> Evidence:
    """The optimum of step 2 at the middle of the range of Example 1."""
    r = results[NOMINAL[1]]
    told, relative = _routes(r)
    return Evidence(
        method="Closed form of the optimum of (10) at the one period of the grid.",
        cross_check=told, value=r["formula"], quantities=relative, solvers=solvers(r),
        note=_where_it_holds(1, results),
    )  # fmt: skip


def level_is_found(results: Results) -> Evidence:
    """Whether a filter with the printed level of Example 2 exists at the printed grid period: the printed one."""
    r, norm, printed = results[NOMINAL[2]], results[BRACKET[2]]["nominal"], float(data.GAMMA_2)
    told, relative = _routes(r)
    return Evidence(
        method="Exact H-infinity norm of (5) with the printed filter at the printed grid period, against the level.",
        cross_check=f"Infimum over all filters by closed form {r['formula']:.12f}. {told}",
        value=norm,
        holds=norm <= printed,
        margin=printed - norm,
        quantities={
            "infimum over all filters": r["formula"],
            "printed level over infimum, relative": printed / r["formula"] - 1,
            **relative,
        },
        solvers=solvers(r),
        note="The paper finds a filter with this level and does not call it the least one; step 2 minimises, and the "
        f"infimum is smaller. {_where_it_holds(2, results)}",
    )


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
            note="The abstract, step 3 and Sec. VII read as if the level held for every sequence. Sec. V-A says that "
            "it is nominal, and Sec. VI-B says so of the level of Example 2. "
            f"The bracket is that of {FILTER[example]}. {_where_it_holds(example, results)}",
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


def beside(example: int, others: dict[str, str], remark: str) -> Callable[[Results], Evidence]:
    """An answer to the juxtaposition with levels of other papers: not like with like, and no order is claimed."""

    def compared(results: Results) -> Evidence:
        r = results[BRACKET[example]]
        told = " and ".join(f"{value} ({name})" for name, value in others.items())
        return Evidence(
            method=f"True worst-case gain over all sampling sequences of {FILTER[example]}.",
            value=r["lower"],
            lower=r["lower"],
            upper=r["upper"],
            quantities={
                "robust design with one Lyapunov function, guaranteed": results[ROBUST[example]]["guaranteed"],
                "duration-weighted gain, upper": results[DURATION[example]]["upper"],
            },
            not_checkable=f"The paper sets {PRINTED_LEVEL[example]} and {told} side by side and claims no order. "
            f"{remark} The printed level is nominal; over all sequences the gain of {FILTER[example]} lies between "
            f"{r['lower']:.4f} and {r['upper']:.4f}.",
        )

    return compared


def cited(reason: str) -> Callable[[Results], Evidence]:
    """An answer to a cited value."""

    def not_at_hand(results: Results) -> Evidence:
        return Evidence(method="", not_checkable=reason)

    return not_at_hand


def attenuated(results: Results) -> Evidence:
    """The ratio ||e|| / ||w|| over the draws."""
    r = merged([results[name] for name in DRAWS])
    ordered = sorted(r["ratios"])
    return Evidence(
        method=f"{len(ordered)} sequences of {len(r['k'])} independent periods, uniform in the range, and the one "
        "disturbance of the text. The law and the length are assumptions of ours: the text states neither.",
        holds=ordered[-1] < 1,
        margin=1 - ordered[-1],
        quantities={
            "smallest ratio": ordered[0], "median ratio": ordered[len(ordered) // 2], "largest ratio": ordered[-1],
            "attained worst-case gain": results[BRACKET[2]]["lower"],
        },
        note="Other laws of the periods and other disturbances are not covered: the attained worst case is far larger.",
    )  # fmt: skip


def _level_claims(example: int, section: str) -> tuple[Claim, ...]:
    robust = {1: "Sec. VI-A; abstract; Sec. VII", 2: "abstract; Sec. VII"}
    return (
        Claim(
            id=f"{KEY}.robust-level.{example}", place=robust[example], kind=Kind.FEASIBLE,
            statement=f"The level of Example {example} holds for all possible variations of the sampling period.",
            expected=Verdict.DIFFERS, answer=guaranteed(example),
            uses=(BRACKET[example], DURATION[example], CURVE[example]),
        ),
        Claim(
            id=f"{KEY}.stable.{example}", place=section, kind=Kind.FEASIBLE,
            statement=f"The error system of Example {example} is robustly stable over the whole range.",
            expected=Verdict.CONSISTENT, answer=robustly_stable(example), uses=(BRACKET[example],),
        ),
    )  # fmt: skip


_CITED = {
    13: "A level of a paper that is not at hand; its performance index is in continuous time, as the text says.",
    14: "A level of a paper that is not at hand; the text calls that filter robust and does not say for which index.",
}

CLAIMS: tuple[Claim, ...] = (
    Claim(
        id=f"{KEY}.gamma.1", place="Sec. VI-A", kind=Kind.VALUE, printed=data.GAMMA_1,
        statement="A filter with the printed level is found in Example 1; it is the least level of step 2.",
        expected=Verdict.REPRODUCED, answer=nominal_optimum, uses=(NOMINAL[1], CURVE[1]),
    ),
    *_level_claims(1, "Sec. VI-A"),
    Claim(
        id=f"{KEY}.gamma.2", place="Sec. VI-B", kind=Kind.FEASIBLE, printed=data.GAMMA_2,
        statement="A filter with the printed level is found in Example 2.",
        expected=Verdict.CONSISTENT, answer=level_is_found, uses=(NOMINAL[2], BRACKET[2], CURVE[2]),
    ),
    *_level_claims(2, "Sec. VI-B"),
    *(
        Claim(
            id=f"{KEY}.cited.13-{name.replace(' ', '-')}", place="Sec. VI-A", kind=Kind.CITED, printed=value,
            statement=f"The level of the {name} filter of reference [13].", expected=Verdict.NOT_CHECKABLE,
            answer=cited(_CITED[13]),
        )
        for name, value in data.GAMMA_13.items()
    ),
    Claim(
        id=f"{KEY}.cited.14", place="Sec. VI-B", kind=Kind.CITED, printed=data.GAMMA_14,
        statement="The level of the filter of reference [14].", expected=Verdict.NOT_CHECKABLE,
        answer=cited(_CITED[14]),
    ),
    Claim(
        id=f"{KEY}.compare.13", place="Sec. VI-A", kind=Kind.ORDER,
        statement="The level of Example 1 stands beside those of both filters of [13].",
        expected=Verdict.NOT_CHECKABLE,
        answer=beside(1, data.GAMMA_13, "It remarks that the index of [13] is in continuous time, its own is not."),
        uses=(BRACKET[1], ROBUST[1], DURATION[1]),
    ),
    Claim(
        id=f"{KEY}.compare.14", place="Sec. VI-B", kind=Kind.ORDER,
        statement="The level of Example 2 stands beside that of the robust filter of [14].",
        expected=Verdict.NOT_CHECKABLE,
        answer=beside(2, {"[14]": data.GAMMA_14}, "It notes that its own is based on the nominal condition."),
        uses=(BRACKET[2], ROBUST[2], DURATION[2]),
    ),
    Claim(
        id=f"{KEY}.figure.attenuated", place="Fig. 2", kind=Kind.STATISTICAL,
        statement="The disturbance of the text is attenuated in the error, for sampling periods of a law that is ours.",
        expected=Verdict.CONSISTENT,
        answer=attenuated, uses=(*DRAWS, BRACKET[2]),
    ),
)  # fmt: skip
