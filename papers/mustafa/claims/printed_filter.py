"""Sec. VI-B on the printed filter: its norm, and its matrices as far as the text determines them."""

from __future__ import annotations

from functools import partial

from papers.mustafa.claims.examples import LEVELS as LEVELS  # the levels come first in the text
from papers.mustafa.printed import DATA, GAMMA, matrix
from replication.audit.model import Evidence, Results

PRINTED, COLUMNS = DATA["filter"], DATA["columns-of-A_f"]


@LEVELS.value("filter.norm", GAMMA[2], uses=("bracket.2", "nominal.2"))
def norm_of_printed_filter(results: Results) -> Evidence:
    """The printed filter attains the printed level at the printed grid period."""
    norm, best = results["bracket.2"]["nominal"], results["nominal.2"]["formula"]
    return Evidence(
        method="Exact H-infinity norm of (5) with the printed filter at the printed grid period.",
        value=norm,
        quantities={"optimum": best, "printed filter over optimum, relative": norm / best - 1},
    )


def undetermined(name: str, results: Results) -> Evidence:
    """Two filters keep the printed level and differ in this matrix, so the level does not determine it."""
    r, norm = results["nominal.2"], results["bracket.2"]["nominal"]
    rows, printed = r["filter"][name], matrix(PRINTED[f"{name}_f"])
    apart = max(abs(a - b) for row, other in zip(rows, printed, strict=True) for a, b in zip(row, other, strict=True))
    both = "both keep" if max(norm, r["riccati_norm"]) <= float(GAMMA[2]) else "do not both keep"
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


for name, called in (("A", "state"), ("B", "input")):
    LEVELS.matrix(
        f"filter.{called}-matrix",
        PRINTED[f"{name}_f"],
        statement=f"{name}_f of the filter that is found.",
        uses=("nominal.2", "bracket.2"),
        pinned="not checkable",
    )(partial(undetermined, name))


@LEVELS.matrix("filter.output-matrix", PRINTED["C_f"], uses="nominal.2")
def output_matrix(results: Results) -> Evidence:
    """C_f of the filter is L, as at the optimum."""
    return Evidence(
        method="Riccati filter at the nominal optimum, which tends to K = Phi Gamma (C Gamma)^-1.",
        value=tuple(tuple(row) for row in results["nominal.2"]["filter"]["C"]),
    )


@LEVELS.matrix("filter.second-column", COLUMNS["second"], uses="nominal.2")
def second_column(results: Results) -> Evidence:
    """The second column of A_f is that of Phi(0.05), as in an observer whose sensor sees the first state."""
    # C does not see the second state, so A_f = Phi - B_f C keeps that column.
    column = tuple((row[1],) for row in results["nominal.2"]["Phi"])
    return Evidence(method="Second column of Phi(0.05) by the matrix exponential.", value=column)


@LEVELS.matrix(
    "filter.first-column",
    COLUMNS["first"],
    uses="nominal.2",
    tolerance="0.0001",
    tolerance_reason="B_f is printed to half a unit as well, and enters the difference.",
)
def first_column(results: Results) -> Evidence:
    """The first column of A_f is that of Phi(0.05) - B_f C: the filter is an observer."""
    Phi, B = results["nominal.2"]["Phi"], matrix(PRINTED["B_f"])
    return Evidence(
        method="First column of Phi(0.05) - B_f C, with B_f as printed.",
        value=tuple((r[0] - b[0],) for r, b in zip(Phi, B, strict=True)),
    )
