"""What is assumed where the text leaves a choice: the readings of this paper, by which claims refer to them."""

from __future__ import annotations

from papers._common import MINCX
from papers.mustafa.experiments.draws import LAWS
from papers.mustafa.experiments.levels import ABOVE
from replication.audit.model import Policy, Reading

NOT_NOMINAL = Reading(
    name="every sequence, against Theorem 3 and Sec. V-A",
    place="Abstract; Sec. II, definition of the level; Sec. VII",
    text="The printed level holds over every sampling sequence of (2); or (6) holds with it at all periods of the "
    "range, which by Lemma 1 gives that. Theorem 3 concludes it for the periods of the grid, Sec. V-A says of "
    "Algorithm 1 that it is guaranteed for these only, and Sec. VI-B calls that of Example 2 nominal.",
    policy=Policy.RULED_OUT,
)
SOLVED = Reading(
    name="level that a solver found",
    place="Algorithm 1, step 2; Sec. VI",
    text="Step 2 minimises a level, and the text prints what its solver gave without naming it. It is taken to stop "
    "as mincx does unless told otherwise, by its documentation within 1 % of what it minimises, here γ².",
    policy=Policy.SOLVER,
    accuracy=MINCX,
)
SOME_LEVEL = Reading(
    name="a level, whichever",
    place="Abstract; Sec. II, definition of the level; Sec. VII",
    text="Abstract and Sec. VII say: with a level. By the definition of Sec. II the error system has one if any number "
    "bounds its gain over every sampling sequence of (2); norms count samples. Example 1 prints no filter: ours, at "
    f"1 + {ABOVE:.0e} times the nominal optimum at the middle of the range, stands for it.",
)
GRID_PERIODS = Reading(
    name="periods of the grid",
    place="Theorem 3; Sec. V-A; Sec. VI-B, on the level",
    text="The printed level holds for the sampling periods of the grid only, here the middle of the range, as Theorem "
    "3 says, Sec. V-A of Algorithm 1 and Sec. VI-B of Example 2; stability is for every sequence.",
)
NOMINAL = Reading(
    name="least nominal level",
    place="Secs. VI-A and VI-B; Algorithm 1, step 2; Sec. V-A",
    text="The level is the least that a filter of form (4) has at the one period of the grid, the middle of the range: "
    "what step 2 minimises, and what (6) says without the slips of (10).",
)
OBSERVER_FORM = Reading(
    name="filter as an observer",
    place="Sec. VI-B, A_f",
    text="A_f is Phi - B_f C, as in an observer, with one motor constant: the text does not say so, and Theorem 3 does "
    "not ask for it. Found from the printed filter.",
    inference=True,
)
ONE_ELEMENT = Reading(
    name="grid of one element",
    place="Secs. I, III and VI",
    text="The grid is that of Sec. VI, with the printed level: the middle of the range, by step 0 in Example 1, by "
    "its print in Example 2.",
)
CORRECTED_GRID = Reading(
    name="grid by (9), corrected",
    place="Secs. I and III; eq. (9), case U3; Algorithm 1, steps 3 and 4",
    text="The grid is that of Algorithm 1 with U3 corrected (erratum u3), alpha in both steps and a set-minus in step "
    "4; step 4 is corrected by an inference (erratum algorithm).",
)
STABLE_ONLY = Reading(
    name="valid as stable",
    place="Sec. I, on the idea of [7]; Theorem 3; Sec. V-A",
    text="Valid means that the error system is stable for every sequence: Sec. I calls the idea one of stability "
    "robustness, and Theorem 3 and Sec. V-A keep the level to the periods of the grid.",
)
CONSTANT_CHANGE = Reading(
    name="constant change",
    place="Eq. (8)",
    text="An element covers the periods for which (8) itself holds. Its norm is that of a transfer matrix, so the "
    "change theta of the period is held constant; states in the coordinates of the plant.",
)
ANY_CHANGE = Reading(
    name="any change",
    place="Eq. (8)",
    text="The same, the norm in (8) being the gain for every sequence theta_k, in the modal coordinates of the plant, "
    "in which the small-gain theorem says the same of stability. In the coordinates of the plant it is not evaluated.",
)
BOUND_9 = Reading(
    name="bound (9)",
    place="Algorithm 1, step 3; eq. (9)",
    text="An element covers the interval (9) with alpha as step 3 defines it; U3 corrected (erratum u3), and alpha and "
    "a set-minus in step 4, which is an inference (erratum algorithm).",
)
ENOUGH = Reading(
    name="required as enough",
    place="Sec. III, before (8); Sec. V-A, before (12)",
    text="Required is what the method asks for: where (8) holds, the error system is stable, and where (12) holds too, "
    "at each constant period, it has the level.",
)
NECESSARY = Reading(
    name="required as necessary",
    place="Sec. III, before (8); Sec. V-A, before (12)",
    text="Required is what the aim needs: where (8) fails, the error system is not stable for every sequence, and "
    "where (12) fails at a constant period, it has not the level.",
)
UNION = Reading(
    name="no set-minus",
    place="Algorithm 1, step 4",
    text="Step 4 as the text at hand reads: no sign between the range and the union, taken as one more union; "
    "what lies outside the range is cut off.",
)
SET_MINUS = Reading(
    name="set-minus",
    place="Algorithm 1, step 4",
    text="A set-minus between the range and the union, whose sign may have been lost on the way to the text.",
)
MULTIPLIERS = Reading(
    name="(13) reconstructed",
    place="Sec. V-A, eq. (13)",
    text="Eq. (13) and its fixed scaling are missing from our copy. Reconstructed with one multiplier for each of "
    "equal cells of the range, in modal coordinates.",
)
DRAWN = {
    law: Reading(
        name=f"periods {law}",
        place="Figs. 2 and 3",
        text=f"The text states no law of the sampling periods. Here they are {told}, on the range of Example 2.",
        policy=Policy.OWN,
    )
    for law, told in LAWS.items()
}
"""By law of the periods."""

READINGS = (
    NOT_NOMINAL, SOLVED, SOME_LEVEL, GRID_PERIODS, NOMINAL, OBSERVER_FORM, ONE_ELEMENT, CORRECTED_GRID,
    STABLE_ONLY, CONSTANT_CHANGE, ANY_CHANGE, BOUND_9, ENOUGH, NECESSARY, UNION, SET_MINUS, MULTIPLIERS,
    *DRAWN.values(),
)  # fmt: skip
