"""No small change of the verifier goes unnoticed by its tests."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Sequence

import pytest
from mutants import Mutant, mutants_of, survivors

SAID = ("test_said",)
DUALRATE = ("test_dualrate_mathematics", "test_dualrate", *SAID)
MULTIRATE = ("test_multirate", *SAID)
STEPS = ("test_nonuniform_steps", "test_nonuniform")
STAMPED = ("test_nonuniform_stamped",)
VERIFIER = {
    "algebra.linear": ("test_algebra", "test_run", "test_multirate"),
    "algebra.symbolic": ("test_algebra",),
    "delay.dual": ("test_delay_programs", *SAID),
    "delay.identity": ("test_delay_identities", *SAID),
    "delay.levels": ("test_delay", *SAID),
    "delay.pade": ("test_delay_programs", *SAID),
    "delay.plant": ("test_delay", "test_delay_programs", *SAID),
    "delay.sos": ("test_delay", *SAID),
    "dualrate.errors": DUALRATE,
    "dualrate.loop": DUALRATE,
    "dualrate.loops": DUALRATE,
    "dualrate.lyapunov": DUALRATE,
    "dualrate.response": DUALRATE,
    "dualrate.theory": DUALRATE,
    "kernel": ("test_kernel", "test_algebra"),
    "multirate.counts": MULTIRATE,
    "multirate.identities": MULTIRATE,
    "multirate.levels": MULTIRATE,
    "multirate.losses": ("test_multirate_losses", *SAID),
    "multirate.recovered": MULTIRATE,
    "multirate.sensing": MULTIRATE,
    "nonuniform.gain": (*STEPS, *STAMPED, *SAID),
    "nonuniform.grid": ("test_nonuniform_theory", *SAID),
    "nonuniform.identities": ("test_nonuniform_theory", "test_sufficiency", *SAID),
    "nonuniform.levels": (*STEPS, *STAMPED, *SAID),
    "nonuniform.smallgain": ("test_nonuniform", *SAID),
    "nonuniform.system": (*STEPS, *STAMPED, *SAID),
    "nonuniform.theory": ("test_nonuniform_theory", "test_nonuniform", *SAID),
    "predicate": ("test_statement", *SAID),
    "reading": ("test_reading", "test_statement"),
    "run": ("test_run",),
    "statement": ("test_statement",),
    "subjects": ("test_run",),
}
"""The modules, and the tests that must notice each change of them."""
EQUIVALENT = [
    (
        "delay.identity",
        "return total(Words({(n, min(word, mirrored(word))): c}, form.symmetric) "
        "for (n, word), c in form.terms.items())",
        "became max",
        "either of a word and its transpose may stand for both",
    ),
    ("delay.identity", "for count in range(MOST + 1):", "became 2", "more delays than are needed"),
    (
        "delay.identity",
        "Z, z = P * L, C1 * e",
        "Mult became Add",
        "the supply with v = z/gamma is that of every z, whatever it is made of",
    ),
    (
        "delay.identity",
        "A = P.inv() * (J * 2 - one)",
        "became 3",
        "another example, of which the inequality and a positive trace are decided as well",
    ),
    (
        "delay.identity",
        'decide(Positive(P + P.transpose(), "P + P\'"))',
        "decide left out",
        "P = I + turn J with J' = -J, so that P + P' is 2 I for every turn",
    ),
    (
        "delay.identity",
        'decide(Positive(form * -1, "the inequality of Theorem 1"))',
        "became 2",
        "a matrix and its double are positive definite together",
    ),
    *(
        (
            "delay.identity",
            'EXAMPLE = {"tau": 2, "P": 2, "H": HALF, "K": 2, "G": 1, "Z": 1, "V": 1, "x": 1, "seen": 1, "chi": HALF}',
            change,
            reason,
        )
        for change, reason in (
            ("became 3", "with a larger P the operator is coercive too, and no less an example"),
            ("became 2", "with a larger G the operator is coercive too, and no less an example"),
            ("became 2", "x is the present state of the history, and any will do"),
        )
    ),
    (
        "delay.identity",
        "found = {name: gain.without(*zero) for name, gain in gains(*inverse(printed=False)).items()}",
        "became True",
        "the two differ in Gamma_hat, which multiplies nothing but letters that are zero there",
    ),
    ("dualrate.loop", "BITS = 256", "became 257", "more bits than are needed"),
    *(
        ("dualrate.loop", text, change, "no statement reads a start that is not given")
        for text in (
            "start: fmpq_mat = field(default_factory=partial(fmpq_mat, 0, 1))",
            'start=matrix(first[0], f"{path}.start", n, 1) if first else fmpq_mat(0, 1),',
        )
        for change in ("became 1", "became 2")
    ),
    ("dualrate.response", "TERMS, PIECES, PARTS = 24, 32, 2000", "became 25", "more terms than are needed"),
    ("dualrate.response", "TERMS, PIECES, PARTS = 24, 32, 2000", "became 33", "more pieces than are needed"),
    ("dualrate.response", "TERMS, PIECES, PARTS = 24, 32, 2000", "became 2001", "more parts than are needed"),
    (
        "multirate.levels",
        '"d": Depends(lambda given: sized(matrices, given.plant[0].B_d.ncols(), 1)),',
        "became 1",
        "both are one plant under two schedules, with one B_d",
    ),
    (
        "run",
        "def report(paths: Sequence[Path], root: Path = ROOT, jobs: int | None = 1) -> int:",
        "became 2",
        "the lines are the same in several processes",
    ),
    (
        "run",
        'print(printable(words, sys.stdout.encoding or "ascii"), flush=True)',
        "became False",
        "seen in a process of its own only, by a test with a reader that leaves",
    ),
    (
        "nonuniform.grid",
        "b = fmpq(isqrt(int(square.numerator)), isqrt(int(square.denominator))) if square > 0 else fmpq(0)",
        "Gt became GtE",
        "the root of zero is zero",
    ),
    (
        "nonuniform.grid",
        "b = fmpq(isqrt(int(square.numerator)), isqrt(int(square.denominator))) if square > 0 else fmpq(0)",
        "became 1",
        "what is put for the root of a square that is not positive is refused, as neither zero nor one has that square",
    ),
    (
        "nonuniform.gain",
        'weight = times[share] if case.weight == "duration" else arb(1)',
        "became 2",
        "both energies have the weight",
    ),
    (
        "nonuniform.system",
        'Kind_co = TypeVar("Kind_co", bound=Estimator, covariant=True)',
        "became False",
        "types are for their checker",
    ),
    ("nonuniform.smallgain", "BITS = 40", "became 41", "more bits than are needed"),
    ("nonuniform.smallgain", "HALVINGS = 12", "became 13", "more halvings than are needed"),
    (
        "nonuniform.smallgain",
        "h_0, ends = seconds(plant.middle), "
        '[seconds(plant.period(name, "period")) for name in (PERIODS[0], PERIODS[-1])]',
        "lost its sign or negation",
        "e^{ah} is convex and falls, so that it changes most from the middle to the lower end",
    ),
    (
        "nonuniform.smallgain",
        "h_0, ends = seconds(plant.middle), "
        '[seconds(plant.period(name, "period")) for name in (PERIODS[0], PERIODS[-1])]',
        "became 2",
        "the middle for the upper end, as without the sign",
    ),
    (
        "nonuniform.smallgain",
        'return Found(words={"period": in_words(changed), "least": reached[0]})',
        "became 1",
        "of real eigenvalues none reaches one, as h_u < 2 h_0, and a conjugate pair reaches the same",
    ),
    (
        "nonuniform.smallgain",
        "cross = -(self.Phi.transpose() * self.P * D)",
        "lost its sign or negation",
        "diag(I, -I) turns one matrix into the other, and definiteness stays",
    ),
    (
        "nonuniform.system",
        'level=positive(given["level"], f"{path}.level") if level else fmpq(0),',
        "became 1",
        "a level that is not asked for is not read",
    ),
    ("nonuniform.theory", "DIGITS = 40", "became 41", "more bits than are needed"),
]
"""Changes that make nothing false: module, line of its source, change, and why no test need notice it.

One stands here as often as its line has such changes with the same words.
"""


SHARE = None if os.environ.get("MUTANTS") == "all" else 16
"""How many mutants of each module are tried, evenly spread over it; all of them with MUTANTS=all (`make mutants`)."""


@pytest.mark.slow
@pytest.mark.parametrize("module", VERIFIER)
def test_every_mutant_is_noticed(module: str) -> None:
    mutants = mutants_of(f"replication.verify.{module}")
    assert len(mutants) > 5
    tried = mutants[:: math.ceil(len(mutants) / SHARE)] if SHARE else mutants
    left = _counted(survivors(tried[0].module, tried, VERIFIER[module]))
    known = Counter((text, change) for where, text, change, _ in EQUIVALENT if where == module)
    assert not left - known, "no test notices these"
    # Of several changes of one line with the same words a sample may hold only those that are noticed.
    whole, sample = _counted(mutants), _counted(tried)
    due = Counter({pair: count for pair, count in known.items() if sample[pair] == whole[pair]})
    assert not due - left, "a test notices these, or they are gone"


def _counted(mutants: Sequence[Mutant]) -> Counter[tuple[str, str]]:
    return Counter((mutant.text, mutant.change) for mutant in mutants)
