"""Certificates on which both arithmetics must say the same: of each statement a true one, and altered ones.

An alteration keeps the file well formed or not, makes it false, or leaves it true with another bound; which of these is
for the verifier to say.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import byhand

from replication.verify.run import STATEMENTS
from replication.verify.statement import WORDINGS

ROOT = Path(__file__).parents[2]
Certificate = dict[str, Any]


NAMES = {
    "mustafa": """
        condition-8-1 condition-8-2 congruence filter-first-column floor-1 floor-2 grid-2 lemma-2 lemma-3-1
        lower-end-1 map-1 nominal-1-upper one-interval-2 our-filter-lower our-filter-upper output-matrix
        own-grid-2 printed-filter-level range-1-no-filter range-2-lower range-2-no-filter recovery
        same-level-1 sizes stable-2 stall-1 stamped-1 upper-end-1
    """,
    "okajima2023": """
        common-period cyclic-rows dissipation dual-rate error-system gains-33-unmeasured gains-38
        gains-38-one-matrix idle-instants-case-2 lost-samples-2-3 observable optimum-1-1 optimum-case-a product
        rows schur
        section-4c-design section-4c-error-poles section-4c-free-setting section-4c-poles section-4c-same-setting
        selection-eqs-11-12 shorter-periods variables
    """,
    "peet2019": """
        ex1-inner-upper ex1-lower ex1-near-optimal ex1-one-disturbance ex1-outer-upper ex1-pade-lower
        ex1-pade-upper ex1-total-upper ex1-unstable ex2-d1-lower ex2-outer-lower ex4-not-unstable
        observer-bound present-only theorem-3-identity theorem-4
    """,
    "shao": """
        collected-constant condition condition-scalar contraction coordinates counterexample
        discrete-observer error-equations errors-pmi-fast-instants estimate-2-one-correction
        feedforward-printed hurwitz-feedback lyapunov output-bounds prediction-bound radius-motor-apo
        second-case slow-period stable-pmi table-src-1 torque-constant
    """,
}
"""By paper, a certificate of each statement that is soon checked, and a few more."""


def true() -> dict[str, Certificate]:
    """These certificates, by the paths of their files, and those of own plants."""
    paths = (f"{paper}/{name}" for paper, listed in NAMES.items() for name in listed.split())
    listed = {path: json.loads((ROOT / "certificates" / f"{path}.json").read_bytes()) for path in paths}
    return {**listed, **byhand.certificates()}


def altered(certificate: Certificate) -> Iterator[Certificate]:
    """The certificate itself, then changed in one of all places that are alike, as the entries of a matrix are."""
    yield certificate
    rng = Random(certificate["name"])
    for group in ("bound", "witness"):
        yield from _changed(certificate, group, rng)
    if not _of_a_paper(certificate["statement"]):
        own = {**certificate, "paper": None, "claims": []}
        for group in ("plant", "parameters"):
            yield from _changed(own, group, rng)


def _of_a_paper(statement: str) -> bool:
    """Whether a statement stands with certificates of its paper alone."""
    stated = STATEMENTS[statement]
    return stated.source != "" and WORDINGS.search(stated.sentence) is None


def _changed(certificate: Certificate, group: str, rng: Random) -> Iterator[Certificate]:
    alike: dict[tuple[Any, ...], list[tuple[Any, ...]]] = {}
    for place in _places(certificate[group]):
        alike.setdefault(tuple(key if isinstance(key, str) else 0 for key in place), []).append(place)
    chosen = [rng.choice(places) for places in alike.values()]
    for change in CHANGES:
        for place in chosen:
            new = change(_at(certificate[group], place))
            if new is not None:
                yield {**certificate, group: _with(certificate[group], place, new)}
    for key in certificate[group]:
        yield {**certificate, group: {other: value for other, value in certificate[group].items() if other != key}}
    yield {**certificate, group: {**certificate[group], "another": "1"}}


def _at(value: Any, way: tuple[Any, ...]) -> Any:
    for key in way:
        value = value[key]
    return value


def _with(value: Any, way: tuple[Any, ...], new: Any) -> Any:
    """The value with `new` in one place; what lies off the way there is not copied."""
    if not way:
        return new
    key, *rest = way
    found = value.copy()
    found[key] = _with(value[key], tuple(rest), new)
    return found


def _places(value: Any) -> Iterator[tuple[Any, ...]]:
    """The ways to all values but the outermost."""
    keys = value.keys() if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        yield (key,)
        for rest in _places(value[key]):
            yield (key, *rest)


def _number(change: Callable[[Fraction], Fraction]) -> Callable[[Any], Any]:
    def changed(value: Any) -> Any:
        try:
            return str(change(Fraction(value))) if isinstance(value, str) else None
        except ValueError:
            return None

    return changed


def _integer(step: int) -> Callable[[Any], Any]:
    return lambda value: value + step if type(value) is int else None


def _negative(value: Any) -> Any:
    if isinstance(value, list):
        return [_negative(one) for one in value]
    return (
        value[1:] if isinstance(value, str) and value[:1] == "-" else f"-{value}" if isinstance(value, str) else value
    )


CHANGES: tuple[Callable[[Any], Any], ...] = (
    _number(lambda number: number * Fraction(1001, 1000)),
    _number(lambda number: number * Fraction(999, 1000)),
    _number(lambda number: -number),
    _number(lambda number: number + Fraction(1, 2)),
    _number(lambda number: Fraction(0)),
    _number(lambda number: number * 1000),
    _integer(1),
    _integer(-1),
    lambda value: value[:-1] if isinstance(value, list) else None,
    lambda value: [*value, value[-1]] if isinstance(value, list) and value else None,
    lambda value: value[::-1] if isinstance(value, list) else None,
    lambda value: _negative(value) if isinstance(value, list) else None,
    lambda value: "word" if isinstance(value, str) else None,
    lambda value: 1 if isinstance(value, str | list | dict) else None,
)
