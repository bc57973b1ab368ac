"""Secs. I and III-VIII: the theorems, each as printed and as corrected, on random data and in closed loops."""

from functools import partial

from papers._common import solvers
from papers.peet2019.experiments.readings import HOUSE
from replication.audit.declare import ROUNDING, Part, positive, rounded
from replication.audit.judge.numerals import short
from replication.audit.model import NO_READING, Evidence, Results, Verdict
from replication.verify.predicate import Predicate, term

ALONG = "solutions with d<e, P e>/dt = 2<e, P e'>"
"""Of which solutions the proof of Theorem 1 speaks."""

CORRECTED = Verdict.REPRODUCED_AFTER_ERRATUM
SIGNS = "theorem-3-signs"
"""The erratum without which Theorem 3 gives no observer and no level."""
UNMET = (
    "As printed, if Corollary 2 holds, -D ⪰ 0 asks S(-τ) ⪯ 0 while the first condition asks S(-τ) ⪰ ε, for any plant."
)
LOOPS = tuple(f"loop.{name}" for name in ("ex1", "ex2", "own-1", "own-2", "own-3"))
"""The closed loops: two of the examples, three systems of ours."""

FRAME = Part(
    "Abstract and Sec. XI",
    reason="They repeat Secs. I and X, which are checked, apart from the Abstract's remark on observability, which "
    "nothing here tests.",
)
FRAME.cited(
    "theory.outperforms",
    place="Abstract",
    statement="Observer-based controllers with these observers can significantly outperform existing approaches.",
    reason="The text designs no observer-based controller, and the designs of others do not stand in it.",
    settled_by="the controllers that the authors have in mind",
    reading=NO_READING,
)
INTRODUCTION = Part(
    "Sec. I",
    reading=NO_READING,
    also=("scaling.desktop", "loop.ex1", "loop.ex2", *(f"ex{name}.not-conservative" for name in "123")),
)
THEOREM_1 = Part(
    "Theorem 1 and the remark after it",
    reading=NO_READING,
    reason="That 𝒫⁻¹ exists and is bounded, which the proof draws from coercivity, is not checked.",
)
THEOREM_3 = Part("Theorem 3, its proof, and eq. (10)", reading=NO_READING)
COROLLARY_2 = Part("Corollary 2", reading=NO_READING)
COROLLARY_2.cited(
    "theory.corollary-2",
    place="Corollary 2",
    statement="The LMIs of Corollary 2 make an operator of the form (8) non-negative.",
    reason="Part 1 defines the cone of polynomials, and is not at hand; what rests on it is given for a stated family "
    "of degree rules, whose certificates are checked one by one.",
    settled_by="Part 1, which has the cone",
)
THEOREM_4 = Part(
    "Theorem 4, Lemma 5 and the first remark after it",
    reading=NO_READING,
    reason="That the inverse maps X into X is not checked, nor the second remark, on reliability and complexity.",
)


@INTRODUCTION.order("theory.lmi-3", place="Sec. I, eq. (3)", says=term("bound (7)", by="LMI (3)"))
def lmi_3(results: Results) -> Evidence:
    """Where LMI (3) holds for P > 0 and Z, the observer with L₁ = P⁻¹Z has a gain of at most γ."""
    record = results["lmi-3"]
    holds = record["storage"] > 0.0
    return positive(
        1.0 - record["largest"] if holds else record["storage"],
        method=f"{record['trials']} random plants of three states, with D: gain of (6), by the Hamiltonian test, "
        "against the least γ at which (3) holds for P and Z.",
        cross_check=f"The form of (3) is that of Theorem 1 to {short(record['form'], 1)}. With the sign of L reversed "
        f"the bound fails in {record['reversed']} cases.",
        quantities={
            "largest gain over γ": record["largest"],
            "smallest gain over γ": record["smallest"],
            "least eigenvalue of all P": record["storage"],
            "cases": float(record["trials"]),
            "cases in which the reversed gain breaks the bound": float(record["reversed"]),
        },
        note="Instances. In general: a completed square, v = C₁e/γ, and an integration, as in Theorem 1's proof.",
    )


def loops_that_meet(results: Results) -> tuple[int, float]:
    """How many closed loops have a certificate that meets the inequality, and their least room below γ, relative."""
    loops = [results[name] for name in LOOPS]
    valid = [loop for loop in loops if loop["storage"] > 0.0 and loop["dissipation"] <= 0.0]
    return len(valid), min((1.0 - loop["norms"][-1] / loop["level"] for loop in valid), default=-1.0)


@THEOREM_1.order(
    "theory.theorem-1",
    place="Theorem 1",
    pinned=CORRECTED,
    erratum="theorem-1-self-adjoint",
    says=Predicate(of=term("bound (7)", along=ALONG)),
)
def theorem_1(results: Results) -> Evidence:
    """Where 𝒫 = 𝒫* is coercive and the inequality holds, (7) bounds the error along solutions with d⟨e, 𝒫e⟩/dt =
    2⟨e, 𝒫ė⟩.
    """
    count, room = loops_that_meet(results)
    return Evidence(
        holds=min(room, 1.0 - results["lmi-3"]["largest"]) > 0.0,
        method=f"{count} closed loops with delays whose certificates meet the inequality on a Galerkin basis, and "
        f"{results['lmi-3']['trials']} random ones without delays: H∞ norm against γ.",
        quantities={
            "loops with delays that meet the inequality": count,
            "least room of our loops below γ, with delays, relative": room,
            "largest gain over γ, without delays": results["lmi-3"]["largest"],
        },
        note="The runs are instances; in general as for LMI (3). That the text's solutions have this derivative is not "
        "checked. The theorem takes 𝒵 as bounded on Y; that of (10) evaluates histories at -τᵢ, which L₂ does not "
        "allow. How the proof carries over is not checked here.",
        as_printed=without_symmetry(results),
    )


def told_of_symmetry(record: Results) -> dict[str, float]:
    """The numbers of the case that is not self-adjoint."""
    return {
        "least eigenvalue of the form ⟨e, 𝒫e⟩": record["coercive"],
        "largest eigenvalue of the inequality": record["largest"],
        "spectral abscissa of the error [1/s]": record["abscissa"],
    }


def without_symmetry(results: Results) -> Evidence:
    """Theorem 1 as printed, which does not ask for 𝒫 = 𝒫*: a case in which the inequality holds and the error grows."""
    record = results["self-adjoint"]
    return positive(
        -record["abscissa"] if record["coercive"] > 0.0 > record["largest"] else 1.0,
        method="Two states without delays, 𝒫 = I + J with a rotation J, 𝒵 = 0: eigenvalues of the inequality and of 𝒜.",
        quantities=told_of_symmetry(record),
    )


@THEOREM_1.order(
    "theory.vanishing-error",
    place="Sec. III, after Theorem 1",
    pinned=CORRECTED,
    erratum="theorem-1-self-adjoint",
    says=Predicate(of=term("error vanishes with w", along=ALONG)),
)
def vanishing(results: Results) -> Evidence:
    """Under the conditions of Theorem 1, with 𝒫 = 𝒫*, the error tends to zero if the disturbance does, along solutions
    with d⟨e, 𝒫e⟩/dt = 2⟨e, 𝒫ė⟩.
    """
    abscissas = {name: results[name]["abscissa"] for name in LOOPS}
    return positive(
        -max(abscissas.values()),
        method="Spectral abscissa of five closed loops with certificates (collocated): if negative, e dies out with w.",
        quantities={f"spectral abscissa, {name} [1/s]": value for name, value in abscissas.items()},
        note="Instances. In general V' ≤ -(ε/c)V + γ‖w‖², with c the norm of 𝒫, makes V, and so ‖e‖, tend to zero "
        "with w.",
        as_printed=without_symmetry(results),
    )


def _residuals(method: str, corrected: float, as_printed: float, errors: dict[str, float], note: str) -> Evidence:
    """An identity holds as corrected, and as printed it does not."""
    quantities = {"largest residual, corrected": corrected, "median residual, as printed": as_printed, **errors}
    printed = rounded(as_printed, method=method)
    return rounded(corrected, method=method, quantities=quantities, note=note, as_printed=printed)


SLIPS = {
    "theorem_4": ("theorem-4-factors", "theorem-4-square"),
    "lemma_5": ("theorem-4-factors", "theorem-4-square", "eq-10-factor", "lemma-5-index"),
}
"""Errata with which Theorem 4 and Lemma 5 are read, all at once; the claim names the first."""


def inverse(part: str, results: Results) -> Evidence:
    """Theorem 4 or Lemma 5 as printed and corrected."""
    record, slips = results["inversion"], SLIPS[part]
    return _residuals(
        f"{record['trials']} random coercive operators, two states, two delays, τ_K ≠ 1, against a numerical inverse; "
        f"integrals are sums over {record['points']} Gauss points per history.",
        record[part]["corrected"]["largest"],
        record[part]["printed"]["median"],
        {
            "largest error of those sums, on K_i": record["quadrature"]["corrected"]["largest"],
            "least eigenvalue of all operators": record["least"],
            "median jump of 𝒫x at s = 0, for constant x": record["jump"]["constants"]["median"],
        },
        note=f"Read with {', '.join(slips[:-1])} and {slips[-1]} together, each a slip that may be of the text at "
        "hand. Cases. Integrals enter the formulas through K_i and T_i alone, which the sums give to rounding."
        + (
            " As printed it is judged with (10) and Theorem 4 as printed; its own formulas are right but for X_i."
            if part == "lemma_5"
            else " The text asks for 𝒫: X → X, which Theorem 3 does not give: its observer has the inverse of a 𝒫 that "
            "need not map X into X. The operators here take constants, which lie in X, out of it, and the formulas "
            "invert them; only that the inverse maps X into X falls with the hypothesis."
        ),
    )


GROUPS = {
    SIGNS: ("d-sign", "f-sign"),
    "theorem-3-transposes": ("e-transposes",),
    "theorem-3-row": ("d-transposes",),
    "eq-10-factor": ("eq10-factor", "g2-factor"),
    "theorem-3-names": ("z0-name",),
    "proof-square": ("theorem-1-sign",),
}
"""Misprints that break the identity of Sec. VI one by one, by erratum."""
OF_OUR_COPY = ("theorem-3-row", "eq-10-factor", "theorem-3-names")
"""Of these errata, what may be slips of our copy."""


@THEOREM_3.feasible(
    "theory.identity",
    place="Eq. (10), Theorem 3 and its proof in Sec. VI",
    pinned=CORRECTED,
    erratum=SIGNS,
    says=term("dissipation identity"),
)
def identity(results: Results) -> Evidence:
    """The quadratic form of Theorem 3 is the one of Theorem 1: the identity of Sec. VI holds."""
    residuals = results["identities"]["theorem_3"]
    medians = {name: residuals[name]["median"] for names in GROUPS.values() for name in names}
    least = min(medians[name] for erratum, names in GROUPS.items() if erratum not in OF_OUR_COPY for name in names)
    return _residuals(
        f"Both sides of the identity of Sec. VI by quadrature, {results['identities']['trials']} random cases with "
        "polynomial data, two states and two delays; as printed: of the misprints that are surely the text's the one "
        "that matters least, alone.",
        residuals["none"]["largest"],
        least,
        {f"median residual, {misprint} as printed": median for misprint, median in medians.items()},
        note="It needs the corrections of the transposes, of τ_K in (10), of names and of the square too.",
    )


@THEOREM_3.feasible(
    "theory.theorem-3-feasible",
    place="Theorem 3",
    pinned=CORRECTED,
    erratum=SIGNS,
    reading=HOUSE,
    says=term("Theorem 3 met", "ex2"),
)
def feasible(results: Results) -> Evidence:
    """The conditions of Theorem 3 can be met with ε > 0, for Example 2."""
    loop = results["loop.ex2"]
    met = loop["storage"] > 0.0 and loop["dissipation"] <= 0.0
    return Evidence(
        method="SDPA on Theorem 3 with ε > 0 for Example 2; the corrected certificate passes a Galerkin check.",
        holds=met,
        margin=loop["storage"] if met else min(loop["storage"], -loop["dissipation"]),
        quantities={"least eigenvalue of 𝒫": loop["storage"], "largest eigenvalue of the form": loop["dissipation"]},
        solvers=solvers(loop),
        as_printed=unmet(results),
    )


@THEOREM_3.order(
    "theory.theorem-3",
    place="Theorem 3",
    pinned=CORRECTED,
    erratum=SIGNS,
    reading=HOUSE,
    says=[
        Predicate(of=term("dissipation identity"), reading=NO_READING),
        Predicate(of=term("bound (7)", along=ALONG), reading=NO_READING),
    ],
)
def theorem_3(results: Results) -> Evidence:
    """Where both forms of Theorem 3, corrected, have the signs that its inclusions are to give them, the error obeys
    ‖z_e‖ ≤ γ‖w‖, along solutions with d⟨e, 𝒫e⟩/dt = 2⟨e, 𝒫ė⟩.
    """
    count, room = loops_that_meet(results)
    residual = results["identities"]["theorem_3"]["none"]["largest"]
    return Evidence(
        holds=room > 0.0 and residual < ROUNDING,
        method=f"Its argument in two steps: the identity of Sec. VI, in {results['identities']['trials']} random "
        f"cases, and the bound of Theorem 1, in {count} closed loops whose certificates meet the conditions.",
        quantities={
            "largest residual of the identity": residual,
            "allowed residual, for rounding": ROUNDING,
            "closed loops that meet the conditions": count,
            "least room of our loops below γ, relative": room,
        },
        note="Both steps are proved in general. Not followed here: Corollary 2, whose cone Part 1 defines, by which "
        "the two inclusions make both forms of one sign; that 𝒫 then has a bounded inverse; and whether the text's "
        "solutions have this derivative. The text has < for ≤, which fails for w = 0 alone.",
        as_printed=Evidence(method=UNMET, not_checkable="Nothing meets its conditions, so it says nothing."),
    )


@INTRODUCTION.feasible("theory.no-gains", place="Sec. I, below eq. (2)", consequence="remark")
def without_gains(results: Results) -> Evidence:
    """With all gains removed the observer (2) is the system (1) without w."""
    record = results["no-gains"]
    return rounded(
        record["gap"],
        method="Matrix of plant and observer with all gains zero, collocated, Example 2: the observer's rows against "
        "the plant's.",
        cross_check=f"With the gains of a certificate the same difference is {record['with_gains']:.2g}.",
        quantities={"largest difference, relative": record["gap"], "the same with gains": record["with_gains"]},
    )


def unmet(results: Results) -> Evidence:
    """Theorem 3 as printed has no solution with ε > 0, and so gives neither observer nor level."""
    return Evidence(
        method=UNMET,
        holds=not results["printed-signs"]["0.001"]["refuted"],
        note="One equality of the program is a sum of non-negative terms that ought to be negative.",
    )


for _place, _statement in {
    "Theorem 4": "The operator that Theorem 4 gives inverts a coercive 𝒫 = 𝒫* of the form (8) with Qᵢ = HᵢZ, Rᵢⱼ = τ_K "
    "ZᵀΓᵢⱼZ.",
    "Lemma 5": "The gains of Lemma 5 compose the inverse of Theorem 4 with 𝒵 of (10), both corrected.",
}.items():
    _part = _place.lower().replace(" ", "-")
    THEOREM_4.feasible(
        f"theory.{_part}",
        place=_place,
        statement=_statement,
        erratum=SLIPS[_part.replace("-", "_")][0],
        says=term("operator identity", part=_part),
    )(partial(inverse, _part.replace("-", "_")))


@THEOREM_4.order(
    "theory.present-only",
    place="Sec. VIII, after Lemma 5",
    says=term("correction of the present state only"),
)
def present_only(results: Results) -> Evidence:
    """With Qᵢ = 0 and Z₃ᵢ to Z₇ᵢⱼ zero as stated there, only the present state is corrected."""
    residuals = results["inversion"]["present_only"]
    return rounded(
        max(residuals["corrected"]["largest"], residuals["l0"]["largest"]),
        method=f"Lemma 5 on {results['inversion']['trials']} random operators: the gains of the histories against "
        "zero, and L₀ against P⁻¹Z₀.",
        cross_check=f"With Qᵢ as drawn the gains of the histories reach {residuals['injected']['largest']:.2g}.",
        quantities={
            "largest gain of a history": residuals["corrected"]["largest"],
            "largest difference of L₀ and P⁻¹Z₀": residuals["l0"]["largest"],
            "largest gain of a history, Qᵢ as drawn": residuals["injected"]["largest"],
        },
        note="L₂ᵢ stays: the present state is also corrected by the output error of time t - τᵢ.",
    )
