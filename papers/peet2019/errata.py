"""Misprints of the delay paper: what is printed, what must be meant, and the computation that shows it."""

from __future__ import annotations

from functools import partial

import msgspec

from papers.peet2019.claims.theory import ROUNDING, SIGNS, UNMET, unmet
from papers.peet2019.printed import DATA, EXAMPLES
from replication.audit.model import Erratum, Proof, Results

WRONG = 1.0
"""A residual at least this large, with data of size one, is no rounding."""
CONVERSION = "The slip may be of the text at hand, not of the paper."


def terms(misprints: tuple[str, ...], results: Results, note: str = "") -> Proof:
    """The identity of Sec. VI fails with these terms as printed and holds with all of them corrected."""
    found = results["identities"]
    corrected = found["theorem_3"]["none"]["largest"]
    printed = {name: found["theorem_3"][name]["median"] for name in misprints}
    return Proof(
        holds=corrected <= ROUNDING and all(value >= WRONG for value in printed.values()),
        text=(
            f"{found['trials']} random cases with delays {found['delays']}: both sides of the identity of Sec. VI "
            f"agree to rounding when all terms are corrected, and do not when one of these is left as printed.{note}"
        ),
        quantities={
            "largest residual, corrected": corrected,
            **{f"median residual, {name} as printed": value for name, value in printed.items()},
        },
    )


def signs(results: Results) -> Proof:
    """The identity needs the corrected signs, and with the printed ones no ε > 0 is met."""
    found = terms(("d-sign", "f-sign"), results, note=f" Theorem and proof print them alike. {UNMET}")
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
        quantities={
            "least eigenvalue of the form ⟨e, 𝒫e⟩": found["coercive"],
            "largest eigenvalue of the inequality": found["largest"],
            "spectral abscissa of the error [1/s]": found["abscissa"],
        },
    )


def theorem_4(results: Results) -> Proof:
    """P̂P against the identity, with the factors as printed and corrected."""
    found = results["inversion"]
    quantities = {
        f"{part}, {reading}": found[part][reading]["largest" if reading == "corrected" else "median"]
        for part in ("theorem_4", "lemma_5")
        for reading in ("corrected", "printed")
    }
    return Proof(
        holds=all((value <= ROUNDING) == name.endswith("corrected") for name, value in quantities.items())
        and all(value >= WRONG for name, value in quantities.items() if name.endswith("printed")),
        text="With these factors the product of operator and inverse is the identity, with the printed ones not; both "
        "agree where τ_K = 1.",
        quantities=quantities,
    )


def present_alone(results: Results) -> Proof:
    """L_0 of Lemma 5 where only the present state is corrected, against P⁻¹Z_0."""
    found = results["inversion"]["present_only"]
    return Proof(
        holds=found["l0"]["largest"] <= ROUNDING,
        text="Without Qᵢ the gain of e₀, L₀ in (9) and in Lemma 5, is P⁻¹Z₀, which the text on (3) calls L₁.",
        quantities={"largest difference of L₀ and P⁻¹Z₀": found["l0"]["largest"]},
    )


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


def other_product(part: str, misprint: str, text: str, results: Results) -> Proof:
    """A formula of Theorem 4 or Lemma 5 with one symbol as printed, against the corrected one."""
    found = results["inversion"][part]
    return Proof(
        holds=found["corrected"]["largest"] <= ROUNDING and found[misprint]["largest"] >= WRONG,
        text=text,
        quantities={
            "largest residual, corrected": found["corrected"]["largest"],
            "largest residual, as printed": found[misprint]["largest"],
        },
    )


def caption(results: Results) -> Proof:
    """The caption of Fig. 1 against the two systems' gains."""
    level = float(DATA["figure-level"])
    gains = {example: results[f"sos.ex{example}.d3"]["tensor"]["gamma"] for example in ("2", "3")}
    return Proof(
        holds=abs(gains["2"] - level) < 0.005 < abs(gains["3"] - level),
        text="The level in the caption, one delay of 1 s, is that of System (11); System (12) has two delays.",
        quantities={f"least gain of Example {example}": gain for example, gain in gains.items()},
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


OF_THE_IDENTITY = ("theorem-3-signs", "theorem-3-transposes", "eq-10-factor", "theorem-3-names", "proof-square")
"""The errata that the identity of Sec. VI needs, all together."""

ERRATA: tuple[Erratum, ...] = (
    Erratum(
        id=SIGNS,
        place="Theorem 3, D and F_i; proof, D_1 and F_1i",
        printed="Diagonal blocks S_i(-τ_i) of D, and +dS_i/ds in F_i",
        meant="-S_i(-τ_i), and -dS_i/ds",
        prove=signs,
        uses=("identities", "printed-signs"),
    ),
    Erratum(
        id="theorem-3-transposes",
        place="Theorem 3, D, E_i, Φ_0i and Φ_ji",
        printed=(
            "T_0iᵀ in the row of e_0 of D; E_i = [-Φ_wi 0 Φ_0i .. Φ_Ki]ᵀ with Z_4i C_2 + C_2ᵀZ_3iᵀ in Φ_0i and "
            "Z_5ij C_2 in Φ_ji"
        ),
        meant=(
            "T_0i, as Δ_j in the proof; blocks stacked without the outer transpose: -BᵀQ_i, 0, then Φ with "
            "Z_3i C_2 + C_2ᵀZ_4iᵀ and C_2ᵀZ_5ijᵀ"
        ),
        prove=partial(terms, ("e-transposes", "d-transposes")),
        uses=("identities",),
    ),
    Erratum(
        id="theorem-1-self-adjoint",
        place="Theorem 1",
        printed="Bounded linear operators 𝒫 and 𝒵 such that 𝒫 is coercive",
        meant="𝒫 = 𝒫* too, as in Theorem 4: V = ⟨e, 𝒫e⟩ has the rate of the proof for such 𝒫 alone",
        prove=not_self_adjoint,
        uses=("self-adjoint",),
    ),
    Erratum(
        id="eq-10-factor",
        place="Eq. (10)",
        printed="z_i(s) in the second row; the proof of Theorem 3 has τ_K g_i(s); G_2ij in the proof lacks τ_K",
        meant="The second row is τ_K times the printed one, and G_2ij carries τ_K as in Theorem 3",
        prove=partial(terms, ("eq10-factor", "g2-factor")),
        uses=("identities",),
    ),
    Erratum(
        id="theorem-3-names",
        place="Theorem 3, T_00; proof, D_4",
        printed="Z_1 in T_00, C_0 and C_i in D_4",
        meant="Z_0, as in (10) and D_2; C_10 and C_1i",
        prove=partial(terms, ("z0-name",), note=f" Tried is Z_1 in T_00; the others are names alone. {CONVERSION}"),
        uses=("identities",),
    ),
    Erratum(
        id="proof-square",
        place="Theorem 1, v; Sec. VI, the identity, three times",
        printed="+‖C_1e‖²/γ, beside a form in h that holds v",
        meant="-γ‖v‖² + 2⟨v, C_1e⟩, which equals it for v = C_1e/γ alone; v ∈ R^p, and with it h, not R^q",
        prove=partial(
            terms,
            ("theorem-1-sign",),
            note=" Tried is the square, for every v; that v ∈ R^p is a matter of dimensions.",
        ),
        uses=("identities",),
    ),
    Erratum(
        id="theorem-4-factors",
        place="Theorem 4",
        printed="Inverse {P̂, Q̂/τ_K, Ŝ/τ_K, R̂/τ_K} with Γ in Ĥ and Γ̂",
        meant="Ŝ/τ_K², and Γ/τ_K for Γ; Lemma 5 then holds with the corrected (10)",
        prove=theorem_4,
        uses=("inversion",),
    ),
    Erratum(
        id="theorem-4-product",
        place="Theorem 4, last line",
        printed="P̂P̂x = PP̂x = x",
        meant="P̂Px = PP̂x = x",
        prove=partial(other_product, "theorem_4", "squared", f"P̂P and PP̂ are the identity, P̂P̂ is not. {CONVERSION}"),
        uses=("inversion",),
    ),
    Erratum(
        id="lemma-5-index",
        place="Lemma 5, L_6i",
        printed="X(s)",
        meant="X_i(s)",
        prove=partial(
            other_product,
            "lemma_5",
            "x-index",
            "The gains compose 𝒫⁻¹ and 𝒵 with X_i, and not with that of another delay. " + CONVERSION,
        ),
        uses=("inversion",),
    ),
    Erratum(
        id="figure-1-caption",
        place="Fig. 1, caption",
        printed="System 12",
        meant="System (11)",
        prove=caption,
        uses=("sos.ex2.d3", "sos.ex3.d3"),
        inference=True,
    ),
    Erratum(
        id="eq-2-dimensions",
        place="Eq. (2), last line",
        printed="z_e = C_10 e_0 + ΣC_1i e_i(t - τ_i), with e_0 = C_2x̂ - y",
        meant="z_e = C_10(x̂ - x) + ΣC_1i(φ̂_i(·, -τ_i) - x(t - τ_i)), as in Sec. III",
        prove=dimensions,
    ),
    Erratum(
        id="eq-2-l0",
        place="Eq. (2), and the text below (3)",
        printed="L_1",
        meant="L_0, as in (9) and Lemma 5",
        prove=present_alone,
        uses=("inversion",),
    ),
    Erratum(
        id="eq-2-limits",
        place="Eq. (2), the integral with L_7ij",
        printed="Lower limit -τ_i",
        meant="-τ_j, as in (9)",
        prove=limits,
    ),
    Erratum(
        id="eq-2-hats",
        place="Eq. (2), e_i, and the first line",
        printed="e_i(t + s) = C_2φ_i(t, s) - y(t + s); φ̂(t, -τ_i)",
        meant="e_i(t + s) = C_2φ̂_i(t, s) - y(t + s); φ̂_i(t, -τ_i)",
        prove=hats,
        uses=("hats",),
    ),
)
