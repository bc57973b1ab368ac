"""The author's blog post: the levels that it repeats, and the reasons that it gives."""

from math import lcm

from papers._common import solvers
from papers.okajima2023.claims.levels import PREDICTORS, counterexamples, level, of_gains
from papers.okajima2023.experiments.declared import DESIGNS, GAIN_SETS, PERIOD_TABLE, TIMINGS, case, pair, times
from papers.okajima2023.printed import DATA
from replication.audit.declare import Part, positive
from replication.audit.model import NO_READING, Evidence, Outcome, Results
from replication.verify.predicate import Predicate, Term, term

ON_TABLE_1 = "Blog, on Table 1"
RULE, RULE_BEST_TIMING = "all periods, both sensors at instant 0", "all periods, each with its best timing"
BLOG = Part("Blog post: levels, tables, reasons", reading=NO_READING)
SCHEDULES = tuple(f"schedule.case-{n}" for n in (1, 2, 3))


def _again(name: str, printed: str, experiment: str, what: str, reading: str = NO_READING) -> None:
    level(
        BLOG, f"blog.{name}", printed, experiment, f"The blog's level for {what}, as in the paper.", reading=reading
    )  # fmt: skip


_again("proposed", DATA["blog-methods"]["Proposed"], case("proposed"), "the proposed observer")
for _case in "ABC":
    _again(f"case-{_case.lower()}", DATA["blog-methods"][f"Case {_case}"], case(_case), f"Case {_case}", PREDICTORS)
for _n in (1, 3):
    _again(f"n{_n}{_n}", DATA["blog-periods"][f"{_n},{_n}"], pair((_n, _n)), f"N₁ = N₂ = {_n}")
for _timing, (_n, _printed) in zip(TIMINGS, DATA["blog-timing"].items(), strict=True):
    _again(f"timing-{_n}", _printed, _timing, f"Case {_n} of the timing")


@BLOG.order(
    "order.beyond-table",
    place=ON_TABLE_1,
    reading=RULE,
    ours=True,
    says=[
        Predicate(of=term("shorter periods are better", "stable"), relation="fails", reading=name)
        for name in (RULE, RULE_BEST_TIMING)
    ],
)
def not_always_better(results: Results) -> Evidence:
    """Beyond Table 1 a shorter sensing period does not always give a smaller optimal level."""
    table = results[PERIOD_TABLE]
    largest = max(max(cell["periods"]) for cell in table)
    cases = {timing: counterexamples(table, timing) for timing in ("synchronous", "best")}
    outcomes = tuple(
        Outcome(reading=name, holds=bool(cases[timing]), margin=cases[timing][0][0] if cases[timing] else None)
        for name, timing in ((RULE, "synchronous"), (RULE_BEST_TIMING, "best"))
    )
    method = f"Brackets of exact optima for all periods up to {largest}, sensors at instant 0 or with the best timing."
    if not cases["synchronous"]:
        return Evidence(method=method, outcomes=outcomes, note="No counter-example up to these periods.")
    _, shorter, longer = cases["synchronous"][0]
    note = (
        f"Counter-example: periods {tuple(shorter)} have a larger optimum than {tuple(longer)}. Both sensors measure "
        f"together every {lcm(*shorter)} instants with the former, every {lcm(*longer)} with the latter."
    )
    if cases["best"]:
        by, worse, better = cases["best"][0]
        note += f" With the best timing of each, {tuple(worse)} has an optimum {by:.6f} above that of {tuple(better)}."
    return Evidence(
        method=method,
        holds=True,
        margin=cases["synchronous"][0][0],
        outcomes=outcomes,
        quantities={
            "counter-examples, sensors at instant 0": len(cases["synchronous"]),
            "counter-examples, best timing": len(cases["best"]),
        },
        note=f"{note} Paper and blog say it of the combinations that they show (claim order.shorter-in-table).",
    )


@BLOG.order(
    "blog.periodic-matrices",
    place="Blog, on Theorem 1",
    says=[
        Predicate(
            of=of_gains("level of Theorem 1 with one P", equation),
            relation="more than",
            to=of_gains("level of Theorem 1", equation),
        )
        for equation in GAIN_SETS
    ],
)
def periodic_matrices(results: Results) -> Evidence:
    """At each gain set printed for the stable plant, one P in Theorem 1 gives a larger level than P_k, or none."""
    record = results["constant-matrix"]
    margins, quantities = [], {}
    for equation, analysis in record["analyses"].items():
        quantities[f"level with P_k, gains ({equation})"] = analysis["periodic"]
        if analysis["constant"] is None:
            margins.append(analysis["largest_radius"] - 1)
            quantities[f"largest spectral radius of an A_ek, gains ({equation})"] = analysis["largest_radius"]
        else:
            margins.append(analysis["constant"] - analysis["periodic"])
            quantities[f"level with one P, gains ({equation})"] = analysis["constant"]
    return positive(
        min(margins),
        method="Smallest level of Theorem 1 with one P for all instants minus that with P_k. Where no P exists: how "
        "far some A_ek alone has its spectral radius above 1, which one P would forbid. The least of the four.",
        cross_check=f"Design by Theorem 2 for N₁ = 2, N₂ = 1: {record['constant']:.6f} with one P, "
        f"{record['periodic']:.6f} with P_k; the gains found with one P have the exact norm "
        f"{record['norm_constant']:.6f}.",
        solvers=solvers(*record["analyses"].values()),
        quantities=quantities,
    )


def longest_gap(diagonals: list[list[float]]) -> int:
    """Longest cyclic run of phases in which no sensor measures."""
    idle = "".join("0" if any(row) else "1" for row in diagonals)
    return max(len(run) for run in (idle * 2).split("0"))


def unmeasured(timing: int) -> Term:
    """The longest time without a measurement of one of the timings."""
    return term("longest time unmeasured", **times(DESIGNS[TIMINGS[timing]]))


@BLOG.value("blog.idle-instants", DATA["blog-idle-instants"], says=unmeasured(0))
def idle_instants(results: Results) -> Evidence:
    """In Case 1 of the timing this many instants in a row pass without any measurement."""
    gap = longest_gap(results[SCHEDULES[0]]["diagonals"])
    return Evidence(method="Counted on the schedule, cyclically.", value=float(gap))


@BLOG.order(
    "blog.evenness",
    place=DATA["blog-idle-instants"].place,
    says=Predicate(of=unmeasured(1), relation="less than", to=unmeasured(0)),
)
def evenness(results: Results) -> Evidence:
    """In Case 2 of the timing the longest run of instants without measurement is shorter than in Case 1."""
    gaps = [longest_gap(results[name]["diagonals"]) for name in SCHEDULES]
    return positive(
        float(gaps[0] - gaps[1]),
        method="Longest cyclic run without measurement in each case, counted on the schedules.",
        quantities={f"longest gap, Case {n}": float(gap) for n, gap in enumerate(gaps, start=1)},
        note="Case 3 has the same longest run as Case 2 and a larger optimum, so this alone does not rank them.",
    )
