"""Claims about the simulations of Sec. IV-A: the four values of eq. (34) and what is read from the figures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from papers.okajima2023 import data
from papers.okajima2023.designs import CASES, KEY, case
from papers.okajima2023.simulations import READINGS, distribution
from replication.audit.model import Claim, Evidence, Kind, Results, Verdict

DRAWS = tuple(f"{KEY}.g-sim-{part}" for part in range(4))
AS_PRINTED, ALL_NOISE = READINGS[0], READINGS[-1]
DENOMINATOR = f"{KEY}.denominator"

WHO = {"proposed": "the proposed observer", "A": "Case A", "B": "Case B", "C": "Case C"}


def all_draws(results: Results) -> dict[str, Any]:
    """The distribution of g_sim over all draws, with the printed values in it."""
    printed = {name: float(text) for name, text in data.G_SIM.items()}
    return distribution([results[name] for name in DRAWS], "proposed", printed)


def ratio(name: str) -> Callable[[Results], Evidence]:
    """An answer: where a printed g_sim lies among many draws, for the printed and the corrected denominator."""

    def printed_ratio_among_draws(results: Results) -> Evidence:
        found = all_draws(results)
        readings = found["cases"][name]["readings"]
        method = (
            f"{found['seeds']} independent draws; two-sided rank of the printed value among them "
            "(denominator over d and both sensor noises)."
        )
        gains = "printed gains (33)" if name == "proposed" else "central optimal gains of ours, none being printed"
        return Evidence(
            method=method,
            cross_check=f"The same draws under all {len(readings)} readings of the denominator; {gains}.",
            probability=readings[ALL_NOISE]["probability"],
            as_printed=Evidence(
                method="The same draws with the denominator as printed, over d alone.",
                probability=readings[AS_PRINTED]["probability"],
            ),
            quantities={
                f"{reading}: {percentile} % percentile": value
                for reading in (AS_PRINTED, ALL_NOISE)
                for percentile, value in readings[reading]["percentiles"].items()
            },
            note="The printed value is one draw with an unknown seed; only its place among many draws can be judged.",
        )

    return printed_ratio_among_draws


def below_level(results: Results) -> Evidence:
    """Each printed g_sim against the exact optimum of its case, which bounds the ratio of every disturbance."""
    margin = min(results[case(name)]["lower"] - float(printed) for name, printed in data.G_SIM.items())
    simulated = min(found["smallest_ratio_to_level"] for found in all_draws(results)["cases"].values())
    return Evidence(
        method="Lower end of the optimum's bracket minus the printed ratio, smallest of four.",
        holds=margin > 0,
        margin=margin,
        quantities={"smallest ratio of level to simulated g_sim over all draws": simulated},
    )


def smallest(results: Results) -> Evidence:
    """The proposed observer has the smallest ratio: among the printed values, and under common draws."""
    printed = {name: float(value) for name, value in data.G_SIM.items()}
    fractions = all_draws(results)["reference_smaller_than"]
    margin = min(min(printed[name] for name in "ABC") - printed["proposed"], min(fractions.values()) - 0.5)
    return Evidence(
        method=(
            "Distance of the printed values; and the fraction of common draws in which the same order holds, above a "
            "half: the smaller of the two."
        ),
        holds=margin > 0,
        margin=margin,
        quantities={f"fraction of draws with a smaller error than Case {name}": f for name, f in fractions.items()},
    )


def lowest_error(results: Results) -> Evidence:
    """Estimation error energy of the proposed observer against the others under common draws."""
    fractions = all_draws(results)["reference_smaller_than"]
    lowest = min(fractions.values())
    return Evidence(
        method="Energy of the estimation error under common noise, counted over all draws.",
        holds=lowest > 0.5,
        margin=lowest - 0.5,
        quantities={f"fraction of draws with a smaller error than Case {name}": f for name, f in fractions.items()},
    )


def truncation(results: Results) -> Evidence:
    """What the sums of eq. (34) leave out after k = 600, against half a unit in the last printed place."""
    cases = all_draws(results)["cases"]
    effect = max(
        found["largest_tail_effect"] * found["readings"][AS_PRINTED]["percentiles"]["100.0"] for found in cases.values()
    )
    half_unit = 0.0005
    return Evidence(
        method="Geometric bound of the tail from e(601) and the spectral radius, largest over cases and draws.",
        holds=effect < half_unit,
        margin=half_unit - effect,
        threshold=half_unit,
        threshold_reason="Half a unit in the last place of the printed ratios, which the tail must not reach.",
        quantities={f"largest |e(601)|, {WHO[name]}": found["largest_final_error"] for name, found in cases.items()},
    )


def _ratios() -> list[Claim]:
    return [
        Claim(
            id=f"{KEY}.gsim.{name.lower()}",
            place="Sec. IV-A, after eq. (34)",
            kind=Kind.STATISTICAL,
            statement=f"The simulated ratio of estimation error to noise for {WHO[name]}.",
            expected=Verdict.REPRODUCED_AFTER_ERRATUM,
            answer=ratio(name),
            uses=DRAWS,
            printed=printed,
            erratum=DENOMINATOR,
        )
        for name, printed in data.G_SIM.items()
    ]


CLAIMS: tuple[Claim, ...] = (
    *_ratios(),
    Claim(
        id=f"{KEY}.gsim.below-level",
        place="Sec. IV-A, after eq. (34)",
        kind=Kind.ORDER,
        statement="Each simulated ratio is below the optimal level of its observer.",
        expected=Verdict.CONSISTENT,
        answer=below_level,
        uses=(*DRAWS, *(case(name) for name in CASES)),
    ),
    Claim(
        id=f"{KEY}.gsim.smallest",
        place="Sec. IV-A, after eq. (34)",
        kind=Kind.STATISTICAL,
        statement="The proposed observer has the smallest simulated ratio of the four.",
        expected=Verdict.CONSISTENT,
        answer=smallest,
        uses=DRAWS,
    ),
    Claim(
        id=f"{KEY}.simulation.lowest-error",
        place="Sec. IV-A, on Figs. 2-5",
        kind=Kind.STATISTICAL,
        statement="The estimation error of the proposed observer is the lowest of the four; using more outputs helps.",
        expected=Verdict.CONSISTENT,
        answer=lowest_error,
        uses=DRAWS,
    ),
    Claim(
        id=f"{KEY}.simulation.truncation",
        place="Sec. IV-A, on eq. (34)",
        kind=Kind.FEASIBLE,
        statement="Summing up to k = 600 is enough, because the error has died out a hundred instants after the noise.",
        expected=Verdict.CONSISTENT,
        answer=truncation,
        uses=DRAWS,
    ),
)
