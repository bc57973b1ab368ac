"""What a reader of the paper must know, with the numbers of a run."""

from __future__ import annotations

from collections.abc import Mapping

from papers.mustafa.claims.preliminaries import down, up
from papers.mustafa.method.algorithm1 import AS_PRINTED, CORRECT, WITH_SET_MINUS
from papers.mustafa.printed import DATA, EXAMPLES
from replication.audit.model import Results

WORDS = {1: "first", 2: "second"}


def findings(results: Results) -> tuple[str, ...]:
    """The levels of both examples, the grids, a robust design, the floor, stability: one consequence each."""
    bracket, weighted = (
        {e: results[f"{name}.{e}"]["lower"] for e in EXAMPLES} for name in ("bracket", "bracket-duration")
    )
    whose = {1: "our filter", 2: "the printed filter"}
    sizes = [results[f"grids.{e}"]["algorithm"][CORRECT.name]["size"] for e in EXAMPLES]
    as_read = [reading.name for reading in (AS_PRINTED, WITH_SET_MINUS)]
    ends = {results[f"grids.{e}"]["algorithm"][name]["end"] for e in EXAMPLES for name in as_read}
    own, robust = ({e: results[f"{name}.{e}"] for e in EXAMPLES} for name in ("own-grid", "robust"))
    floor = results["curve.1"]["floor"]
    return (
        *(
            f"At the period of its grid the {WORDS[e]} example's level holds; over all sequences, samples counted, "
            f"{whose[e]}'s gain is at least {down(bracket[e])}."
            for e in EXAMPLES
        ),
        f"Beyond the text, with norms in seconds, our and the printed filter's gains over all sequences are at least "
        f"{down(weighted[1])} and {down(weighted[2])}, above both levels.",
        f"The algorithm, corrected by an inference, ends with {sizes[0]} and {sizes[1]} elements in the grids of the "
        "two examples; the paper has one in each.",
        *(_covers(e, results[f"condition.{e}"]) for e in EXAMPLES),
        *(
            f"The corrected algorithm's level in the {WORDS[e]} example is {own[e]['level']:.4f}; some sequence gives "
            f"its filter a gain of at least {down(own[e]['lower'])}, samples counted."
            for e in EXAMPLES
        ),
        *(
            (
                "As the text at hand reads, the union cut to the range, the algorithm covers neither example's range, "
                "with a set-minus as without.",
            )
            if ends == {"STALLED"}
            else ()
        ),
        f"Robust levels can be had: one Lyapunov function guarantees {up(robust[1]['guaranteed'])} and "
        f"{up(robust[2]['guaranteed'])} for every sequence, samples counted, with certificates.",
        f"In the first example no stable filter of form (4) guarantees less than {down(floor)} for every sequence; the "
        f"undelayed measurement as the estimate guarantees {DATA['example-1']['D']}.",
        "Stability for every sequence needs no grid: it holds whenever A is Hurwitz and A_f Schur.",
    )


def _covers(e: int, found: Mapping[str, float]) -> str:
    if found["constant_bound"] < 1:
        return (
            f"Motor constant corrected, one element satisfies (8) over the {WORDS[e]} example's range, for constant "
            "changes and all in modal coordinates; (9) does not cover it."
        )
    return (
        f"The {WORDS[e]} example's one element fails (8); by (8) itself the corrected algorithm ends with "
        f"{found['elements']:g} for constant changes, {found['modal_elements']:g} for all in modal coordinates."
    )
