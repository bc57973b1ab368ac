"""The audit of the nonuniform-sampling paper: experiments, claims, errata, figures, scope together."""

from __future__ import annotations

from typing import Any

import numpy as np

from papers._common import MULTIPLES, PLANT
from papers.mustafa import common, data, experiments, sensitivity
from papers.mustafa.claims import levels, method, printed_filter
from papers.mustafa.draws import draws
from papers.mustafa.errata import ERRATA
from papers.mustafa.figures import FIGURES
from papers.mustafa.identities import identities
from papers.mustafa.names import (
    BRACKET,
    CORRECT,
    CURVE,
    DRAWS,
    DURATION,
    GRIDS,
    IDENTITIES,
    KEY,
    NOMINAL,
    RANGE,
    ROBUST,
)
from replication.audit.judge.perturb import sensitivities
from replication.audit.model import Experiment, Formula, Paper, Results, ScopeItem, Table

CLAIMS = (*levels.CLAIMS, *printed_filter.CLAIMS, *method.CLAIMS)

SEED, SEEDS, TRIALS, STEPS = 20100600, 400, 30, 500
"""Seed and number of draws of Figs. 2 and 3, random cases of the identities, samples of the figures."""
LIMIT, CELLS, NODES, POINTS = 64, 16, 129, 121
"""N_0 of Algorithm 1; cells of (13); nodes of the dense grid; points of the curves over h."""

EXAMPLES: dict[int, dict[str, Any]] = {1: data.example_1(), 2: data.example_2()}
_PRINTED: dict[int, Any] = {1: None, 2: data.printed_filter()}
_EFFORT: dict[int, dict[str, Any]] = {
    1: {"horizon": 600, "final_horizon": 4000, "leaves": 140, "cuts": None},
    2: {"horizon": 1500, "final_horizon": 4500, "leaves": 56, "cuts": [0.08]},
}
_DURATION_EFFORT: dict[int, dict[str, Any]] = {
    1: {"horizon": 200, "final_horizon": 1000, "leaves": 120, "cuts": [0.03, 0.08]},
    2: {"horizon": 250, "final_horizon": 2000, "leaves": 150, "cuts": [0.02, 0.06]},
}
_ENDS = [float(h) for h in np.linspace(0.02, EXAMPLES[1]["periods"][1], 5)]


def _of_example(e: int) -> tuple[Experiment, ...]:
    common = EXAMPLES[e]
    subject = {**common, "printed": _PRINTED[e]}
    return (
        Experiment(name=NOMINAL[e], function=experiments.nominal, inputs=common),
        Experiment(name=GRIDS[e], function=experiments.grids, inputs={**common, "limit": LIMIT}),
        Experiment(name=ROBUST[e], function=experiments.robust, inputs={**common, "cells": CELLS, "nodes": NODES}),
        Experiment(name=CURVE[e], function=experiments.level_curve,
                   inputs={**subject, "nodes": POINTS, "level": data.upper_end(levels.PRINTED_LEVEL[e])}),
        Experiment(name=BRACKET[e], function=experiments.bracket,
                   inputs={**subject, "per_duration": False, **_EFFORT[e]}),
        Experiment(name=DURATION[e], function=experiments.bracket,
                   inputs={**subject, "per_duration": True, **_DURATION_EFFORT[e]}),
    )  # fmt: skip


SENSITIVITY = (f"{KEY}.sensitivity.1", f"{KEY}.sensitivity.2")
COMMON, LARGEST = f"{KEY}.common", 4
"""The experiment on the common plant, and the largest multiple tried: beyond, a fixed filter promises little here."""
_TRIED = [m for m in MULTIPLES if m <= LARGEST]
EXPERIMENTS = (
    Experiment(name=COMMON, function=common.levels,
               inputs={"plant": PLANT, "multiples": _TRIED, "leaves": 16, "horizon": 400}),
    Experiment(
        name=SENSITIVITY[0], function=sensitivity.nominal_level,
        inputs={"prints": data.PRINTED_1, "h_u": EXAMPLES[1]["periods"][1], "claim": f"{KEY}.gamma.1"},
    ),
    Experiment(
        name=SENSITIVITY[1], function=sensitivity.filter_norm,
        inputs={"prints": data.PRINTED_FILTER, "plant": EXAMPLES[2]["plant"], "claim": f"{KEY}.filter.norm"},
    ),
    *_of_example(1),
    *_of_example(2),
    Experiment(
        name=RANGE, function=experiments.against_range,
        inputs={"plant": EXAMPLES[1]["plant"], "h_l": EXAMPLES[1]["periods"][0], "ends": _ENDS, "horizon": 200,
                "leaves": 12},
    ),
    *(
        Experiment(
            name=name, function=draws,
            inputs={**EXAMPLES[2], "printed": _PRINTED[2], "size": float(data.W_SIZE), "decay": float(data.W_DECAY),
                    "frequency": float(data.W_FREQUENCY), "steps": STEPS, "seeds": SEEDS, "seed": SEED, "part": part,
                    "parts": len(DRAWS)},
        )
        for part, name in enumerate(DRAWS)
    ),
    Experiment(name=IDENTITIES, function=identities, inputs={"trials": TRIALS, "seed": SEED}),
)  # fmt: skip

FORMULAS = (
    Formula(
        text="Error system, eq. (5), with the sampling period in the plant's blocks only",
        latex=(
            r"\bar{x}_{k+1} = \begin{bmatrix} \Phi(h_k) & 0 \\ B_f C & A_f \end{bmatrix} \bar{x}_k"
            r" + \begin{bmatrix} \Gamma(h_k) \\ B_f D \end{bmatrix} w_k"
        ),
    ),
    Formula(
        text="Path-dependent Lyapunov inequality behind the proved level g: c begins the coming periods, d is next",
        latex=r"e^T e + \bar{x}_{+}^T P_d \bar{x}_{+} \le \bar{x}^T P_c \bar{x} + g^2 w^T w",
    ),
)

SUMMARY = (
    "The paper designs filters for measurements at irregular instants by solving matrix inequalities at a grid of "
    "sampling periods that a small-gain argument chooses. Two plants of two states are the examples. The levels in the "
    "examples are nominal: they come from one constant period. This page sets beside each the true worst case over all "
    "sampling sequences."
)


def findings(results: Results) -> tuple[str, ...]:
    """What a reader of the paper must know, with the numbers of this run."""
    told = []
    for e, printed in levels.PRINTED_LEVEL.items():
        r, d, c = results[BRACKET[e]], results[DURATION[e]], results[CURVE[e]]
        told.append(
            f"Example {e}: the level {printed} is nominal, designed at the constant period "
            f"{results[NOMINAL[e]]['h']:.4f} s; to its digits {levels.FILTER[e]} keeps it at constant periods from "
            f"{c['holds_from']:.5f} to {c['holds_to']:.5f} s. "
            f"Over all sampling sequences in the range the gain of that filter lies between {r['lower']:.4f} and "
            f"{r['upper']:.4f}, {r['lower'] / float(printed):.1f} times as much or more; weighted by duration, between "
            f"{d['lower']:.4f} and {d['upper']:.4f}."
        )
    sizes = [results[GRIDS[e]]["algorithm"][CORRECT]["size"] for e in (1, 2)]
    robust = [results[ROBUST[e]]["guaranteed"] for e in (1, 2)]
    curve = results[CURVE[1]]
    return (
        *told,
        f"The correct algorithm needs {sizes[0]} and {sizes[1]} elements where the paper has one. Of the readings "
        f"tried, only the square root of alpha in step 4, which the small-gain condition does not allow, lets one "
        f"element cover both ranges; that the paper's grids come from it is an inference. As the text at hand reads, "
        "the algorithm stalls in both examples, with the set-minus of step 4 as without.",
        f"A robust design with one Lyapunov function guarantees {robust[0]:.4f} in Example 1 and {robust[1]:.4f} in "
        "Example 2 for every sequence, by a certificate that is checked without the solver.",
        f"In Example 1 no filter of form (4) does better than {curve['floor']:.4f} (at the constant period "
        f"{curve['floor_at']:.4f} s), while taking the measurement for the estimate has the gain {data.D_1} for every "
        "sequence.",
        "Stability for every sequence needs no grid: it holds whenever A is Hurwitz and A_f Schur.",
    )


TABLES = (
    Table(
        place="Sec. VI", caption="Published levels, and what holds for every sampling sequence.",
        header=("Example", "published, nominal", "for every sequence", "elements of the grid"),
        rows=tuple(
            (str(e), f"claim:{KEY}.gamma.{e}", f"claim:{KEY}.robust-level.{e}", f"claim:{KEY}.grid.{e}") for e in (1, 2)
        ),
    ),
)  # fmt: skip


def _ids(*prefixes: str) -> tuple[str, ...]:
    return tuple(claim.id for claim in CLAIMS if any(claim.id.startswith(f"{KEY}.{prefix}") for prefix in prefixes))


SCOPE = (
    ScopeItem(part="Abstract, Secs. I and VII: what the filter guarantees", claims=_ids("robust-level")),
    ScopeItem(part="Sec. I, related work", reason="Statements about other papers; their texts are not at hand."),
    ScopeItem(part="Sec. II and Lemma 1", reason="Definitions and a standard lemma; the gain is computed by them."),
    ScopeItem(part="Sec. III, Lemmas 2 and 3, the map below (7)", claims=(*_ids("lemma"), f"{KEY}.map")),
    ScopeItem(part="Fig. 1, block diagram", reason="A drawing without data; Lemma 2 is audited."),
    ScopeItem(part="Theorem 1, eq. (9), cases L3 and U3; its conservatism", claims=_ids("l3", "u3", "conservative")),
    ScopeItem(part="Eq. (9), cases L1, L2, U1 and U2", reason="Limits of L3 and U3 that neither example meets."),
    ScopeItem(part="Theorem 2, what it concludes", claims=_ids("stable")),
    ScopeItem(part="Theorem 2, proof", reason="Not followed: an exact test gives stability for every range."),
    ScopeItem(part="Theorem 3, eqs. (10) and (11)", claims=_ids("congruence", "recovery", "theorem-3")),
    ScopeItem(part="Algorithm 1", claims=_ids("algorithm", "grid")),
    ScopeItem(part="Sec. V-A, eq. (12) and the remark on one level", claims=_ids("map-12", "same-level")),
    ScopeItem(part="Eq. (13)", reason="Announced but missing in the text at hand; a reconstruction of ours is used."),
    ScopeItem(part="Sec. V-B, continuous-time performance", reason="A remark without a computation."),
    ScopeItem(part="Sec. VI, levels, filter, comparison", claims=_ids("gamma", "stable", "filter", "cited", "compare"),
              figures=(f"{KEY}-levels", f"{KEY}-range", f"{KEY}-worst")),
    ScopeItem(part="Figs. 2 and 3", claims=_ids("figure"), figures=(f"{KEY}-fig2", f"{KEY}-fig3")),
)  # fmt: skip

PAPER = Paper(
    key=KEY,
    title="Robust H∞ Filtering for Nonuniformly Sampled Systems",
    authors=("Ghulam Mustafa", "Tongwen Chen", "Hisaya Fujioka"),
    year=None,
    venue="manuscript; its latest reference is of 2010",
    doi="",
    summary=SUMMARY,
    notebook="nonuniform",
    bibtex="""@misc{mustafa,
  author = {Mustafa, Ghulam and Chen, Tongwen and Fujioka, Hisaya},
  title  = {Robust $\\mathcal{H}_\\infty$ Filtering for Nonuniformly Sampled Systems},
  note   = {Year and venue are not stated in the text; the latest reference is of 2010}
}""",
    experiments=EXPERIMENTS,
    claims=CLAIMS,
    errata=ERRATA,
    figures=FIGURES,
    tables=TABLES,
    formulas=FORMULAS,
    scope=SCOPE,
    findings=findings,
    common=lambda results: common.common(results[COMMON], _TRIED),
    sensitivity=lambda results: tuple(move for name in SENSITIVITY for move in sensitivities(results[name])),
)
