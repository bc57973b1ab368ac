"""Claims of Sec. V on what Table I shows: which observer has the smaller error, and how it grows with the frequency."""

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise, product
from typing import Any

from papers._common import by_margin
from papers.shao import printed
from papers.shao.claims.table import SIMULATED, STEADY, TIED, error_under, none_gives_the_table, printed_forms
from papers.shao.experiments.tracking import LOW_FREQUENCY
from papers.shao.printed import APO, LITERAL, PMI, PMI_OPEN
from replication.audit.declare import Part
from replication.audit.model import Evidence, Results
from replication.verify.predicate import Predicate

CONCLUDED = Part("Order of the printed numbers of Table I", reading=LITERAL)


@CONCLUDED.order(
    "order.apo-below-pmi",
    place="Table I",
    pinned="undetermined",
    says=[
        Predicate(
            of=error_under("apo", LITERAL if reading in printed.INTERPOLATIONS else reading, i),
            relation="less than",
            to=error_under("pmi", reading, i),
            reading=reading,
        )
        for reading in printed.READ["pmi"]
        for i in range(len(printed.FREQUENCIES))
    ],
)
def smaller_error(results: Results) -> Evidence:
    """DRC-APO has a smaller error than DRC-PMI at every frequency of Table I."""
    table, forms = results["table"], printed_forms(results["orderings"])
    shares, counts, apo = weak_gain_shares(table), ordering_counts(forms), table["readings"]["apo"]
    return by_margin(
        {
            choice: min(1 - a / p for a, p in zip(apo.get(choice, apo[LITERAL]), column, strict=True))
            for choice, column in table["readings"]["pmi"].items()
        },
        method=f"{STEADY}; the frequency with the smallest gain counts",
        quantities={
            "pairs left open by the text, both loops stable": sum(counts.values()),
            "pairs left open by the text, it holds": counts["holds"],
            "pairs left open by the text, it does not hold": counts["fails"],
            "pairs left open by the text, errors equal up to rounding": counts["tied"],
            "share of the reduction that DRC-PMI with L/M obtains, least": min(shares),
            "share of the reduction that DRC-PMI with L/M obtains, largest": max(shares),
            f"DRC-PMI at {LOW_FREQUENCY:g} rad/s, percent": table["slow"][PMI],
            f"DRC-APO at {LOW_FREQUENCY:g} rad/s, percent": table["slow"][APO],
        },
        note="It depends on DRC-PMI, which the text leaves open. "
        f"{where_larger(forms)}{none_gives_the_table(results)} The outcomes "
        "listed are with the printed feedforward. The steady state is our choice of window: from the printed "
        "start a maximum over the whole time is half the amplitude at least. This is also the better static "
        "tracking of Sec. V; how much better is not judged. The pairs counted take each feedforward, with "
        "the reference held; (6) to (8) and L in continuous time as printed.",
    )


def in_order(column: str) -> list[Predicate]:
    """That each error of a column is less than the next, under each reading."""
    return [
        Predicate(of=error_under(column, key, i), relation="less than", to=error_under(column, key, i + 1), reading=key)
        for key in printed.READ[column]
        for i in range(len(printed.FREQUENCIES) - 1)
    ]


def growing(column: str, results: Results) -> Evidence:
    """Whether each row of a column exceeds the one before it."""
    may_be_meant, searched = (
        ((APO,), printed.APO_READINGS) if printed.COLUMNS[column] == APO else (PMI_OPEN, printed.PMI_READINGS)
    )
    forms = printed_forms(results["orderings"])
    open_loops = stable_columns(forms, may_be_meant)
    every = stable_columns(results["orderings"], searched)
    holds, among = (sum(least_growth(ratios) > TIED for ratios in loops) for loops in (open_loops, every))
    only_excluded = len(every) > among and holds == len(open_loops)
    return by_margin(
        {
            **{choice: least_growth(ratios) for choice, ratios in results["table"]["readings"][column].items()},
            printed.EVERY: min(map(least_growth, open_loops)),
        },
        method=f"{STEADY}; the step with the smallest growth counts",
        cross_check=SIMULATED,
        quantities={
            "left open by the text, stable loops": len(open_loops),
            "left open by the text, stable loops in which it holds": holds,
            "searched, stable loops, those that the text excludes too": len(every),
            "searched, stable loops in which it fails": len(every) - among,
        },
        note=f"The text does not say it. It holds in {holds} of {len(open_loops)} stable loops of {printed.EVERY}"
        f"{' and fails only for forms that the text excludes' if only_excluded else ''}. L as a discrete gain, the "
        "current form of the observer, predictors other than (6), and a reference that is previewed or changes "
        "between instants are no readings: (3) has the gain in continuous time, (7) and (8) the form, (6) the "
        "predictor, and Sec. II an input that is held over T.",
    )


def least_growth(column: Sequence[float]) -> float:
    """The smallest relative step from a row to the next."""
    return min(later / earlier - 1 for earlier, later in pairwise(column))


for column in printed.COLUMNS:
    CONCLUDED.order(
        f"order.growth-{column}",
        place="Table I",
        statement=f"The error of DRC-{column.upper()} increases from each frequency of Table I to the next.",
        ours=True,
        says=in_order(column),
    )(partial(growing, column))


def stable_columns(structures: Sequence[Mapping[str, Any]], observers: Sequence[str]) -> list[list[float]]:
    """The columns that the stable loops of these observers give, in percent."""
    columns = (entry["ratios"][name] for entry in structures for name in observers)
    return [column for column in columns if column is not None]


def ordering_counts(structures: Sequence[Mapping[str, Any]]) -> Counter[str]:
    """Pairs of stable loops, DRC-APO with (6), by whether it is below DRC-PMI in every row: holds, fails, or tied."""
    counts = Counter[str](holds=0, fails=0, tied=0)
    for entry in structures:
        for pmi, apo in product(stable_columns([entry], PMI_OPEN), stable_columns([entry], (APO,))):
            excess = max(y / x - 1 for x, y in zip(pmi, apo, strict=True))
            counts["tied" if abs(excess) <= TIED else "fails" if excess > 0 else "holds"] += 1
    return counts


def where_larger(structures: Sequence[Mapping[str, Any]]) -> str:
    """With which DRC-PMI the error of DRC-APO is the larger, at every frequency or some."""
    groups: dict[str, list[str]] = {"every frequency": [], "some frequencies": []}
    for entry in structures:
        for name, apo in product(PMI_OPEN, stable_columns([entry], (APO,))):
            for pmi in stable_columns([entry], (name,)):
                larger = [a / p - 1 > TIED for p, a in zip(pmi, apo, strict=True)]
                case = printed.LABELS[name]
                cases = groups["every frequency" if all(larger) else "some frequencies"]
                if any(larger) and case not in cases:
                    cases.append(case)
    return "".join(
        f"DRC-APO has the larger error at {where} of Table I against {'; '.join(cases)}. "
        for where, cases in groups.items()
        if cases
    )


def weak_gain_shares(table: Mapping[str, Any]) -> list[float]:
    """Per row, the part of the step from DRC-PMI to DRC-APO that DRC-PMI takes with L/M in place of L."""
    columns = table["ratios"][PMI], table["weak_gain"][PMI], table["ratios"][APO]
    return [(pmi - weak) / (pmi - apo) for pmi, weak, apo in zip(*columns, strict=True)]
