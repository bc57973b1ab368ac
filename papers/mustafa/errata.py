"""Misprints of the nonuniform-sampling paper: what is printed, what must be meant, and the computation that shows
it."""

from __future__ import annotations

from papers.mustafa import data
from papers.mustafa.names import CORRECT, EXACT, GRIDS, IDENTITIES, KEY, LITERAL, NOMINAL
from replication.audit.model import Erratum, Proof, Results


def order_of_map(results: Results) -> Proof:
    """The map below (7) as printed and in the right order, against the transfer matrix."""
    r = results[IDENTITIES]
    return Proof(
        holds=r["map reordered"] <= EXACT < r["map as printed"],
        text="Against the transfer matrix at a constant Delta the printed order misses, the other agrees.",
        quantities={"least residual as printed": r["map as printed"], "largest reordered": r["map reordered"]},
    )


def order_of_12(results: Results) -> Proof:
    """The same for (12)."""
    r = results[IDENTITIES]
    return Proof(
        holds=r["map reordered"] <= EXACT < r["(12) as printed"],
        text="With the indices 12 and 21 exchanged the map agrees with the transfer matrix; as printed it does not.",
        quantities={"least residual as printed": r["(12) as printed"], "largest reordered": r["map reordered"]},
    )


def case_u3(results: Results) -> Proof:
    """The upper ends of (9) with both logarithmic norms."""
    ends = {e: results[GRIDS[e]]["intervals"] for e in (1, 2)}
    middle = sum(data.example_2()["periods"]) / 2
    printed = ends[2]["printed, alpha"]["upper"]
    return Proof(
        holds=printed < middle < ends[2]["corrected, alpha"]["upper"]
        and ends[1]["printed, alpha"]["upper"] > ends[1]["corrected, alpha"]["upper"],
        text="Lemma 3 bounds Delta(theta) by (e^{mu(A) theta} - 1)/mu(A). In Example 2 the printed upper end lies "
        "below the middle of the interval; in Example 1 it lies beyond where the bound reaches 1/alpha.",
        quantities={
            f"upper end, Example {e}, {name}": ends[e][f"{name}, alpha"]["upper"]
            for e in ends for name in ("printed", "corrected")
        },
    )  # fmt: skip


def size_of_f(results: Results) -> Proof:
    """F C and B_f = -Y^-1 F must have n rows."""
    n, r = len(data.matrix(data.A_F)), len(data.matrix(data.C_2))
    B_f = data.matrix(data.B_F)
    return Proof(
        holds=n != r and (len(B_f), len(B_f[0])) == (n, r),
        text="The printed B_f = -Y^-1 F has n rows and r columns, so F has.",
        quantities={"n": float(n), "r": float(r)},
    )


def repeated_row(results: Results) -> Proof:
    """The two printed halves of (10) have different numbers of rows; without the repeated one it is the congruence."""
    left, right = data.LMI_LEFT, data.LMI_RIGHT
    residual = results[IDENTITIES]["congruence"]
    return Proof(
        holds=len(right) == len(left) + 1 and len(set(right)) == len(left) and residual <= EXACT,
        text="The right half has one row more than the left one, and one row twice. Without it (10) is the congruence.",
        quantities={"rows, left": float(len(left)), "rows, right": float(len(right)), "largest residual": residual},
    )


def steps_of_algorithm(results: Results) -> Proof:
    """Root and union in step 4: the literal run stalls in both examples, the correct one covers."""
    ends = {e: results[GRIDS[e]]["algorithm"] for e in (1, 2)}
    return Proof(
        holds=all(ends[e][LITERAL]["end"] == "STALLED" and ends[e][CORRECT]["end"] == "COVERED" for e in ends),
        text="With the root or the union of step 4 the run stalls; with alpha and a set-minus it covers the range.",
        quantities={
            f"elements, Example {e}, {name}": float(ends[e][key]["size"])
            for e in ends for name, key in (("literal", LITERAL), ("correct", CORRECT))
        },
    )  # fmt: skip


def motor_constant(results: Results) -> Proof:
    """K_theta stands in A, K_q among the values: with one value for both, the printed second column follows."""
    Phi, printed = results[NOMINAL[2]]["Phi"], data.matrix(data.A_F_SECOND_COLUMN)
    miss = max(abs(row[1] - cell[0]) for row, cell in zip(Phi, printed, strict=True))
    return Proof(
        holds=miss <= 0.00005,
        text="With K_theta = K_q = K_T the second column of Phi(0.05) is that of the printed A_f to its digits.",
        quantities={"largest difference": miss},
    )


ERRATA: tuple[Erratum, ...] = (
    Erratum(
        id=f"{KEY}.map", place="Sec. III, below (7)",
        printed="(Σ22 + Σ12 Δ (I − Σ11 Δ))⁻¹ Σ21", meant="Σ22 + Σ21 Δ (I − Σ11 Δ)⁻¹ Σ12",
        prove=order_of_map, uses=(IDENTITIES,),
    ),
    Erratum(
        id=f"{KEY}.map-12", place="Eq. (12)",
        printed="Σ22 + Σ12 Δ (I − Σ11 Δ)⁻¹ Σ21", meant="Σ22 + Σ21 Δ (I − Σ11 Δ)⁻¹ Σ12",
        prove=order_of_12, uses=(IDENTITIES,),
    ),
    Erratum(
        id=f"{KEY}.u3", place="Theorem 1, case U3",
        printed="h̄ = h₀ + log(1 + α⁻¹ μ(−A)) / μ(A)", meant="h̄ = h₀ + log(1 + α⁻¹ μ(A)) / μ(A)",
        prove=case_u3, uses=(GRIDS[1], GRIDS[2]),
    ),
    Erratum(
        id=f"{KEY}.size-of-F", place="Theorem 3",
        printed="F of size r × n", meant="F of size n × r", prove=size_of_f, uses=(NOMINAL[2],),
    ),
    Erratum(
        id=f"{KEY}.row", place="Eq. (10)",
        printed="the row [−Z 0] twice in the right half", meant="once", prove=repeated_row, uses=(IDENTITIES,),
    ),
    Erratum(
        id=f"{KEY}.algorithm", place="Algorithm 1, step 4",
        printed="√α and a union of (h_l, h_u) with the intervals", meant="α and a set-minus",
        prove=steps_of_algorithm, uses=(GRIDS[1], GRIDS[2]), inference=True,
    ),
    Erratum(
        id=f"{KEY}.motor-constant", place="Sec. VI-B",
        printed="K_θ in A, K_q among the values", meant="one constant, K_θ = K_q = K_T",
        prove=motor_constant, uses=(NOMINAL[2],), inference=True,
    ),
)  # fmt: skip
