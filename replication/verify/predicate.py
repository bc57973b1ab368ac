"""What is said of a number, as data, and of what can be spoken: claims say predicates, theorems export what they prove.

Standard library only. No sentence of a theorem depends on it.
"""

import json
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias, TypeVar

from replication.verify.theorem import NO_READING as NO_READING
from replication.verify.theorem import YES_NO as YES_NO
from replication.verify.theorem import Exported as Exported
from replication.verify.theorem import Found, Side, same
from replication.verify.theorem import Term as Term

Relation = Literal["is", "is not", "at most", "at least", "less than", "more than", "holds", "fails"]


@dataclass(frozen=True, kw_only=True)
class Predicate:
    """What a claim says of a term: its relation `to` a printed number or another term; None if it holds or fails.

    unit: that of the quantity. reading: under which the text says so, that of the claim if empty.
    """

    of: Term
    relation: Relation = "holds"
    to: str | Term | None = None
    unit: str = ""
    reading: str = ""

    @property
    def terms(self) -> tuple[Term, ...]:
        """The terms that it speaks of."""
        return (self.of, self.to) if isinstance(self.to, Term) else (self.of,)


def term(quantity: str, /, plant: str = "", estimators: str = "", **setting: Any) -> Term:
    """A term in few words; what is set becomes plain JSON."""
    return Term(quantity=quantity, plant=plant, estimators=estimators, setting=json.loads(json.dumps(setting)))


QUANTITIES: Mapping[str, tuple[str, str]] = {
    name: (unit, words)
    for name, (unit, words) in tomllib.loads(Path(__file__).with_name("quantities.toml").read_text("utf-8")).items()
}
"""Unit and words of each quantity that can be spoken of."""
OWN = re.compile(r"[^\[\]]+ \[([^\[\]]+)\]")
"""A quantity of a paper's own statements: words with the unit behind them, such as `final size [1]`."""

ESTIMATORS: Mapping[str, str] = {
    "periodic one-step observers": "observer that predicts one step",
    "one-step predictors": "predicts one step",
    "all estimators": "no estimator, not even a smoother",
    "the given filter": "given filter",
    "filters of form (4)": "filter of form (4)",
    "filters with time stamps": "filter with time stamps",
    "observers by Theorem 3": "observer with the gains of",
}
"""Each class of estimators, with the words by which the sentence of a theorem on it names it."""


def unit_of(quantity: str) -> str:
    """The unit of a quantity: that of the table, or the one in brackets behind a paper's own; empty if not known."""
    match = OWN.fullmatch(quantity)
    return match[1] if match else QUANTITIES.get(quantity, ("", ""))[0]


def in_words(predicate: Predicate) -> str:
    """What a predicate says, on one line."""
    to, relation = predicate.to, predicate.relation
    whole = relation if relation in ("is", "is not", "holds", "fails") else f"is {relation}"
    if to is not None:
        whole = f"{whole} {_term(to) if isinstance(to, Term) else f'{to} {predicate.unit}'.removesuffix(' 1')}"
    under = "" if predicate.reading in ("", NO_READING) else f", under the reading {predicate.reading}"
    return f"{_term(predicate.of)} {whole}{under}"


def _term(of: Term) -> str:
    details = [f"plant {of.plant}"] if of.plant else []
    details += [of.estimators] if of.estimators else []
    details += [f"{name} {_shown(value)}" for name, value in of.setting.items()]
    return f"{_words(of.quantity)} ({'; '.join(details)})" if details else _words(of.quantity)


def differences(wanted: Term, reading: str, proved: Exported) -> list[str]:
    """How a theorem falls short of speaking of a term under a reading, in words; empty if it does speak of it."""
    reasons = []
    of = proved.of
    if of.quantity != wanted.quantity:
        reasons.append(f"it is about {_words(of.quantity)}, not {_words(wanted.quantity)}")
    if of.plant != wanted.plant:
        reasons.append(f"another plant: {of.plant or 'all'}, not {wanted.plant or 'all'}")
    for name in sorted(of.setting.keys() | wanted.setting.keys()):
        if name not in of.setting:
            reasons.append(f"not for {name} {_shown(wanted.setting[name])}")
        elif name not in wanted.setting:
            reasons.append(f"for {name} {_shown(of.setting[name])} of all")
        elif not same(of.setting[name], wanted.setting[name]):
            reasons.append(f"for {name} {_shown(of.setting[name])}, not {_shown(wanted.setting[name])}")
    if of.estimators != wanted.estimators:
        reasons.append(f"for {of.estimators or 'no class of estimators'}, not for {wanted.estimators or 'none'}")
    if reading not in proved.readings:
        reasons.append(f"under the reading {' or '.join(proved.readings)} only, not {reading}")
    return reasons


def _words(quantity: str) -> str:
    return QUANTITIES.get(quantity, ("", quantity.partition(" [")[0]))[1]


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


T = TypeVar("T")
Parameters = Mapping[str, Any]
Chosen: TypeAlias = T | Callable[[Parameters], T]
"""A value, or what gives it from the parameters of a certificate."""


@dataclass(frozen=True, kw_only=True)
class Says:
    """A term of which a theorem speaks, as data: see `predicate.Term`; one for each class of estimators, if several.

    setting: the parameters but `relative`, unless given. readings: of the paper `source`, under which its text speaks
    of this term. found: what is proved of it, from all that was read, proved and worded; that of the theorem unless
    given. universal: it is about all plants, though the certificate has one.
    """

    quantity: Chosen[str]
    estimators: Chosen[tuple[str, ...]] = ("",)
    readings: Chosen[tuple[str, ...]] = (NO_READING,)
    setting: Chosen[Mapping[str, Any]] | None = None
    found: Callable[[Mapping[str, Any]], Found] | None = None
    universal: bool = False


def as_data(
    terms: tuple[Says, ...], source: str, certificate: Mapping[str, Any], known: Mapping[str, Any], whole: Found
) -> tuple[Exported, ...]:
    """The terms of a theorem with what is proved of each; the plant of a certificate of one's own is called so.

    The readings of the paper `source` are not those of another one.
    """
    parameters, plant, paper = certificate["parameters"], certificate["plant"], certificate.get("paper")
    name = str(plant.get("name", "")) if isinstance(plant, Mapping) else ""
    name = name if paper is not None else f"own plant {name}"
    usual = {key: value for key, value in parameters.items() if key != "relative"}
    exported: list[Exported] = []
    for says in terms:
        proof = whole if says.found is None else says.found(known)
        quantity = _chosen(says.quantity, parameters)
        statement, bounds = unit_of(quantity) == YES_NO, (proof.lower, proof.upper)
        exported += (
            Exported(
                of=Term(
                    quantity=quantity,
                    plant="" if says.universal else name,
                    setting=usual if says.setting is None else _chosen(says.setting, parameters),
                    estimators=estimators,
                ),
                unit=unit_of(quantity),
                readings=_chosen(says.readings, parameters) if source in ("", paper) else (NO_READING,),
                items=() if statement else tuple((_end(low), _end(high)) for low, high in proof.items or (bounds,)),
                holds=proof.holds if statement else None,
            )
            for estimators in _chosen(says.estimators, parameters)
        )
    return tuple(exported)


def _chosen(value: Chosen[T], parameters: Parameters) -> T:
    return value(parameters) if callable(value) else value


def _end(side: Side) -> str | None:
    return None if side is None else str(side)
