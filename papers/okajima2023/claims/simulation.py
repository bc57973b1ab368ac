"""Secs. IV-A and IV-B, the simulations: the four values of eq. (34), and what is read from Figs. 2-5 and 6-8."""

from functools import partial
from typing import Any

from papers._common import outcomes_of
from papers.okajima2023.claims.levels import PREDICTORS, optimum
from papers.okajima2023.experiments.declared import DRAWS, SEEDS, case
from papers.okajima2023.experiments.simulations import DENOMINATORS, distribution
from papers.okajima2023.printed import DATA
from replication.audit.declare import Part, below, positive
from replication.audit.judge.verdict import SMALLEST_PROBABILITY
from replication.audit.model import Evidence, Outcome, Results
from replication.verify.predicate import Predicate

OWN_PERIODS, ANY_PERIODS = "each sensor at its own period", "both sensors at any period"
CENTRAL, SAME_NOISE = "our gains for Cases A to C", "noise of Sec. IV-A"
NOISELESS = DENOMINATORS[1]
"""The text simulates noise of the sensors: to leave it out is no reading."""
READING_OF = {
    "d": "energy of d",
    "w": "energy of both sensor noises",
    "d, w when measured": "energy of d and of noises when measured",
    "d, w of sensors used": "energy of d and of noises of sensors used",
    "d, all w": "energy of d and of both sensor noises",
}
"""Names of the readings of eq. (34), by denominator."""
SIMULATION = Part("Sec. IV-A, simulation, eq. (34), Figs. 2-5", reading=CENTRAL, figures=("rms", "fig2-5", "worst"))

AS_PRINTED, ALL_NOISE = DENOMINATORS[0], DENOMINATORS[-1]
DENOMINATOR = "denominator"
WHO = {"proposed": "the proposed observer", "A": "Case A", "B": "Case B", "C": "Case C"}
G_SIM = {name: float(printed) for name, printed in DATA["simulated-ratio"].items()}


def all_draws(results: Results) -> dict[str, Any]:
    """The distribution of g_sim over all draws, with the printed values in it."""
    return distribution(results[DRAWS], G_SIM)


def printed_ratio_among_draws(name: str, results: Results) -> Evidence:
    """Where a printed g_sim lies among many draws, under each reading of the denominator."""
    record = all_draws(results)
    readings = {what: record["cases"][name]["readings"][what] for what in READING_OF}
    gains = "printed gains (33)" if name == "proposed" else "central optimal gains of ours, none being printed"
    return Evidence(
        method=f"{record['seeds']} independent draws; two-sided rank of the printed value among them "
        "(denominator over d and both sensor noises).",
        cross_check=f"The same draws under all {len(readings)} readings of the denominator; {gains}.",
        outcomes=tuple(
            Outcome(reading=READING_OF[what], holds=row["probability"] >= SMALLEST_PROBABILITY)
            for what, row in readings.items()
        ),
        probability=readings[ALL_NOISE]["probability"],
        draws=record["seeds"],
        as_printed=Evidence(
            method="The same draws with the denominator of our copy, over d alone.",
            probability=readings[AS_PRINTED]["probability"],
            draws=record["seeds"],
        ),
        quantities={
            f"{reading}: {percentile} % percentile": value
            for reading in (AS_PRINTED, ALL_NOISE)
            for percentile, value in readings[reading]["percentiles"].items()
        },
        note=(
            "The printed value is one draw with an unknown seed: only its place among many draws can be judged, and "
            "the denominator was chosen with the four printed values in view. "
            + ("" if name == "proposed" else "Other gains with nearly the same level move this probability much.")
        ),
    )


for _name, _printed in DATA["simulated-ratio"].items():
    SIMULATION.statistical(
        f"gsim.{_name.lower()}",
        _printed,
        statement=f"One simulation gives the printed ratio (34) for {WHO[_name]}.",
        reading=READING_OF[ALL_NOISE],
        erratum=DENOMINATOR,
    )(partial(printed_ratio_among_draws, _name))


@SIMULATION.order(
    "gsim.below-level",
    place="Sec. IV-A, after eq. (34)",
    reading=PREDICTORS,
    says=[
        Predicate(of=optimum(case(name)), relation="more than", to=str(printed))
        for name, printed in DATA["simulated-ratio"].items()
    ],
)
def below_level(results: Results) -> Evidence:
    """Each of the four printed ratios is below the optimal level of its observer."""
    simulated = min(record["smallest_ratio_to_level"] for record in all_draws(results)["cases"].values())
    return positive(
        min(results[case(name)]["lower"] - printed for name, printed in G_SIM.items()),
        method="Lower end of the optimum's bracket minus the printed ratio, smallest of four.",
        quantities={"smallest ratio of the norm to g_sim in our draws, over the energy of d and w": simulated},
        note="The level bounds the ratio to the energy of d⁎ of (17), d and w together, not that to d alone.",
    )


def _smaller(fractions: dict[str, float]) -> dict[str, float]:
    return {f"fraction of draws below Case {name}": fraction for name, fraction in fractions.items()}


@SIMULATION.statistical("gsim.smallest", place="Sec. IV-A, after eq. (34)", reading=READING_OF[AS_PRINTED])
def smallest(results: Results) -> Evidence:
    """The proposed observer has the smallest ratio (34), in print and, by each reading of (34), in most of our
    draws."""
    shares = {what: rows["proposed"] for what, rows in all_draws(results)["smaller_ratio"].items()}
    printed = min(G_SIM[name] for name in "ABC") - G_SIM["proposed"]
    margins = {what: min(printed, min(shares[what].values()) - 0.5) for what in READING_OF}
    return positive(
        min(margins.values()),
        method="Distance of the printed values; and the fraction of common draws in which the same order holds, above "
        f"a half, for each of {len(margins)} denominators: the smallest.",
        outcomes=outcomes_of({READING_OF[what]: margin for what, margin in margins.items()}),
        quantities={
            "distance of the printed values": printed,
            **{f"{what}: {who}": f for what, row in shares.items() for who, f in _smaller(row).items()},
        },
        note="Cases A to C run with our gains. The text simulates noise of the sensors; without it the proposed "
        f"observer has the smaller ratio than Case A in {100 * shares[NOISELESS]['A']:.0f} % of the draws.",
    )


@SIMULATION.statistical("simulation.lowest-error", place="Sec. IV-A, on Figs. 2-5")
def lowest_error(results: Results) -> Evidence:
    """In most of our draws of noise as in Figs. 2-5 the proposed observer has less energy of the error than each other
    case."""
    fractions = all_draws(results)["smaller_energy"]["proposed"]
    return positive(
        min(fractions.values()) - 0.5,
        method="Energy of the estimation error under common noise: least fraction of draws below another case, above a "
        "half.",
        quantities=_smaller(fractions),
    )


@SIMULATION.statistical("order.more-outputs", place="Sec. IV-A, on Figs. 2-5", reading=OWN_PERIODS)
def more_outputs_are_better(results: Results) -> Evidence:
    """Observers that use more outputs have a smaller error (Figs. 2-5)."""
    shares = all_draws(results)["smaller_energy"]
    fractions = {name: shares[name] for name in ("proposed", "C")}
    proposed, both = (min(fractions[more][rival] for rival in "AB") - 0.5 for more in fractions)
    return Evidence(
        method="Energy of the estimation error under common noise: least fraction of draws in which observers that use "
        "both outputs lie below those that use one, above a half.",
        outcomes=outcomes_of({OWN_PERIODS: proposed, ANY_PERIODS: min(proposed, both)}),
        quantities={
            f"fraction of draws, {WHO[more]} below {WHO[rival]}": fractions[more][rival]
            for more in fractions
            for rival in "AB"
        },
        note="Figures 2-5 show one draw each. The sentence follows one on the proposed observer. Of Case C, with both "
        "outputs, the text prints a level and a ratio (34) above those of Case B, with one, so it does not speak of it."
        "",
    )


@SIMULATION.feasible(
    "simulation.truncation",
    place="Sec. IV-A, on eq. (34)",
    statement=f"In none of our {SEEDS} draws does the estimated tail after k = 600 change the ratio (34) by half a "
    "unit of its last printed place.",
)
def truncation(results: Results) -> Evidence:
    """The largest effect of the tail over cases and draws, against half a unit."""
    cases = all_draws(results)["cases"]
    return below(
        max(
            record["largest_tail_effect"] * record["readings"][AS_PRINTED]["percentiles"]["100.0"]
            for record in cases.values()
        ),
        0.0005,
        "Half a unit in the last place of the printed ratios.",
        method="Geometric estimate of the tail from e(601) and the spectral radius, largest over cases and draws.",
        quantities={f"largest |e(601)|, {WHO[name]}": record["largest_final_error"] for name, record in cases.items()},
    )


TIMED = Part("Sec. IV-B, simulations, Figs. 6-8", reading=SAME_NOISE, figures="fig6-8")


@TIMED.statistical(
    "simulation.timing",
    place="Sec. IV-B, last sentence",
    statement="Timing matters for the error: in most of our draws of such noise Case 2 has less of its energy than "
    "each other case.",
)
def least_error_of_timings(results: Results) -> Evidence:
    """How often each timing has the least energy of the error."""
    record = results["timing-draws"]
    names = {name: name.replace("timing-", "Case ") for name in record["least"]}
    return positive(
        min(record["smaller"]["timing-2"].values()) - 0.5,
        method=f"Energy of the estimation error with the gains (38)-(40) under common noise, {record['seeds']} draws: "
        "least fraction in which Case 2 lies below another case, above a half.",
        cross_check="The expected size of the error in the long run, computed without draws, has the same order.",
        quantities={
            **{f"fraction of draws with the least energy, {who}": record["least"][name] for name, who in names.items()},
            **{f"expected size of the error, {who}": record["long_run"][name] for name, who in names.items()},
        },
        note="The text concludes from levels, gains and Figs. 6-8, and names no case here. One draw, as in the "
        "figures, need not have this order.",
    )
