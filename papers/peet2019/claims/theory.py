"""Claims about the theorems: each as printed and as corrected, on random data; and about the observer they yield."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from papers.peet2019 import data, names
from papers.peet2019.claims.levels import cited
from papers.peet2019.data import KEY
from replication.audit.model import Claim, Evidence, Kind, Results, SolverRecord, Verdict

ROUNDING = 1e-10
"""Residuals of an identity below this are rounding: the data are of size one."""

ROUNDING_ALLOWED: dict[str, Any] = {
    "threshold": ROUNDING,
    "threshold_reason": "An identity holds up to the rounding of quadrature and linear algebra on data of size one.",
}
ACCURATE = 0.01
"""A discretisation is taken as sufficient if the H∞ norm is within one part in a hundred."""


def identity(misprint: str) -> Callable[[Results], Evidence]:
    """An answer: the identity of Sec. VI with one group of terms as printed, and with none."""

    def residuals(results: Results) -> Evidence:
        found = results[names.IDENTITIES]["theorem_3"]
        as_printed, corrected = found[misprint]["median"], found["none"]["largest"]
        method = "Both sides of the identity of Sec. VI for random polynomials, two delays, by quadrature."
        return Evidence(
            method=method,
            holds=corrected < ROUNDING,
            margin=ROUNDING - corrected,
            **ROUNDING_ALLOWED,
            quantities={"largest residual, corrected": corrected, "median residual, as printed": as_printed},
            as_printed=Evidence(
                method=method, holds=as_printed < ROUNDING, margin=ROUNDING - as_printed, **ROUNDING_ALLOWED
            ),
        )

    return residuals


def inverse(part: str) -> Callable[[Results], Evidence]:
    """An answer: Theorem 4 or Lemma 5 as printed and corrected."""

    def residuals(results: Results) -> Evidence:
        found = results[names.INVERSION][part]
        as_printed, corrected = found["printed"]["median"], found["corrected"]["largest"]
        method = "The formulas on random coercive operators with two delays, τ_K ≠ 1, against a numerical inverse."
        return Evidence(
            method=method,
            holds=corrected < ROUNDING,
            margin=ROUNDING - corrected,
            **ROUNDING_ALLOWED,
            quantities={"largest residual, corrected": corrected, "median residual, as printed": as_printed},
            as_printed=Evidence(
                method=method, holds=as_printed < ROUNDING, margin=ROUNDING - as_printed, **ROUNDING_ALLOWED
            ),
        )

    return residuals


def feasible(results: Results) -> Evidence:
    """Theorem 3 with ε > 0 on Example 2: as printed proved to have no solution, corrected one."""
    printed = results[names.PRINTED_SIGNS]["0.001"]
    loop = results[names.loop("ex2")]
    return Evidence(
        method="SDPA on Theorem 3 with ε > 0 for Example 2; the corrected certificate passes a Galerkin check.",
        holds=loop["storage"] > 0.0 and loop["dissipation"] <= 0.0,
        margin=loop["storage"],
        quantities={"least eigenvalue of 𝒫": loop["storage"], "largest eigenvalue of the form": loop["dissipation"]},
        solvers=(SolverRecord(**loop["solver"]),),
        as_printed=Evidence(
            method="As printed, -D ⪰ 0 asks S(-τ) ⪯ 0 while the first condition asks S(-τ) ⪰ ε.",
            holds=not printed["refuted"],
            note="One equality of the program is a sum of non-negative terms that ought to be negative.",
        ),
    )


def achieved(name: str) -> Callable[[Results], Evidence]:
    """An answer: H∞ norm of the closed loop of returned gains against the level of the certificate."""

    def closed_loop(results: Results) -> Evidence:
        found = results[names.loop(name)]
        norm = found["norms"][-1]
        return Evidence(
            method=(
                "H∞ norm of plant and observer of Lemma 5, collocated at "
                f"{found['orders'][-1]} points per history, by the Hamiltonian test."
            ),
            cross_check=f"At {found['orders'][0]} points: {found['norms'][0]:.8f}; no observer is below the optimum.",
            holds=norm <= found["level"],
            margin=found["level"] - norm,
            quantities={
                "norm": norm,
                "level of the certificate": found["level"],
                "optimum": found["optimum"],
                "spectral abscissa [1/s]": found["abscissa"],
                "least eigenvalue of 𝒫": found["storage"],
                "largest eigenvalue of the dissipation form": found["dissipation"],
            },
            solvers=(SolverRecord(**found["solver"]),),
        )

    return closed_loop


def lumped_states(results: Results) -> Evidence:
    """The forward difference with 20 lumped states against collocation."""
    found = results[names.LUMPED]
    error = dict(zip(found["states"], found["relative"], strict=True))[int(data.LUMPED_STATES)]
    return Evidence(
        method="H∞ norm of one closed loop (Example 2) by forward difference and by Chebyshev collocation.",
        holds=abs(error) < ACCURATE,
        margin=ACCURATE - abs(error),
        threshold=ACCURATE,
        threshold_reason="The paper calls the discretisation sufficient and gives no number: one part in a hundred.",
        quantities={
            f"relative error, {count} states": relative
            for count, relative in zip(found["states"], found["relative"], strict=True)
        },
        note="The text does not say how accurate is accurate; one part in a hundred is asked for here.",
    )


def sinc_gain(results: Results) -> Evidence:
    """The range of simulated gains over natural readings of an input that is not specified."""
    scan = [run["gain"] for run in results[names.FIG_1]["scan"]]
    target = float(data.SINC_GAIN)
    return Evidence(
        method="",
        not_checkable=(
            "The sinc input is not specified: shape, centre, horizon and channels are open, and the simulated gain "
            "depends on all of them."
        ),
        quantities={
            "smallest gain of the scan": min(scan),
            "largest gain of the scan": max(scan),
            "closest to the printed gain": min(scan, key=lambda gain: abs(gain - target)),
            "settings scanned": float(len(scan)),
            "gain for sinc(t - τ) on all channels": results[names.FIG_1]["gain"],
        },
    )


def below_level(results: Results) -> Evidence:
    """Every simulated gain is below the level of the certificate."""
    found = results[names.FIG_1]
    largest = max(run["gain"] for run in found["scan"])
    return Evidence(
        method="Simulated gain of the observer at the level of Fig. 1 for every sinc of the scan.",
        holds=largest <= found["level"],
        margin=found["level"] - largest,
        solvers=(SolverRecord(**found["solver"]),),
    )


_IDENTITY = (
    ("d-sign", "theorem-3-signs", "Theorem 3, D", "The blocks of D that hold S_i(-τ_i)."),
    ("f-sign", "theorem-3-signs", "Theorem 3, F_i", "The term of F_i that holds the derivative of S_i."),
    ("e-transposes", "theorem-3-transposes", "Theorem 3, E_i", "The transposes in E_i, Φ_0i and Φ_ji."),
    ("eq10-factor", "eq-10-factor", "Eq. (10)", "The second row of 𝒵 against the blocks of Theorem 3."),
    ("theorem-1-sign", "proof-square", "Sec. VI, proof", "The square of C_1e in the identity that the proof states."),
)

CLAIMS: tuple[Claim, ...] = (
    *(
        Claim(
            id=f"{KEY}.theory.{misprint}",
            place=place,
            kind=Kind.FEASIBLE,
            statement=f"{what} The dissipation is the quadratic form of Theorem 3.",
            expected=Verdict.REPRODUCED_AFTER_ERRATUM,
            answer=identity(misprint),
            uses=(names.IDENTITIES,),
            erratum=f"{KEY}.{erratum}",
        )
        for misprint, erratum, place, what in _IDENTITY
    ),
    Claim(
        id=f"{KEY}.theory.theorem-3-feasible",
        place="Theorem 3",
        kind=Kind.FEASIBLE,
        statement="The condition of Theorem 3 can be met with ε > 0.",
        expected=Verdict.REPRODUCED_AFTER_ERRATUM,
        answer=feasible,
        uses=(names.PRINTED_SIGNS, names.loop("ex2")),
        erratum=f"{KEY}.theorem-3-signs",
    ),
    Claim(
        id=f"{KEY}.theory.theorem-4",
        place="Theorem 4",
        kind=Kind.FEASIBLE,
        statement="The given operator inverts an operator of the form (8).",
        expected=Verdict.REPRODUCED_AFTER_ERRATUM,
        answer=inverse("theorem_4"),
        uses=(names.INVERSION,),
        erratum=f"{KEY}.theorem-4-factors",
    ),
    Claim(
        id=f"{KEY}.theory.lemma-5",
        place="Lemma 5",
        kind=Kind.FEASIBLE,
        statement="The gains of Lemma 5 compose the inverse of Theorem 4 with 𝒵 of (10).",
        expected=Verdict.REPRODUCED_AFTER_ERRATUM,
        answer=inverse("lemma_5"),
        uses=(names.INVERSION,),
        erratum=f"{KEY}.theorem-4-factors",
    ),
    *(
        Claim(
            id=f"{KEY}.loop.{name}",
            place="Sec. I and X",
            kind=Kind.FEASIBLE,
            statement=f"The gains reject disturbances as the bound predicts: {what}.",
            expected=Verdict.CONSISTENT,
            answer=achieved(name),
            uses=(names.loop(name),),
        )
        for name, what in (
            ("ex1", "Example 1"),
            ("ex2", "Example 2 at the level of Fig. 1"),
            ("own-1", "a system of ours with one delay, where the observer matters"),
            ("own-2", "a system of ours with two delays, where the observer matters"),
            ("own-3", "a system of ours with three delays, where the observer matters"),
        )
    ),
    Claim(
        id=f"{KEY}.observer.lumped-states",
        place="Sec. IX-B",
        kind=Kind.ORDER,
        statement="Twenty lumped states are enough for accurate results.",
        expected=Verdict.DIFFERS,
        answer=lumped_states,
        uses=(names.LUMPED,),
    ),
    Claim(
        id=f"{KEY}.fig1.gain",
        place="Sec. X, Example 2",
        kind=Kind.CITED,
        statement="L₂ gain of the simulated error for a sinc disturbance.",
        expected=Verdict.NOT_CHECKABLE,
        answer=sinc_gain,
        uses=(names.FIG_1,),
        printed=data.SINC_GAIN,
    ),
    Claim(
        id=f"{KEY}.fig1.below-level",
        place="Fig. 1",
        kind=Kind.ORDER,
        statement="The simulated gain of the observer stays below its guaranteed level.",
        expected=Verdict.CONSISTENT,
        answer=below_level,
        uses=(names.FIG_1,),
    ),
    Claim(
        id=f"{KEY}.theory.earlier-results",
        place="Sec. X",
        kind=Kind.CITED,
        statement="On the original systems of references [8] and [9] the gains improve by orders of magnitude.",
        expected=Verdict.NOT_CHECKABLE,
        answer=cited("The original systems and gains stand in references [8] and [9], not in this text."),
    ),
)
