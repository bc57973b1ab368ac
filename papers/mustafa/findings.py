"""What a reader of the paper must know, with the numbers of a run."""

from __future__ import annotations

from papers.mustafa.claims.examples import FILTER
from papers.mustafa.method.algorithm1 import CORRECT
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA
from replication.audit.model import Results


def findings(results: Results) -> tuple[str, ...]:
    """The levels of both examples, the grids, a robust design, the floor, stability."""
    sizes = [results[f"grids.{e}"]["algorithm"][CORRECT.name]["size"] for e in EXAMPLES]
    robust = [results[f"robust.{e}"]["guaranteed"] for e in EXAMPLES]
    curve = results["curve.1"]
    return (
        *(_level(e, results) for e in EXAMPLES),
        f"The correct algorithm needs {sizes[0]} and {sizes[1]} elements where the paper has one. Of the readings "
        f"tried, only the square root of alpha in step 4, which the small-gain condition does not allow, lets one "
        f"element cover both ranges; that the paper's grids come from it is an inference. As the text at hand reads, "
        "the algorithm stalls in both examples, with the set-minus of step 4 as without.",
        f"A robust design with one Lyapunov function guarantees {robust[0]:.4f} in Example 1 and {robust[1]:.4f} in "
        "Example 2 for every sequence, by a certificate that is checked without the solver.",
        f"In Example 1 no filter of form (4) does better than {curve['floor']:.4f} (at the constant period "
        f"{curve['floor_at']:.4f} s), while taking the measurement for the estimate has the gain "
        f"{DATA['example-1']['D']} for every sequence.",
        "Stability for every sequence needs no grid: it holds whenever A is Hurwitz and A_f Schur.",
    )


def _level(e: int, results: Results) -> str:
    r, d, c = results[f"bracket.{e}"], results[f"bracket-duration.{e}"], results[f"curve.{e}"]
    return (
        f"Example {e}: the level {GAMMA[e]} is nominal, designed at the constant period "
        f"{results[f'nominal.{e}']['h']:.4f} s; to its digits {FILTER[e]} keeps it at constant periods from "
        f"{c['holds_from']:.5f} to {c['holds_to']:.5f} s. "
        f"Over all sampling sequences in the range the gain of that filter lies between {r['lower']:.4f} and "
        f"{r['upper']:.4f}, {r['lower'] / float(GAMMA[e]):.1f} times as much or more; weighted by duration, between "
        f"{d['lower']:.4f} and {d['upper']:.4f}."
    )
