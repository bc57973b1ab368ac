"""Claims about the printed gains of the stable plant, by the norm that they achieve, and the size of Theorem 2."""

from __future__ import annotations

from collections.abc import Callable

from papers.okajima2023 import data
from papers.okajima2023.designs import GAIN_SETS, KEY, case, gain_set, pair
from replication.audit.model import Claim, Evidence, Kind, Results, SolverRecord, Verdict


def achieved(equation: str) -> Callable[[Results], Evidence]:
    """An answer: the exact norm of the gains printed in an equation."""

    def norm_of_printed_gains(results: Results) -> Evidence:
        result = results[gain_set(equation)]
        norm, best = result["norm"], result["optimum"]
        return Evidence(
            method="Exact l2-induced norm of the error system (16) with the printed gains.",
            cross_check=f"Theorem 1 certifies {result['theorem1']:.10f} for the same gains.",
            value=norm["value"],
            lower=norm["lower"],
            upper=norm["upper"],
            solvers=tuple(SolverRecord(**record) for record in result["solvers"]),
            quantities={
                "optimum": best,
                "excess over the optimum": norm["value"] - best,
                "effect of rounding the gains": result["rounding_spread"],
                "spectral radius over one period": result["spectral_radius"],
            },
            note=(
                "The optimal gains are not unique, so their entries are not compared: the printed gains are judged by "
                "what they achieve."
            ),
        )

    return norm_of_printed_gains


def unmeasured_columns(results: Results) -> Evidence:
    """Entries of all printed gains on sensors that are not measured at that phase; they must be zero."""
    largest = 0.0
    for periods, offsets, printed in (*GAIN_SETS.values(), ([2, 3], [0, 0], data.GAINS_42)):
        for k, gain in enumerate(data.gains(printed)):
            for row in gain:
                for i, entry in enumerate(row):
                    if (k - offsets[i]) % periods[i]:
                        largest = max(largest, abs(entry))
    return Evidence(
        method="Printed zeros compared with the sensing schedules.",
        holds=largest == 0.0,
        quantities={"largest entry on a sensor that is not measured": largest},
        note="Theorem 2 leaves these columns free; zero is a convention, and without effect in the observer.",
    )


def gains_depend_on_timing(results: Results) -> Evidence:
    """The gains of the first sensor at instant 0 for the three timings; it is measured then in all of them."""
    columns = []
    for theta in range(3):
        columns.append([row[0] for row in results[pair((3, 3), theta)]["gains"][0]])
    differences = [
        max(abs(a - b) for a, b in zip(columns[i], columns[j], strict=True)) for i in range(3) for j in range(i + 1, 3)
    ]
    return Evidence(
        method="Central optimal gains of the three timings, first column at instant 0.",
        holds=min(differences) > 0,
        margin=min(differences),
    )


def decision_variables(results: Results) -> Evidence:
    """Entries of all P_k and Y_k, and gamma."""
    result = results[case("proposed")]
    return Evidence(
        method="Counted: six symmetric P_k of order 3, six Y_k of 3 by 2, and the level.",
        value=float(result["size"]["variables"]),
        quantities={"of which act on the observer": result["acting_variables"]},
    )


def block_size(results: Results) -> Evidence:
    """Rows of the matrix inequality (30) of one phase."""
    return Evidence(
        method="Rows of eq. (30): twice the states, the disturbance and the sensor noise.",
        value=float(results[case("proposed")]["size"]["rows"]),
    )


def cyclic_is_larger(results: Results) -> Evidence:
    """The single inequality of the cyclic reformulation against the N inequalities of Theorem 2."""
    size = results[case("proposed")]["size"]
    return Evidence(
        method="Variables and rows counted for N₁ = 2, N₂ = 3.",
        holds=size["cyclic_rows"] > size["rows"] and size["cyclic_variables"] > size["variables"],
        margin=float(size["cyclic_variables"] - size["variables"]),
        quantities={
            "variables, cyclic": size["cyclic_variables"],
            "variables, Theorem 2": size["variables"],
            "rows, cyclic": size["cyclic_rows"],
            "rows of each inequality, Theorem 2": size["rows"],
        },
        note="A full P is counted for the cyclic form; its rows grow with N, those of Theorem 2 do not.",
    )


_PRINTED = {"33": data.GAMMA_PROPOSED, **{str(38 + theta): printed for theta, printed in data.GAMMA_TIMING.items()}}

CLAIMS: tuple[Claim, ...] = (
    *(
        Claim(
            id=f"{KEY}.gains.eq{equation}",
            place=f"Eq. ({equation})",
            kind=Kind.VALUE,
            statement=f"The gains printed in eq. ({equation}) achieve the level printed beside them.",
            expected=Verdict.REPRODUCED,
            answer=achieved(equation),
            uses=(gain_set(equation),),
            printed=printed,
        )
        for equation, printed in _PRINTED.items()
    ),
    Claim(
        id=f"{KEY}.gains.unmeasured",
        place="Eqs. (33), (38), (39), (40), (42)",
        kind=Kind.FEASIBLE,
        statement="The printed gains are zero wherever a sensor is not measured.",
        expected=Verdict.CONSISTENT,
        answer=unmeasured_columns,
    ),
    Claim(
        id=f"{KEY}.gains.depend-on-timing",
        place="Sec. IV-B",
        kind=Kind.ORDER,
        statement="The gains change with the observation timing.",
        expected=Verdict.CONSISTENT,
        answer=gains_depend_on_timing,
        uses=tuple(pair((3, 3), theta) for theta in range(3)),
    ),
    Claim(
        id=f"{KEY}.size.variables",
        place="Sec. IV-A, before eq. (33)",
        kind=Kind.VALUE,
        statement="Number of decision variables of the matrix inequalities for N₁ = 2 and N₂ = 3.",
        expected=Verdict.REPRODUCED,
        answer=decision_variables,
        uses=(case("proposed"),),
        printed=data.DECISION_VARIABLES,
    ),
    Claim(
        id=f"{KEY}.size.rows",
        place="Sec. IV-A, before eq. (33)",
        kind=Kind.VALUE,
        statement="Rows (and columns) of the matrix inequality of each phase.",
        expected=Verdict.REPRODUCED,
        answer=block_size,
        uses=(case("proposed"),),
        printed=data.BLOCK_SIZE,
    ),
    Claim(
        id=f"{KEY}.size.cyclic-larger",
        place="Sec. I, on the earlier design by cycling",
        kind=Kind.ORDER,
        statement="The single inequality of the cyclic reformulation is larger than those of Theorem 2.",
        expected=Verdict.CONSISTENT,
        answer=cyclic_is_larger,
        uses=(case("proposed"),),
    ),
)
