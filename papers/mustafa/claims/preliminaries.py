"""Sec. III: the lemmas, and the map of the error system as a linear fractional transformation."""

from collections.abc import Callable
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from functools import wraps
from typing import Any

from msgspec.structs import replace

from papers._common import Read
from papers.mustafa.experiments.declared import OF_SECOND
from papers.mustafa.method import AS_PRINTED, Step4
from papers.mustafa.printed import EXAMPLES, GAMMA, upper_end
from replication.audit.declare import Part, positive, rounded
from replication.audit.model import NO_READING, Evidence, Results
from replication.verify.predicate import Predicate, Term, term

LEMMAS = Part("Sec. III, Lemmas 1 to 3, the map below (7)", reading=NO_READING)

FILTER = {1: "our filter next to the nominal optimum (no filter is printed)", 2: "the printed filter"}
"""The filter that an example is about."""
MISNAMED = "motor-constant"
"""The erratum without which A of Example 2 has no value."""
SLIP = {1: None, 2: MISNAMED}
"""What an answer on an example rests on."""
MOTOR_CONSTANT = "K_theta in A of Example 2 is the K_q of the list of values (erratum motor-constant)."
WITH_U3 = "(9) is used with case U3 corrected (erratum u3)."
WITH_SIZE = "(10) is used with F of size n × r too (erratum size-of-F)."


def on_motor(part: Part) -> Part:
    """The part, each of its claims that uses A of Example 2, which the text leaves without a constant, saying so."""
    part.claims[:] = [replace(claim, answer=_noted(claim.answer)) for claim in part.claims]
    return part


def _noted(answer: Callable[[Results], Evidence]) -> Callable[[Results], Evidence]:
    @wraps(answer)
    def noted(results: Results) -> Evidence:
        evidence = answer(read := Read(results))
        return (
            replace(evidence, note=f"{evidence.note} {MOTOR_CONSTANT}".strip()) if OF_SECOND & read.keys() else evidence
        )

    return noted


def stable_room(e: int, results: Results) -> float:
    """How far A is Hurwitz and A_f Schur, whichever is less; the error system is stable iff it is positive.

    The matrix of (5) is block triangular with Phi(h) = e^{hA} and the constant A_f. The Phi commute: a product of them
    is e^{A tau}, tau the elapsed time, and tends to zero for every sequence iff A is Hurwitz.
    """
    bracket = results[f"bracket.{e}"]
    return float(min(-bracket["plant_abscissa"], 1 - bracket["filter_radius"]))


def printed_runs(e: int, results: Results) -> dict[Step4, list[Any]]:
    """The runs of Algorithm 1 with the root that step 4 prints, by what its line does: U3 as printed, and corrected."""
    runs = results[f"grids.{e}"]["algorithm"]
    return {step_4: [runs[form.name] for form in forms] for step_4, forms in AS_PRINTED.items()}


def no_grid(e: int, results: Results) -> Evidence:
    """What Algorithm 1 as printed gives for what needs the grid that it ends with: the number of its elements."""
    method = "Algorithm 1 with the root that step 4 prints, its line read in each way of claim algorithm.1."
    runs = [run for group in printed_runs(e, results).values() for run in group]
    ended = [run for run in runs if run["end"] == "COVERED"]
    if ended:
        return Evidence(method=method, value=float(ended[0]["size"]))
    return Evidence(method=method, not_checkable=NO_GRID)


NO_GRID = (
    "With the root that step 4 prints, its line read in each way of claim algorithm.1, it ends with no grid that "
    "covers the range."
)


def covers_as_step_3_prints(grids: Results) -> bool:
    """Whether the middle alone passes step 3 with alpha as it is printed there, whatever step 4 means."""
    return any(interval["covers"] for name, interval in grids["intervals"].items() if not name.endswith("root"))


def for_both(quantity: str) -> list[Term]:
    """Of the plants of both examples."""
    return [term(quantity, f"example-{e}") for e in EXAMPLES]


def down(number: float, places: int = 4) -> Decimal:
    """A lower bound as the text shows it: rounded, and not above the number."""
    return Decimal(number).quantize(Decimal(10) ** -places, rounding=ROUND_FLOOR)


def times(bound: float, printed: str) -> Decimal:
    """How many times a printed level a lower bound is, to three digits and not more than it is."""
    ratio = bound / float(printed)
    return down(ratio, 2 if ratio < 10 else 1)


def up(number: float, places: int = 4) -> Decimal:
    """An upper bound as the text shows it: rounded, and not below the number."""
    return Decimal(number).quantize(Decimal(10) ** -places, rounding=ROUND_CEILING)


def identity(results: Results, name: str, method: str) -> Evidence:
    """Evidence from the largest residual of an identity over random cases."""
    worst = results["identities"][name]
    return rounded(worst, method=method, quantities={"largest relative residual": worst})


def reordered_map(results: Results, readings: tuple[str, ...], method: str) -> Evidence:
    """Evidence for the map in the right order; as printed, by the least residual over the readings of the print."""
    right, least = results["identities"]["map reordered"], min(results["identities"][name] for name in readings)
    return rounded(
        right,
        method=method,
        quantities={"largest residual, reordered": right},
        as_printed=rounded(least, method="The same, as printed.", quantities={"least residual": least}),
    )


@LEMMAS.feasible("lemma-1", place="Lemma 1", says=term("Lemma 1"))
def lemma_1(results: Results) -> Evidence:
    """If (6) holds at all periods of the range with one P, the error system has the level for every sequence."""
    # One Lyapunov function is the condition of the lemma; a sequence that exceeds its level would refute it.
    rooms = {e: results[f"bracket.{e}"]["common"] - results[f"bracket.{e}"]["lower"] for e in EXAMPLES}
    return positive(
        min(rooms.values()),
        method="Proof: along the error system the form of (6) is the loss of V(x) = x'P^-1 x. Beside it, the level of "
        "one Lyapunov function in each example against the worst sequence found.",
        quantities={f"level less the largest ratio found, Example {e}": room for e, room in rooms.items()},
    )


@LEMMAS.feasible("lemma-2", place="Lemma 2", says=term("Lemma 2"))
def lemma_2(results: Results) -> Evidence:
    """The error system at h_0 + theta is that at h_0 with Delta(theta) in a loop."""
    return identity(
        results,
        "lemma 2",
        "Phi and Gamma at h_0 + theta from both sides, for random plants of two states, periods and changes of either "
        "sign.",
    )


@LEMMAS.feasible("lemma-3", place="Lemma 3", says=term("Lemma 3"))
def lemma_3(results: Results) -> Evidence:
    """For t >= 0 the 2-norm of e^{At} is at most e^{mu(A) t}."""
    return identity(results, "lemma 3", "Largest excess over the bound for random plants of two states and periods.")


@LEMMAS.feasible(
    "finite-grid",
    place="Sec. III, before Lemma 2",
    reading="grid of one element",
    says=[
        Predicate(of=level, relation="more than", to=str(upper_end(GAMMA[e])), reading="grid of one element")
        for e, level in zip(EXAMPLES, for_both("least level of (6)"), strict=True)
    ],
)
def finite_grid_is_not_enough(results: Results) -> Evidence:
    """That (6) holds at a finite grid does not imply, in general, that it holds for all variations of the period."""
    excess = min(results[f"curve.{e}"]["floor"] - upper_end(GAMMA[e]) for e in EXAMPLES)
    floor = results["curve.1"]["floor"]
    return positive(
        excess,
        method="In each example (6) has a solution with the printed level at the one period of the grid, and none with "
        "it at another constant period of the range, by a bound on all filters of form (4): least excess. The value is "
        "that bound in Example 1.",
        value=floor,
        lower=floor,
    )


LEMMAS.cited(
    "cited.7",
    place="Sec. III, before Lemma 2",
    statement="Reference [7] constructs a grid such that (6) holds at all periods if it holds at those of the grid.",
    reason="It reports another paper, which is not at hand. What (6) does here: claim grid-for-6.",
)


@LEMMAS.feasible(
    "grid-for-6",
    place="Sec. III, before Lemma 2",
    reading="grid of one element",
    ours=True,
    pinned="refuted",
    says=[
        Predicate(of=level, relation="at most", to=str(upper_end(GAMMA[e])))
        for e, level in zip(EXAMPLES, for_both("least level of (6)"), strict=True)
    ],
)
def grid_for_6(results: Results) -> Evidence:
    """With the grids and levels of Sec. VI the (6) of this text holds at all periods, as Sec. III says of the idea of
    [7]."""
    excess = {e: results[f"curve.{e}"]["floor"] - upper_end(GAMMA[e]) for e in EXAMPLES}
    return positive(
        -max(excess.values()),
        method="The printed level less the least that (6) allows at one constant period of the range, by a bound on "
        "all filters of form (4); the worse of both examples.",
        quantities={f"the least level there less the printed one, Example {e}": by for e, by in excess.items()},
        note="Sec. V-A says as much: the level is for the periods of the grid. That the error system is stable for all "
        "of them are claims valid.1 and valid.2.",
    )


@LEMMAS.feasible(
    "map",
    place="Sec. III, below (7)",
    erratum="map",
    pinned="reproduced after erratum",
    says=for_both("map of the error system"),
)
def map_of_error_system(results: Results) -> Evidence:
    """The transfer function printed below (7) maps w to e, for a constant change of the period."""
    return reordered_map(
        results,
        ("map as printed", "(12) as printed"),
        "Transfer matrices of random error systems at one point outside the unit circle, constant Delta; the printed "
        "brackets do not balance, so two ways to balance them are tried.",
    )
