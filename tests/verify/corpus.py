"""Certificates on which both arithmetics must say the same: of each statement a true one, and altered ones.

An alteration keeps the file well formed or not, makes it false, or leaves it true with another bound; which of these is
for the verifier to say.
"""

import json
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import byhand
from attacks import certificates, of_a_paper

ROOT = Path(__file__).parents[2]
Certificate = dict[str, Any]


def true() -> dict[str, Certificate]:
    """By the paths of their files, the shortest certificate of each statement, and those of own plants."""
    listed = sorted(certificates(ROOT).items(), key=lambda item: -len(json.dumps(item[1])))
    shortest = {certificate["statement"]: (path, certificate) for path, certificate in listed}
    return {**dict(shortest.values()), **byhand.certificates()}


def altered(certificate: Certificate) -> Iterator[Certificate]:
    """The certificate itself, then changed in one of all places that are alike, as the entries of a matrix are."""
    yield certificate
    rng = Random(certificate["name"])
    for group in ("bound", "witness"):
        yield from _changed(certificate, group, rng)
    if not of_a_paper(certificate["statement"]):
        own = {**certificate, "paper": None, "claims": []}
        for group in ("plant", "parameters"):
            yield from _changed(own, group, rng)


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
