"""Sec. IV-A, the simulations: the four values of eq. (34) and what is read from Figs. 2-5."""

from __future__ import annotations

from functools import partial
from typing import Any

from papers.okajima2023.cases import CASES, DRAWS, case
from papers.okajima2023.experiments.simulations import READINGS, distribution
from papers.okajima2023.printed import DATA
from replication.audit.declare import Part, below, positive
from replication.audit.model import Evidence, Results

SIMULATION = Part("Sec. IV-A, simulation, eq. (34), Figs. 2-5", figures=("fig2", "fig3", "fig4", "fig5", "worst"))

AS_PRINTED, ALL_NOISE = READINGS[0], READINGS[-1]
DENOMINATOR = "denominator"
WHO = {"proposed": "the proposed observer", "A": "Case A", "B": "Case B", "C": "Case C"}
G_SIM = {name: float(printed) for name, printed in DATA["simulated-ratio"].items()}


def all_draws(results: Results) -> dict[str, Any]:
    """The distribution of g_sim over all draws, with the printed values in it."""
    return distribution([results[name] for name in DRAWS], "proposed", G_SIM)


def printed_ratio_among_draws(name: str, results: Results) -> Evidence:
    """Where a printed g_sim lies among many draws, for the printed and the corrected denominator."""
    found = all_draws(results)
    readings = found["cases"][name]["readings"]
    gains = "printed gains (33)" if name == "proposed" else "central optimal gains of ours, none being printed"
    return Evidence(
        method=(
            f"{found['seeds']} independent draws; two-sided rank of the printed value among them "
            "(denominator over d and both sensor noises)."
        ),
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


for _name, _printed in DATA["simulated-ratio"].items():
    SIMULATION.statistical(
        f"gsim.{_name.lower()}",
        _printed,
        statement=f"The simulated ratio of estimation error to noise for {WHO[_name]}.",
        pinned="reproduced after erratum",
        erratum=DENOMINATOR,
        uses=DRAWS,
    )(partial(printed_ratio_among_draws, _name))


@SIMULATION.order("gsim.below-level", place="Sec. IV-A, after eq. (34)", uses=(*DRAWS, *map(case, CASES)))
def below_level(results: Results) -> Evidence:
    """Each simulated ratio is below the optimal level of its observer."""
    simulated = min(found["smallest_ratio_to_level"] for found in all_draws(results)["cases"].values())
    return positive(
        min(results[case(name)]["lower"] - printed for name, printed in G_SIM.items()),
        method="Lower end of the optimum's bracket minus the printed ratio, smallest of four.",
        quantities={"smallest ratio of level to simulated g_sim over all draws": simulated},
    )


def _smaller(fractions: dict[str, float]) -> dict[str, float]:
    return {f"fraction of draws with a smaller error than Case {name}": f for name, f in fractions.items()}


@SIMULATION.statistical("gsim.smallest", place="Sec. IV-A, after eq. (34)", uses=DRAWS)
def smallest(results: Results) -> Evidence:
    """The proposed observer has the smallest simulated ratio of the four."""
    fractions = all_draws(results)["reference_smaller_than"]
    return positive(
        min(min(G_SIM[name] for name in "ABC") - G_SIM["proposed"], min(fractions.values()) - 0.5),
        method=(
            "Distance of the printed values; and the fraction of common draws in which the same order holds, above a "
            "half: the smaller of the two."
        ),
        quantities=_smaller(fractions),
    )


@SIMULATION.statistical("simulation.lowest-error", place="Sec. IV-A, on Figs. 2-5", uses=DRAWS)
def lowest_error(results: Results) -> Evidence:
    """The estimation error of the proposed observer is the lowest of the four; using more outputs helps."""
    fractions = all_draws(results)["reference_smaller_than"]
    return positive(
        min(fractions.values()) - 0.5,
        method="Energy of the estimation error under common noise, counted over all draws.",
        quantities=_smaller(fractions),
    )


@SIMULATION.feasible("simulation.truncation", place="Sec. IV-A, on eq. (34)", uses=DRAWS)
def truncation(results: Results) -> Evidence:
    """Summing up to k = 600 is enough, because the error has died out a hundred instants after the noise."""
    cases = all_draws(results)["cases"]
    return below(
        max(
            found["largest_tail_effect"] * found["readings"][AS_PRINTED]["percentiles"]["100.0"]
            for found in cases.values()
        ),
        0.0005,
        "Half a unit in the last place of the printed ratios, which the tail must not reach.",
        method="Geometric bound of the tail from e(601) and the spectral radius, largest over cases and draws.",
        quantities={f"largest |e(601)|, {WHO[name]}": found["largest_final_error"] for name, found in cases.items()},
    )
