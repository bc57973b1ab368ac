"""Misprints of the delay paper, each with the computation that shows what must be meant."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import msgspec

from papers.peet2019.claims.theory import GROUPS, UNMET, told_of_symmetry, unmet
from papers.peet2019.printed import DATA, EXAMPLES
from replication.audit.declare import contrast
from replication.audit.model import Proof, Results

DIGITS = 7
"""Decimals of a level that the runs bear out."""
WRONG = 1.0
"""A residual at least this large, with data of size one, is no rounding."""
CONVERSION = "The slip may be of our copy, not of the paper."
SMALL = 0.01
"""The same for Γ, which is drawn smaller than the other data, so that the operator is coercive."""


def terms(erratum: str, results: Results, note: str = "") -> Proof:
    """The identity of Sec. VI fails with the terms of an erratum as printed and holds with all of them corrected."""
    found, misprints = results["identities"], GROUPS[erratum]
    theorem_3 = found["theorem_3"]
    return contrast(
        f"{found['trials']} random cases with delays {found['delays']}: both sides of the identity of Sec. VI agree to "
        f"rounding when all terms are corrected, and do not when one of these is left as printed.{note}",
        {"largest residual, corrected": theorem_3["none"]["largest"]},
        {f"median residual, {name} as printed": theorem_3[name]["median"] for name in misprints},
        wrong=WRONG,
    )


def signs(results: Results) -> Proof:
    """The identity needs the corrected signs, and with the printed ones no ε > 0 is met."""
    found = terms("theorem-3-signs", results, note=f" Theorem and proof print them alike. {UNMET}")
    return msgspec.structs.replace(found, holds=found.holds and not unmet(results).holds)


def not_self_adjoint(results: Results) -> Proof:
    """All that Theorem 1 prints holds, and the error of the observer grows."""
    found = results["self-adjoint"]
    return Proof(
        holds=found["coercive"] > 0.0 > found["largest"] and found["abscissa"] > 0.0,
        text=(
            "Two states without delays: 𝒫 is coercive and not self-adjoint, the inequality holds, and the error is "
            "unstable. With 𝒫 = 𝒫* the bound (7) follows along solutions with d⟨e, 𝒫e⟩/dt = 2⟨e, 𝒫e′⟩; whether the "
            "text's solutions are such is not checked."
        ),
        quantities=told_of_symmetry(found),
    )


def not_bounded(results: Results) -> Proof:
    """The value of a history at -τ over its norm in L₂, for hats of decreasing width at that end."""
    ratios = results["value-over-norm"]
    return Proof(
        holds=all(later > (1.0 + WRONG) * earlier for earlier, later in pairwise(ratios.values())),
        text="A history that falls from 1 at -τ to 0 within a width d has the norm √(d/3) in L₂: the value over the "
        "norm has no bound as d decreases. So the 𝒵 of (10) is not bounded on Y unless all Z_2i and Z_5ij are zero.",
        quantities={f"value over norm, width {width} s": ratio for width, ratio in ratios.items()},
    )


def of_inverse(part: str, misprint: str, statistic: str, wrong: float, text: str, results: Results) -> Proof:
    """A formula of Theorem 4 or Lemma 5 with one symbol as printed, against the corrected one."""
    found = results["inversion"][part]
    return contrast(
        text,
        {"largest residual, corrected": found["corrected"]["largest"]},
        {f"{statistic} residual, as printed": found[misprint][statistic]},
        wrong=wrong,
    )


FACTORS = (
    "The product of operator and inverse is the identity if both factors are corrected, and not if this one is as "
    "printed; where τ_K = 1 both agree."
)


def caption(results: Results) -> Proof:
    """The caption of Fig. 1 against the two systems' gains."""
    level = float(DATA["figure-level"])
    gains = {example: results[f"sos.ex{example}.d3"]["tensor"]["gamma"] for example in ("2", "3")}
    return Proof(
        holds=abs(gains["2"] - level) < 0.005 < abs(gains["3"] - level),
        text="The text on Example 2, System (11), refers to Fig. 1. The level in its caption, with one delay of 1 s, "
        f"is its own; System (12) has two delays. {CONVERSION}",
        quantities={
            f"least level of Theorem 3 found, degree 3, Example {example}": round(gain, DIGITS)
            for example, gain in gains.items()
        },
    )


def dimensions(results: Results) -> Proof:
    """Row counts of C_10 and of e_0 in the examples."""
    sizes = {example: (len(plant["c10"][0]), len(plant["c2"])) for example, plant in EXAMPLES.items()}
    return Proof(
        holds=all(columns != rows for columns, rows in sizes.values()),
        text="C_10 has n columns, e_0 = C_2x̂ - y has q rows; n ≠ q in Examples 1-3, so C_10e_0 does not exist.",
        quantities={
            f"Example {example}, {what}": float(value)
            for example, pair in sizes.items()
            for what, value in zip(("columns of C_10", "rows of e_0"), pair, strict=True)
        },
    )


def present_alone(results: Results) -> Proof:
    """L_0 of Lemma 5 where only the present state is corrected, against P⁻¹Z_0."""
    found = {"largest difference of L₀ and P⁻¹Z₀": results["inversion"]["present_only"]["l0"]["largest"]}
    text = "Without Qᵢ the gain of e₀, L₀ in (9) and in Lemma 5, is P⁻¹Z₀, which the text on (3) calls L₁."
    return contrast(text, found, {}, wrong=WRONG)


def limits(results: Results) -> Proof:
    """Pairs of delays in Example 3 for which the printed limit leaves the history of the other delay."""
    delays = EXAMPLES["3"]["delays"]
    outside = [(own, other) for own in delays for other in delays if own > other]
    short = [(own, other) for own in delays for other in delays if own < other]
    return Proof(
        holds=bool(outside) and bool(short),
        text=(
            "e_j is a history on [-τ_j, 0], where (9) integrates it. From -τᵢ the integral leaves that interval or "
            f"misses part of it, as soon as two delays differ; counted for Example 3. {CONVERSION}"
        ),
        quantities={"pairs that leave it": float(len(outside)), "pairs that miss part": float(len(short))},
    )


def hats(results: Results) -> Proof:
    """The closed loop of Example 2 with e_i as printed, which is zero for the true history."""
    found = results["hats"]
    unstable = found["norm"] is None
    return Proof(
        holds=unstable or found["norm"] > found["level"] >= found["all_gains"],
        text=(
            "C_2φ_i(t, s) = C_2x(t + s) = y(t + s), so that e_i vanishes if φ_i is the true history. Without the gains "
            f"of e_i the observer of Example 2 exceeds the level that it keeps with them. {CONVERSION}"
        ),
        quantities={
            "level": found["level"],
            "H∞ norm with all gains": found["all_gains"],
            **({} if unstable else {"H∞ norm with e_i = 0": found["norm"]}),
        },
    )


def coercivity(results: Results) -> Proof:
    """⟨e, 𝒫e⟩ less that of P − εI and S_i − εI, against both right sides."""
    found = results["identities"]["coercive"]
    return contrast(
        "By (8) and the inner product of Sec. IV the difference is ετ_K(|x|² + Σ∫|φ_i|²), which is ε‖e‖² where τ_K = 1 "
        "alone. It has no consequence: it is at least ε·min(1, τ_K)·‖e‖², so that 𝒫 is coercive if Corollary 2 holds.",
        {"largest residual, corrected, ε = 1": found["corrected"]["largest"]},
        {"median residual, as printed, ε = 1": found["printed"]["median"]},
        wrong=WRONG,
    )


def _groups(erratum: str, note: str) -> Callable[[Results], Proof]:
    return partial(terms, erratum, note=note)


def _factor(misprint: str, wrong: float, note: str = "") -> Callable[[Results], Proof]:
    return partial(of_inverse, "theorem_4", misprint, "median", wrong, f"{FACTORS} {note}")


PROOFS: dict[str, Callable[[Results], Proof]] = {
    "theorem-3-signs": signs,
    "theorem-1-self-adjoint": not_self_adjoint,
    "theorem-1-bounded": not_bounded,
    "theorem-3-transposes": _groups("theorem-3-transposes", " The proof (E_1i, E_2i, E_3i) prints them right."),
    "theorem-3-row": _groups("theorem-3-row", f" The proof (Δ_j) prints it right. {CONVERSION}"),
    "theorem-3-coercive": coercivity,
    "eq-10-factor": _groups("eq-10-factor", f" Our copy shows no second row of (10). {CONVERSION}"),
    "theorem-3-names": _groups("theorem-3-names", f" (10) and D_2 have the right name. {CONVERSION}"),
    "proof-square": _groups(
        "proof-square", " Tried is the square, for every v; that v ∈ R^p is a matter of dimensions."
    ),
    "theorem-4-factors": _factor("square alone", SMALL, CONVERSION),
    "theorem-4-square": _factor("factor alone", WRONG, CONVERSION),
    "theorem-4-product": partial(
        of_inverse, "theorem_4", "squared", "largest", WRONG,
        f"P̂P and PP̂ are the identity, P̂P̂ is not. {CONVERSION}",
    ),
    "lemma-5-index": partial(
        of_inverse, "lemma_5", "x-index", "largest", WRONG,
        f"The gains compose 𝒫⁻¹ and 𝒵 with X_i, and not with that of another delay. {CONVERSION}",
    ),
    "figure-1-caption": caption,
    "eq-2-dimensions": dimensions,
    "eq-2-l0": present_alone,
    "eq-2-limits": limits,
    "eq-2-hats": hats,
}  # fmt: skip
"""By the errata of told.toml."""
