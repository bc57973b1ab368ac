"""Sec. IV-C, the unstable plant: as printed, and with the data that the printed numbers imply."""

import math
from functools import partial

import numpy as np

from papers._common import solvers
from papers.okajima2023.method.recovery import HALF_UNIT_POLE
from papers.okajima2023.printed import DATA, bracketed, poles
from replication.audit.declare import Part, below, positive
from replication.audit.model import NO_READING, Evidence, Kind, Outcome, Results
from replication.errors import AuditError
from replication.verify.predicate import Predicate, Term, term
from replication.verify.subjects import theorems

RECOVERED_A, SECOND_A, FREE_A = "diagonal in steps", "the other real diagonal", "any entries of A"
RECOVERED_PLANT = "plant found by search"
UNSTABLE = Part("Sec. IV-C, unstable plant, gains (42)", reading=RECOVERED_PLANT)

PRINTED, RECOVERED, ALL_DIAGONALS = "unstable.as-printed", "unstable.recovered", "unstable.diagonals"
ANY_ENTRIES, STATED_DESIGNS = "unstable.any-entries", "unstable.stated-designs"
DIAGONAL = "diagonal-of-a"
TIMES = ("periods", "offsets")
FOUND, _ = theorems("okajima2023")
"""With the plants that the search finds, in exact numbers; the certificates are made only if it finds them again."""

SETTLED_BY = "eq. (41) as the authors have it; the program linked from the blog has other plants"


def recovered(quantity: str, *parts: str, of: str = "section-4c-error-poles") -> Term:
    """A number of the plant of Sec. IV-C, with these parts of it as the search for a theorem finds them."""
    return term(quantity, "section-4c", **{name: FOUND[of].parameters[name] for name in parts})


STATED = poles(DATA["poles"])


def as_stated(spectrum: list[list[float]]) -> bool:
    """Whether poles, one of each pair, are those of A within half a unit of each part; in the same order."""
    return bool(np.all(np.abs(np.subtract(spectrum, STATED)) <= HALF_UNIT_POLE))


def radius_of(spectrum: list[list[float]]) -> float:
    """The largest modulus of some poles."""
    return max(float((real**2 + imaginary**2) ** 0.5) for real, imaginary in spectrum)


# What the text says of a matrix that our copy lacks. One that is chosen to give a number does not test that number.


def lacking(text: str, results: Results) -> Evidence:
    """That our copy lacks the matrix A of Sec. IV-C, beside what its print and the plant found by search give.

    Raises AuditError if the A that our copy prints has the stated poles: then it is not lacking.
    """
    printed, gains = results[PRINTED], results[RECOVERED]["gains"]
    if as_stated(printed["poles"]):
        raise AuditError("the matrix of eq. (41) has the stated poles; judge the claims on it by that matrix")
    return Evidence(
        method="",
        not_checkable=f"Our copy lacks the matrix A of Sec. IV-C: eq. (41) repeats that of Sec. IV-A. {text}",
        settled_by=SETTLED_BY,
        quantities={
            "largest pole of A as printed, modulus": radius_of(printed["poles"]),
            "spectral radius of A_e, A as printed": radius_of(printed["error_poles"]),
            "norm of the gains over the optimum, plant found by search": gains["norm"] / gains["optimum"],
        },
    )


FITTED = "One that is chosen to have these poles, as ours are, does not test them."
for _name, _printed, _place, _statement, _told in (
    ("poles", DATA["poles"], "", "The poles of the matrix A of Sec. IV-C.", FITTED),
    (
        "is-unstable",
        "",
        "Sec. IV-C, after eq. (41)",
        "The matrix A of Sec. IV-C has a pole outside the unit circle.",
        "With the stated poles it has; as our copy prints it, it has none.",
    ),
    (
        "gains-optimal",
        "",
        "Eq. (42)",
        "The gains (42) solve the minimisation of Theorem 2 for the plant of Sec. IV-C.",
        "No level is printed either. For one plant, found by search, they are nearly optimal (claim "
        "unstable.one-plant).",
    ),
    ("error-poles", DATA["error-poles"], "", "The poles of A_e with the gains (42).", FITTED),
):
    UNSTABLE.claim(
        Kind.VALUE if _printed else Kind.FEASIBLE,
        f"unstable.{_name}",
        _printed,
        place=_place,
        statement=_statement,
        pinned="undetermined",
        reading=NO_READING,
    )(partial(lacking, _told))


@UNSTABLE.feasible(
    "unstable.stabilised",
    place="Sec. IV-C, before eq. (41) and after eq. (42)",
    erratum=DIAGONAL,
    pinned="undetermined",
    reading=FREE_A,
    says=[
        Predicate(of=recovered("stable error system", *TIMES, part, of=name), reading=reading)
        for reading, part, name in (
            (FREE_A, "A", "section-4c-free-setting"),
            (RECOVERED_A, "diagonal", "section-4c-same-setting"),
            (SECOND_A, "diagonal", "section-4c-second-setting"),
        )
    ],
)
def stabilised(results: Results) -> Evidence:
    """With an A that has the stated poles, and all else as in Sec. IV-A, the gains (42) stabilise the error system."""
    free, printed = results[ANY_ENTRIES], radius_of(results[PRINTED]["error_poles"])
    fits = as_stated(free["poles"])
    record = results[ALL_DIAGONALS]
    diagonals = radius_of(results[RECOVERED]["outputs"]["error_poles_printed_C"]), record["found"][1]["radius"]
    radii = {FREE_A: free["radius"] if fits else math.inf, RECOVERED_A: diagonals[0], SECOND_A: diagonals[1]}
    return Evidence(
        method="Spectral radius over one period of A_e with such an A, the C of Sec. IV-A and the gains (42).",
        cross_check=f"{len(record['found'])} real diagonals have the stated poles exactly; at {record['moved']} points "
        "of the rounding of these poles the radius is never below "
        f"{min(row['least_radius'] for row in record['found']):.3f}.",
        outcomes=tuple(
            Outcome(reading=name, holds=radius < 1, margin=1 - radius if math.isfinite(radius) else None)
            for name, radius in radii.items()
        ),
        as_printed=positive(1 - printed, method="The same with A as printed."),
        settled_by=SETTLED_BY,
        quantities={
            "other entries free, furthest entry of A from its print": free["furthest"],
            **{
                f"other entries free, pole of A_e {i + 1}, before A is rounded": pole[0]
                for i, pole in enumerate(free["error_poles"])
            },
            "spectral radius, A as printed": printed,
        },
        note=f"The text excepts A and says no more. A = {bracketed(free['rounded'])} has the stated poles and is "
        "stabilised; there A_e has the stated poles too, before A is rounded. It is one of many, found for the "
        "purpose, and no proposal of what was meant. Of the real diagonals that give A the stated poles "
        "none is stabilised: proved at one plant near each, and so at the points tried of the rounding.",
    )


@UNSTABLE.feasible(
    "unstable.one-plant",
    place="Sec. IV-C",
    ours=True,
    says=[
        Predicate(of=recovered("poles", "diagonal"), relation="is", to=str(DATA["poles"]), reading=RECOVERED_A),
        recovered("stable error system", *TIMES, "diagonal", "C"),
    ],
)
def one_plant(results: Results) -> Evidence:
    """A plant found by search, of which C differs too, has the stated poles, and the gains (42) stabilise A_e."""
    search = results[RECOVERED]
    state, outputs, inputs, attained = (search[name] for name in ("state", "outputs", "inputs", "attained"))
    same = search["printed_inputs"]["norm"] / search["printed_inputs"]["optimum"] - 1
    room = 1 - radius_of(outputs["error_poles"])
    fits = as_stated(state["poles_recovered"])
    return Evidence(
        method="Eigenvalues of A with the diagonal found, and the spectral radius over one period of A_e with the "
        "gains (42) and the C found.",
        cross_check=f"Of {outputs['tried']} integer matrices C with entries of size up to {outputs['bound']}, "
        f"{outputs['fits']} explains the stated poles of A_e by rounding of the gains (linearised). With entries up to "
        f"{search['wider']['bound']} there are {search['wider']['fits']}, and this one "
        f"{'stays' if search['wider']['C'] == outputs['C'] else 'is not'} the nearest.",
        holds=fits and room > 0,
        margin=room if fits else None,
        quantities={
            "misfit of the poles, best C": outputs["best_misfit"],
            "misfit of the poles, second C": outputs["second_misfit"],
            "change of the gains that gives the stated poles of A_e": attained["largest_change"],
            "half a unit in the last place of the gains": attained["half_unit"],
            "excess of the gains over the optimum": inputs["best_excess"],
            "excess for the second best B_d and D": inputs["second_excess"],
            "excess for those of Sec. IV-A": same,
            "largest difference of the entries": inputs["largest_gain_difference"],
        },
        note=f"A has the diagonal {tuple(state['fits'][0])}, C = {bracketed(outputs['C'])}, B_d = "
        f"{bracketed(inputs['B_d'])}, D = {bracketed(inputs['D'])}. For it all printed gains are within "
        f"{inputs['largest_gain_difference']:.1g} of those of one optimal design. Of {inputs['tried']} pairs on a "
        "grid, this B_d with this D makes the printed gains nearest to optimal; only the ratio of B_d to D is "
        "identifiable, up to a sign. With B_d and D of Sec. IV-A the norm of the gains exceeds the optimum by "
        f"{100 * same:.1f} %. The text says that all but A is as in Sec. IV-A, so this is no correction. Not tested: "
        "whether an A that differs off its diagonal, with C, B_d and D as printed, makes the gains near-optimal.",
    )


@UNSTABLE.feasible(
    "unstable.designable",
    place="Sec. IV-C, last sentence",
    erratum=DIAGONAL,
    pinned="compatible",
    reading=FREE_A,
    says=[
        quantity
        for name in ("section-4c-design", "section-4c-second-design", "section-4c-free-design")
        for quantity in (
            recovered("design by Theorem 2", *TIMES, "A", "B_d", "D", of=name),
            recovered("unstable plant", "A", of=name),
        )
    ],
)
def designable(results: Results) -> Evidence:
    """Theorem 2 designs an observer for each unstable A tried that has the stated poles, all else as in Sec. IV-A."""
    designs = results[STATED_DESIGNS]
    excess = max(design["reduced_lmi"]["norm"] / design["optimum"] - 1 for design in designs.values())
    fit = all(as_stated(design["poles"]) for design in designs.values())
    least = min(radius_of(design["poles"]) for design in designs.values())
    return below(
        excess if fit and least > 1 else 1.0,
        1e-7,
        "Relative distance from the optimum at which a design counts as optimal.",
        method="Exact norm of the gains of Theorem 2 (reduced form) relative to the exact optimum, for each A tried: "
        "both diagonals with the stated poles, and an A that differs elsewhere. Largest.",
        solvers=solvers(*designs.values()),
        quantities={f"optimum, {name}": design["optimum"] for name, design in designs.items()},
        note="The A that our copy prints is stable: a design for it would not bear the sentence out.",
    )
