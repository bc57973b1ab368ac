"""What the text leaves open, and the assumptions made for it: names, places and words of all readings."""

from __future__ import annotations

from typing import Any

from papers.peet2019.experiments.readings import HOUSE
from papers.peet2019.experiments.readings import READINGS as RULES
from papers.peet2019.printed import DATA
from replication.audit.model import Policy, Reading

JORDAN = {
    "jordan-negative": -1.0,
    "jordan-zero": 0.0,
    "jordan-one": 1.0,
    "jordan-large": 8.0,
}
"""Eigenvalues of the Jordan block of Example 4 that are tried."""
PADE, SINC = "pade-square", "sinc"
OWN_B, POSITIVE = "own-b", "positive-epsilon"
"""B replaced by ours; and Theorem 3 with an ε > 0, which it leaves open."""
ACCURATE = {"lumps-1-percent": 0.01, "lumps-10-percent": 0.1}
"""Relative errors of the H∞ norm that count as accurate."""
ALONE = "lumps-observer-alone"
DESKTOP, MEMORY, DAY = "desktop", 16.0, 86400.0
"""A desktop computer: memory in GB, and seconds that a run may take."""
SAME = {"cost-factor-1.5": 1.5, "cost-factor-2": 2.0}
"""Printed seconds whose ratio is below this count as approximately the same."""
SAME_WEIGHTED = "; the weighted term the same"
BESIDES = {
    **dict.fromkeys(("z2-outer", "z2-inner", "z2-total-next"), SAME_WEIGHTED),
    "z2-total-z1": " and Z₂ of degree d in each variable" + SAME_WEIGHTED,
}
"""What the words of these degree rules leave out; of two rules, on the dissipation."""


def _reading(name: str, place: str, text: str, short: str = "", **told: Any) -> Reading:
    return Reading(name=name, place=place, text=text, short=short, **told)


EXAMPLE_4, LUMPED = "Sec. X, Example 4", "Sec. IX-B"
READINGS = (
    *(
        _reading(
            name,
            "Corollary 2; Part 1 has its cone",
            f"Theorem 3 as corrected, as ε → 0. {rule.text}{BESIDES.get(name, '')}.",
            "ε → 0, and the degree counted in each variable" if name == HOUSE else "",
        )
        for name, rule in RULES.items()
    ),
    _reading(
        POSITIVE,
        "Theorem 3",
        "Theorem 3 as corrected, with an ε > 0 fitted to the print of each example. The theorem asks for some "
        "ε > 0 and the text prints none. Some ε > 0 gives any number above the least level, so that it tests nothing.",
        inference=True,
        policy=Policy.CONSTANT,
    ),
    _reading(
        OWN_B,
        "Sec. X",
        "B = [1; 1] in Examples 1-3, the form that Sec. X names; that these examples had it is our assumption. "
        "Theorem 3 as corrected, z2-each.",
        "B = [1; 1] in Examples 1-3",
        policy=Policy.OWN,
    ),
    _reading(
        PADE,
        "Sec. X",
        f"Order {DATA['pade-order']}: numerator and denominator of the Padé approximation both have this degree.",
        "a Padé approximation with numerator and denominator of order ten",
    ),
    _reading(
        SINC,
        "Sec. X, Example 2, and Fig. 1",
        "The sinc is sin(πx)/(πx) or sin(x)/x; centre, horizon and channels are scanned over a stated grid.",
        "one of the sincs on a grid",
    ),
    *(
        _reading(
            name,
            LUMPED,
            "The error dynamics are lumped, plant and observer on one grid, as a simulation such as that of Fig. "
            f"1 does. Accurate: the H∞ norms of the loops of Examples 1-3 err by less than {allowed:.0%}.",
            f"accurate means within {allowed:.0%}",
        )
        for name, allowed in ACCURATE.items()
    ),
    _reading(
        ALONE,
        LUMPED,
        "The observer is lumped and the plant exact. All three plants are unstable, so that the norm of the error "
        "is infinite at any number of states; accurate: along the rightmost motion of the plant the error is below "
        f"{ACCURATE['lumps-1-percent']:.0%} of z.",
        "the observer alone is lumped",
    ),
    _reading(
        "jordan-zero", EXAMPLE_4,
        "J has the eigenvalue 0 and two states or more; with one state J is 0 and no free motion grows.",
    ),
    *(
        _reading(name, EXAMPLE_4, f"J has the eigenvalue {value:g}.", f"J has the eigenvalue {value:g}")
        for name, value in JORDAN.items()
        if value
    ),
    *(
        _reading(
            name,
            EXAMPLE_4,
            "Approximately a function of n·K: at equal n·K the printed seconds lie within a factor of "
            f"{factor:g}.",
            f"approximately means within a factor of {factor:g}",
        )
        for name, factor in SAME.items()
    ),
    _reading(
        DESKTOP, "Sec. I",
        f"Our program of Theorem 3 as corrected, on a machine of ours: a desktop computer has {MEMORY:g} GB of memory, "
        "and a run may take one day.",
        f"our program on a desktop computer with {MEMORY:g} GB", policy=Policy.OWN,
    ),
)  # fmt: skip
