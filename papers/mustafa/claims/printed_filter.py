"""Claims of Sec. VI-B on the printed filter: its norm, and its matrices as far as the text determines them."""

from __future__ import annotations

from collections.abc import Callable

from papers.mustafa import data
from papers.mustafa.names import BRACKET, KEY, NOMINAL
from replication.audit.model import Claim, Evidence, Kind, Results, Verdict


def norm_of_printed_filter(results: Results) -> Evidence:
    """Exact norm of the printed filter at the period of its grid."""
    norm = results[BRACKET[2]]["nominal"]
    best = results[NOMINAL[2]]["formula"]
    return Evidence(
        method="Exact H-infinity norm of (5) with the printed filter at the printed grid period.",
        value=norm,
        quantities={"optimum": best, "printed filter over optimum, relative": norm / best - 1},
    )


def filter_matrix(name: str) -> Callable[[Results], Evidence]:
    """An answer: a matrix of the optimal filter."""

    def optimal_filter(results: Results) -> Evidence:
        rows = results[NOMINAL[2]]["filter"][name]
        return Evidence(
            method="Riccati filter at the nominal optimum, which tends to K = Phi Gamma (C Gamma)^-1.",
            value=tuple(tuple(row) for row in rows),
        )

    return optimal_filter


def undetermined(name: str, printed: str) -> Callable[[Results], Evidence]:
    """An answer: two filters keep the printed level and differ in this matrix, so the level does not determine it."""

    def two_filters(results: Results) -> Evidence:
        r, norm, level = results[NOMINAL[2]], results[BRACKET[2]]["nominal"], float(data.GAMMA_2)
        rows, print_ = r["filter"][name], data.matrix(printed)
        apart = max(
            abs(a - b) for row, other in zip(rows, print_, strict=True) for a, b in zip(row, other, strict=True)
        )
        both = "both keep" if max(norm, r["riccati_norm"]) <= level else "do not both keep"
        return Evidence(
            method="Riccati filter at the nominal optimum, beside the printed one.",
            value=tuple(tuple(row) for row in rows),
            quantities={
                "largest difference of an entry": apart,
                "norm of the Riccati filter": r["riccati_norm"],
                "norm of the printed filter": norm,
            },
            not_checkable="The paper gives the filter that it found and calls it neither unique nor optimal. With "
            f"D = 0 the infimum is degenerate: the filter there and the printed one {both} the printed level, and "
            f"differ by up to {apart:.4f} in this matrix. Which one a solver returns depends on where it stops, which "
            "is not stated. What does not depend on it is checked by itself: the norm, A_f "
            "as Phi - B_f C, and C_f.",
        )

    return two_filters


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


CLAIMS: tuple[Claim, ...] = (
    Claim(
        id=f"{KEY}.filter.norm", place="Sec. VI-B", kind=Kind.VALUE, printed=data.GAMMA_2,
        statement="The printed filter attains the printed level at the printed grid period.",
        expected=Verdict.REPRODUCED, answer=norm_of_printed_filter, uses=(BRACKET[2], NOMINAL[2]),
    ),
    Claim(
        id=f"{KEY}.filter.state-matrix", place="Sec. VI-B", kind=Kind.MATRIX, printed=data.A_F,
        statement="A_f of the filter that is found.", expected=Verdict.NOT_CHECKABLE,
        answer=undetermined("A", data.A_F), uses=(NOMINAL[2], BRACKET[2]),
    ),
    Claim(
        id=f"{KEY}.filter.input-matrix", place="Sec. VI-B", kind=Kind.MATRIX, printed=data.B_F,
        statement="B_f of the filter that is found.", expected=Verdict.NOT_CHECKABLE,
        answer=undetermined("B", data.B_F), uses=(NOMINAL[2], BRACKET[2]),
    ),
    Claim(
        id=f"{KEY}.filter.output-matrix", place="Sec. VI-B", kind=Kind.MATRIX, printed=data.C_F,
        statement="C_f of the filter is L, as at the optimum.", expected=Verdict.REPRODUCED,
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
)  # fmt: skip
