"""What is assumed where the paper or the blog leaves a choice."""

from __future__ import annotations

from papers._common import MINCX
from papers.okajima2023.experiments.declared import DIAGONAL_STEP, SECOND_DECIMALS
from papers.okajima2023.experiments.simulations import DENOMINATORS
from papers.okajima2023.method.recovery import DIAGONAL_RANGE
from replication.audit.model import Policy, Reading

PREDICTORS = "observers of form (15)"
CYCLIC_FULL, CYCLIC_BLOCKS = "one full P", "P in blocks"
CENTRAL = "our gains for Cases A to C"
SAME_NOISE = "noise of Sec. IV-A"
OWN_PERIODS, ANY_PERIODS = "each sensor at its own period", "both sensors at any period"
RULE = "all periods, both sensors at instant 0"
RULE_BEST_TIMING = "all periods, each with its best timing"
BLOG_ON_TABLE_1 = "Blog, on Table 1"
RECOVERED_A, SECOND_A, FREE_A = "diagonal in steps", "the other real diagonal", "any entries of A"
RECOVERED_PLANT = "plant found by search"
NOISELESS = DENOMINATORS[1]
"""The text simulates noise of the sensors: to leave it out is no reading."""
DENOMINATOR = dict(
    zip(
        [what for what in DENOMINATORS if what != NOISELESS],
        (
            "energy of d",
            "energy of both sensor noises",
            "energy of d and of noises when measured",
            "energy of d and of noises of sensors used",
            "energy of d and of both sensor noises",
        ),
        strict=True,
    )
)
"""Names of the readings of eq. (34), by denominator."""

_OURS = "Cases A to C run with our central optimal gains, since theirs are not printed."
_ENERGIES = (
    "The denominator of eq. (34) is the energy of d, as in our copy.",
    "The denominator of eq. (34) is the energy of both sensor noises.",
    "The denominator of eq. (34) is the energy of d and of each sensor noise at the instants of measurement.",
    "The denominator of eq. (34) is the energy of d and of the noises of the sensors that the observer uses.",
    "The denominator of eq. (34) is the energy of d⁎ of (17): d and both sensor noises, in all four cases.",
)
_SEARCHED = "All other entries of A are as printed."

READINGS = (
    Reading(
        name=CYCLIC_FULL,
        place="Sec. I, on the earlier design",
        text="The inequality of the earlier article, which is not at hand, is that of Theorem 2 for the cyclic "
        "reformulation, with one full symmetric P.",
    ),
    Reading(
        name=CYCLIC_BLOCKS,
        place="Sec. I, on the earlier design",
        text="The same with a P of one diagonal block for each instant of the period.",
    ),
    Reading(
        name="level that mincx found",
        place="Sec. IV-A, before eq. (33); Table 1",
        text="The text minimises γ with mincx and prints what it gives. By its documentation mincx stops, unless told "
        "otherwise, within 1 % of what it minimises; the inequalities are linear in γ², so within half of that of γ.",
        policy=Policy.SOLVER,
        accuracy=MINCX,
    ),
    Reading(
        name=PREDICTORS,
        place="Sec. IV-A, Cases A to C",
        text="The dual-rate observers have the form (15), as the text after it says: they estimate the state at k + 1 "
        "from measurements up to k. Filters, which use the newest measurement too, are another class.",
    ),
    *(
        Reading(
            name=name,
            place="Eq. (34)",
            text=f"{energy} {_OURS}",
            inference=what != DENOMINATORS[0],
            policy=Policy.OWN,
        )
        for (what, name), energy in zip(DENOMINATOR.items(), _ENERGIES, strict=True)
    ),
    Reading(name=CENTRAL, place="Sec. IV-A, Cases A to C", text=_OURS, policy=Policy.OWN),
    Reading(
        name=SAME_NOISE,
        place="Sec. IV-B, on Figs. 6-8",
        text="Figs. 6-8 are simulated with the gains (38)-(40) and noise as in Sec. IV-A.",
        policy=Policy.OWN,
    ),
    Reading(
        name=RECOVERED_A,
        place="Eq. (41)",
        text=f"The diagonal of A is the one in steps of {DIAGONAL_STEP} from {DIAGONAL_RANGE[0]} to "
        f"{DIAGONAL_RANGE[1]} with which A has the stated poles. {_SEARCHED}",
        inference=True,
    ),
    Reading(
        name=SECOND_A,
        place="Eq. (41)",
        text=f"The diagonal of A is the other real one, not in such steps, with which A has the stated poles, to "
        f"{SECOND_DECIMALS} decimals. {_SEARCHED}",
        inference=True,
    ),
    Reading(
        name=FREE_A,
        place="Sec. IV-C, before eq. (41)",
        text="The text excepts the matrix A, not its diagonal: any entry may differ from Sec. IV-A, and A has the "
        "stated poles. C, B_d and D are those of Sec. IV-A.",
    ),
    Reading(
        name=RECOVERED_PLANT,
        place="Sec. IV-C, eqs. (41) and (42)",
        text="A, C, B_d and D are those that a search finds from the stated poles and the gains (42); other plants may "
        "fit them too.",
        inference=True,
    ),
    Reading(
        name=RULE,
        place=BLOG_ON_TABLE_1,
        text="Beyond Table 1: all pairs of periods, both sensors at instant 0.",
    ),
    Reading(
        name=RULE_BEST_TIMING,
        place=BLOG_ON_TABLE_1,
        text="Beyond Table 1: all pairs of periods, each with its best timing.",
    ),
    Reading(
        name=OWN_PERIODS,
        place="Sec. IV-A, on Figs. 2-5",
        text="The observer that uses more outputs is the proposed one, which reads each sensor at its own period. "
        f"{_OURS}",
        policy=Policy.OWN,
    ),
    Reading(
        name=ANY_PERIODS,
        place="Sec. IV-A, on Figs. 2-5",
        text="Observers that use both outputs are the proposed one and Case C, which reads both every sixth instant. "
        "The text itself prints for Case C a level and a ratio (34) above those of Case B, which uses one.",
        policy=Policy.RULED_OUT,
    ),
)
