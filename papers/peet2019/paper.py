"""The audit of Peet and Gu (2019): its parts, what leads its page, and what is misprinted.

Each misprint has the computation that shows what must be meant.
"""

import math
from functools import partial
from itertools import pairwise
from typing import Any

import msgspec

from papers._common import POSITION, Proofs, Told, common_levels, curve, dots, label, parts_of, signal
from papers.peet2019.claims import cost, examples, gains, theory
from papers.peet2019.claims.theory import GROUPS, SIGNS, UNMET, told_of_symmetry, unmet
from papers.peet2019.experiments.declared import EXPERIMENTS, MOVED
from papers.peet2019.experiments.examples import LATE
from papers.peet2019.experiments.readings import READINGS as RULES
from papers.peet2019.figures import FIGURES
from papers.peet2019.printed import ACCURATE, COLUMNS, DATA, EXAMPLES, JORDAN, MEMORY, SAME
from replication.audit.brief import Draws, Entries, Sketch, Stroke
from replication.audit.declare import contrast, paper
from replication.audit.judge.numerals import at_most
from replication.audit.judge.printed import sensitivities
from replication.audit.model import Proof, Results
from replication.audit.project import about

DIGITS = 7
"""Decimals of a level that the runs bear out."""
WRONG = 1.0
"""A residual at least this large, with data of size one, is no rounding."""
SMALL = 0.01
"""The same for Γ, which is drawn smaller than the other data, so that the operator is coercive."""


def terms(erratum: str, text: str, results: Results) -> Proof:
    """The identity of Sec. VI fails with the terms of an erratum as printed and holds with all of them corrected."""
    cases, misprints = results["identities"], GROUPS[erratum]
    theorem_3 = cases["theorem_3"]
    return contrast(
        f"{cases['trials']} random cases with delays {cases['delays']}: both sides of the identity of Sec. VI agree to "
        f"rounding when all terms are corrected, and do not when one of these is left as printed. {text}",
        {"largest residual, corrected": theorem_3["none"]["largest"]},
        {f"median residual, {name} as printed": theorem_3[name]["median"] for name in misprints},
        wrong=WRONG,
    )


def signs(text: str, results: Results) -> Proof:
    """The identity needs the corrected signs, and with the printed ones no ε > 0 is met."""
    proof = terms(SIGNS, f"{text} {UNMET}", results)
    return msgspec.structs.replace(proof, holds=proof.holds and not unmet(results).holds)


def not_self_adjoint(text: str, results: Results) -> Proof:
    """All that Theorem 1 prints holds, and the error of the observer grows."""
    record = results["self-adjoint"]
    return Proof(
        holds=record["coercive"] > 0.0 > record["largest"] and record["abscissa"] > 0.0,
        text=text,
        quantities=told_of_symmetry(record),
    )


def not_bounded(text: str, results: Results) -> Proof:
    """The value of a history at -τ over its norm in L₂, for hats of decreasing width at that end."""
    ratios = results["value-over-norm"]
    return Proof(
        holds=all(later > (1.0 + WRONG) * earlier for earlier, later in pairwise(ratios.values())),
        text=text,
        quantities={f"value over norm, width {width} s": ratio for width, ratio in ratios.items()},
    )


def of_inverse(part: str, misprint: str, statistic: str, wrong: float, text: str, results: Results) -> Proof:
    """A formula of Theorem 4 or Lemma 5 with one symbol as printed, against the corrected one."""
    residuals = results["inversion"][part]
    return contrast(
        text,
        {"largest residual, corrected": residuals["corrected"]["largest"]},
        {f"{statistic} residual, as printed": residuals[misprint][statistic]},
        wrong=wrong,
    )


def caption(text: str, results: Results) -> Proof:
    """The caption of Fig. 1 against the two systems' gains."""
    level = float(DATA["figure-level"])
    gains = {example: results[f"sos.ex{example}.d3"]["tensor"]["gamma"] for example in ("2", "3")}
    return Proof(
        holds=abs(gains["2"] - level) < 0.005 < abs(gains["3"] - level),
        text=text,
        quantities={
            f"least level of Theorem 3 found, degree 3, Example {example}": round(gain, DIGITS)
            for example, gain in gains.items()
        },
    )


def dimensions(text: str, results: Results) -> Proof:
    """Row counts of C_10 and of e_0 in the examples."""
    sizes = {example: (len(plant["c10"][0]), len(plant["c2"])) for example, plant in EXAMPLES.items()}
    return Proof(
        holds=all(columns != rows for columns, rows in sizes.values()),
        text=text,
        quantities={
            f"Example {example}, {what}": float(value)
            for example, pair in sizes.items()
            for what, value in zip(("columns of C_10", "rows of e_0"), pair, strict=True)
        },
    )


def present_alone(text: str, results: Results) -> Proof:
    """L_0 of Lemma 5 where only the present state is corrected, against P⁻¹Z_0."""
    errors = {"largest difference of L₀ and P⁻¹Z₀": results["inversion"]["present_only"]["l0"]["largest"]}
    return contrast(text, errors, {}, wrong=WRONG)


def limits(text: str, results: Results) -> Proof:
    """Pairs of delays in Example 3 for which the printed limit leaves the history of the other delay."""
    delays = EXAMPLES["3"]["delays"]
    outside = [(left, right) for left in delays for right in delays if left > right]
    short = [(left, right) for left in delays for right in delays if left < right]
    return Proof(
        holds=bool(outside) and bool(short),
        text=text,
        quantities={"pairs that leave it": float(len(outside)), "pairs that miss part": float(len(short))},
    )


def hats(text: str, results: Results) -> Proof:
    """The closed loop of Example 2 with e_i as printed, which is zero for the true history."""
    loop = results["hats"]
    unstable = loop["norm"] is None
    return Proof(
        holds=unstable or loop["norm"] > loop["level"] >= loop["all_gains"],
        text=text,
        quantities={
            "level": loop["level"],
            "H∞ norm with all gains": loop["all_gains"],
            **({} if unstable else {"H∞ norm with e_i = 0": loop["norm"]}),
        },
    )


def coercivity(text: str, results: Results) -> Proof:
    """⟨e, 𝒫e⟩ less that of P − εI and S_i − εI, against both right sides."""
    residuals = results["identities"]["coercive"]
    return contrast(
        text,
        {"largest residual, corrected, ε = 1": residuals["corrected"]["largest"]},
        {"median residual, as printed, ε = 1": residuals["printed"]["median"]},
        wrong=WRONG,
    )


PROOFS: Proofs = {
    "theorem-3-signs": signs,
    "theorem-1-self-adjoint": not_self_adjoint,
    "theorem-1-bounded": not_bounded,
    "theorem-3-coercive": coercivity,
    **{name: partial(terms, name) for name in GROUPS if name != SIGNS},
    "theorem-4-factors": partial(of_inverse, "theorem_4", "square alone", "median", SMALL),
    "theorem-4-square": partial(of_inverse, "theorem_4", "factor alone", "median", WRONG),
    "theorem-4-product": partial(of_inverse, "theorem_4", "squared", "largest", WRONG),
    "lemma-5-index": partial(of_inverse, "lemma_5", "x-index", "largest", WRONG),
    "figure-1-caption": caption,
    "eq-2-dimensions": dimensions,
    "eq-2-l0": present_alone,
    "eq-2-limits": limits,
    "eq-2-hats": hats,
}
"""By the errata of told.toml."""


PAST, NOW = 164, 268
TOLD = Told.read(
    __file__,
    **ACCURATE,
    **JORDAN,
    **dict(zip(("near", "far"), SAME.values(), strict=True)),
    order=DATA["pade-order"],
    memory=MEMORY,
    largest=DATA["largest-product"],
    first=cost.FROM_PRODUCT,
)


def _estimate(x: float) -> float:
    """The estimate of the history, which errs most in its middle."""
    return signal(x) + 8 * math.sin(math.pi * (x - PAST) / (NOW - PAST))


BRIEF = TOLD.brief(
    picture=Entries(
        columns=("degree 1", "degree 2", "degree 3", "Padé"),
        rows=tuple((f"Example {e}", tuple(f"ex{e}.gamma-{column}" for column in COLUMNS)) for e in EXAMPLES),
        text="Least gain bound γ by polynomial degree, which we count per variable. Padé: the paper's comparison.",
    ),
    sketch=Sketch(
        alt="The observer estimates the present state and its history over the delay.",
        strokes=(
            Stroke(draws=Draws.BAND, points=((PAST, 8), (NOW, 8), (NOW, 124), (PAST, 124))),
            curve(Draws.TRUTH),
            curve(Draws.ESTIMATE, _estimate, PAST, NOW),
            dots(Draws.MEASURED, [NOW]),
            label("history", 192, 22),
            label("estimate", 96, 116, Draws.LABEL_OURS),
            label("now", 276, 96, Draws.LABEL_OURS),
            label("delay τ", 192, 142),
        ),
    ),
)


def facts(results: Results) -> dict[str, Any]:
    """The numbers of the sentences that lead the page."""
    roots = [results["roots"]["roots"][f"{JORDAN[name]:g}"] for name in ("jordan-one", "jordan-negative")]
    levels = {e: results[f"sos.ex{e}.d3"]["tensor"]["gamma"] for e in EXAMPLES}
    return {
        "groups": len(theory.GROUPS),
        "of_our_copy": len(theory.OF_OUR_COPY),
        "worst": at_most(max(abs(level / gains.optimum_of(e, results) - 1.0) for e, level in levels.items()), 1),
        "wide": len(gains.conservative(results)) or "no",
        "misses": len(gains.missed(results)),
        "rules": len(RULES),
        "alone": at_most(100 * max(gains.lumped_errors("alone", results).values())),
        "lumped": 100 * max(map(abs, gains.lumped_errors("relative", results).values())),
        "one": JORDAN["jordan-one"],
        "negative": -JORDAN["jordan-negative"],
        "stable": [
            "stable" if ends["largest"] < 0.0 else "unstable" if ends["smallest"] > 0.0 else "unstable for some K"
            for ends in roots
        ],
        "ratio": at_most(cost.largest_ratio(cost.printed_seconds()), 3),
    }


PAPER = paper(
    **about(__file__),
    **TOLD.simple(),
    parts=TOLD.parts(*parts_of(theory, gains, examples, cost)),
    experiments=EXPERIMENTS,
    errata=TOLD.errata(PROOFS),
    figures=TOLD.figures(FIGURES),
    findings=TOLD.findings(facts),
    brief=BRIEF,
    common=lambda results: common_levels(f"L2 {POSITION}", {LATE: results["common"]}),
    sensitivity=lambda results: tuple(
        move for example in MOVED for move in sensitivities(results[f"sensitivity.ex{example}"])
    ),
)
