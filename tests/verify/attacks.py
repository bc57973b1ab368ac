"""Certificates altered by somebody who wants a false theorem to be accepted: none of these may prove anything.

Every attack turns the bytes of a true certificate into those of a false, a foreign or a malformed one. What is altered,
and how, is drawn from a generator; so the same seed gives the same attacks.
"""

import copy
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from replication.verify.run import STATEMENTS
from replication.verify.statement import WORDINGS

Certificate = dict[str, Any]
Attack = Callable[[np.random.Generator, Certificate, Mapping[str, Certificate]], bytes]
Place = tuple[Any, Any]
"""An object or a list, and a key or a position in it."""

NOT_EXACT = (
    "NaN", "nan", "inf", "-Infinity", "1e400", "1e999999999", "1.5", "0x10", "1/0",  "1/-2", "+1", "01", "1_0",
    "1 ", "", "½", "１", "pi", "9" * 3000, "1/" + "9" * 3000, 1.5, float("nan"), float("inf"), 10**12, 1, True, None,
    [], {}, ["1"], {"1": "1"},
)  # fmt: skip
"""What stands for no rational number in a certificate."""


def certificates(root: Path) -> dict[str, Certificate]:
    """The committed certificates, by paper and name."""
    files = sorted((root / "certificates").rglob("*.json"))
    return {f"{path.parent.name}/{path.stem}": json.loads(path.read_bytes()) for path in files}


def own(certificate: Certificate) -> Certificate:
    """A copy that is about a plant of one's own, so that only the mathematics can refuse it."""
    return {**copy.deepcopy(certificate), "paper": None, "claims": []}


def numbers(value: Any) -> Iterator[Place]:
    """The places of all rationals in a JSON value."""
    for inner, key in places(value):
        if isinstance(inner[key], str) and inner[key].replace("/", "").replace("-", "").isdigit():
            yield inner, key


def places(value: Any) -> Iterator[Place]:
    """All places in a JSON value."""
    keys: Sequence[Any] = (
        list(value) if isinstance(value, dict) else range(len(value) if isinstance(value, list) else 0)
    )
    for key in keys:
        yield value, key
        yield from places(value[key])


def encoded(certificate: Certificate) -> bytes:
    """The bytes of a certificate, with whatever it holds."""
    return json.dumps(certificate).encode()


def no_number(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """Something in place of a rational of the bound or the witness."""
    altered = own(certificate)
    found = [*numbers(altered["bound"]), *numbers(altered["witness"])] or [(altered, "bound"), (altered, "witness")]
    inner, key = found[rng.integers(len(found))]
    inner[key] = NOT_EXACT[rng.integers(len(NOT_EXACT))]
    if inner[key] == {}:
        inner[key] = [{}]
    return encoded(altered)


def other_shape(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """A field or an entry of the witness, or all of it, that is missing, doubled, empty or wrapped."""
    altered = own(certificate)
    found = list(places(altered["witness"])) or [(altered, "bound"), (altered, "witness")]
    inner, key = found[rng.integers(len(found))]
    match int(rng.integers(4)):
        case 0:
            del inner[key]
        case 1 if isinstance(inner, list):
            inner.insert(key, copy.deepcopy(inner[key]))
        case 1:
            inner[f"{key}_"] = inner[key]
        case 2:
            inner[key] = [inner[key]]
        case _:
            inner[key] = "" if isinstance(inner[key], str) else [] if inner[key] else [[]]
    return encoded(altered)


def better_bound(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """A bound that is better than the one proved, negative, or on the other side."""
    altered = own(certificate)
    bound = altered["bound"]
    if not bound:
        altered["bound"] = {("lower", "upper")[rng.integers(2)]: "1"}
        return encoded(altered)
    side = sorted(bound)[rng.integers(len(bound))]
    value, sign = Fraction(bound[side]), 1 if side == "lower" else -1
    match rng.integers(4):
        case 0:
            bound[side] = str(value * (1 + sign * Fraction(1, int(rng.integers(2, 1000)))))
        case 1:
            bound[side] = str(-value)
        case 2:
            bound[side] = str(value * Fraction(10) ** int(sign * rng.integers(1, 300)))
        case _:
            bound["middle"] = bound.pop(side)
    return encoded(altered)


def other_subject(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """Fields of another theorem in place of those that say what this one is about; or all but those."""
    altered = copy.deepcopy(certificate)
    names = ("paper", "name", "claims", "statement", "plant", "parameters")
    donors = [other for other in others.values() if any(other[field] != certificate[field] for field in names[2:])]
    donor = copy.deepcopy(donors[rng.integers(len(donors))])
    if rng.integers(2):
        return encoded(donor)
    different = [field for field in names if donor[field] != certificate[field]]
    field = different[rng.integers(len(different))]
    altered[field] = donor[field]
    return encoded(altered)


def altered_subject(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """One number, name or list of the plant, the parameters or the claims that is not that of the theorem."""
    altered = copy.deepcopy(certificate)
    found = [place for field in ("plant", "parameters", "claims") for place in places(altered[field])]
    inner, key = found[rng.integers(len(found))]
    inner[key] = "0" if inner[key] != "0" else "1"
    return encoded(altered)


def other_witness(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """The witness of another theorem, and better bounds that it might give.

    Without a bound, that of the same statement for another plant could be a good one: it is one of another statement.
    """
    altered = own(certificate)
    fields = certificate["witness"].keys()
    donors = [other for other in others.values() if other["witness"] and other["witness"].keys() != fields]
    same = [other for other in others.values() if other["statement"] == certificate["statement"] and other["bound"]]
    chosen = same if same and rng.integers(2) else donors
    altered["witness"] = chosen[rng.integers(len(chosen))]["witness"]
    for side, factor in (("lower", Fraction(2)), ("upper", Fraction(1, 2))):
        if side in altered["bound"]:
            altered["bound"][side] = str(Fraction(altered["bound"][side]) * factor)
    return encoded(altered)


def other_text(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """Bytes that two readers could understand in two ways, or that are no JSON."""
    text = json.dumps(certificate)
    middle = int(rng.integers(1, len(text) - 1))
    key = sorted(certificate)[rng.integers(len(certificate))]
    return (
        text[:middle].encode(),
        text.encode() + text.encode(),
        b"\xef\xbb\xbf" + text.encode(),
        text.encode("utf-16"),
        text.encode() + b"\x00",
        text.replace('"', "'").encode(),
        f"// proved\n{text}".encode(),
        f'{{"{key}": null, {text[1:]}'.encode(),
        f'{text[:-1]}, "{key}": {json.dumps(certificate[key])}}}'.encode(),
        f'{text[:-1]}, "{key}\\u0000": 1}}'.encode(),
        text.replace('"witness": {', '"witness": {"x": 1e999999999, ').encode(),
        text.replace('"witness": {', '"witness": {"x": NaN, ').encode(),
        text.replace('"witness": {', '"witness": {"x": ' + "[" * 50_000).encode(),
        text.replace('"witness": {', '"witness": {"x": ' + "9" * 50_000 + ", ").encode(),
        text.encode() + b" " * 2_000_000,
    )[rng.integers(15)]


def unrelated_claim(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """A true theorem under the name, or for the claims, of another one."""
    fields = (("paper", "name", "claims"), ("paper", "name"), ("paper", "name", "claims", "statement"))[rng.integers(3)]
    donors = [
        other
        for other in others.values()
        if other["statement"] != certificate["statement"]
        # Facts without a witness may differ in their statement alone.
        and any(other[field] != certificate[field] for field in certificate.keys() - {*fields})
    ]
    donor = copy.deepcopy(donors[rng.integers(len(donors))])
    return encoded({**donor, **{field: certificate[field] for field in fields}})


def own_for_claims(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """A true theorem about a plant of one's own that is to support claims of a paper."""
    claimed = [other["claims"] for other in others.values() if other["claims"]]
    claims = claimed[rng.integers(len(claimed))]
    return encoded({**own(certificate), "claims": claims[: 1 + rng.integers(len(claims))]})


def other_reading(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """A theorem of a paper under another reading than the wanted one: with a parameter of another theorem."""
    known = [(other, name) for other in others.values() for name in other["parameters"]]
    given, name = known[rng.integers(len(known))]
    values = [other["parameters"][name] for other, key in known if key == name]
    choices = [value for value in values if value != given["parameters"][name]] or ["another"]
    altered = copy.deepcopy(given)
    altered["parameters"][name] = copy.deepcopy(choices[rng.integers(len(choices))])
    return encoded(altered)


def borrowed_words(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """A true theorem whose sentence is about the text of a paper, as one about a plant of one's own."""
    about = [other for other in others.values() if of_a_paper(other["statement"])]
    return encoded(own(about[rng.integers(len(about))]))


def of_a_paper(statement: str) -> bool:
    """Whether a statement stands with certificates of its paper alone."""
    stated = STATEMENTS[statement]
    return stated.source != "" and WORDINGS.search(stated.sentence) is None


def near_rounding(rng: np.random.Generator, certificate: Certificate, others: Mapping[str, Certificate]) -> bytes:
    """A bound on the wrong side of the proved one, by less than what a sentence shows."""
    small = Fraction(1, 10 ** int(rng.integers(9, 40)))
    both = [other for other in others.values() if {"lower", "upper"} <= other["bound"].keys()]
    halves = [name for name in others if name.endswith("-upper") and _same_number(name, others)]
    chosen = int(rng.integers(len(both) + len(halves)))
    if chosen < len(both):
        altered, other = own(both[chosen]), both[chosen]["bound"]
        side = ("lower", "upper")[rng.integers(2)]
    else:
        name = halves[chosen - len(both)]
        side = ("lower", "upper")[rng.integers(2)]
        altered = own(others[f"{name[:-6]}-{side}"])
        other = {"lower": others[f"{name[:-6]}-lower"]["bound"]["lower"], "upper": others[name]["bound"]["upper"]}
    beyond = Fraction(other["upper"]) * (1 + small) if side == "lower" else Fraction(other["lower"]) * (1 - small)
    altered["bound"][side] = str(beyond)
    return encoded(altered)


def _same_number(upper: str, others: Mapping[str, Certificate]) -> bool:
    """Whether the two halves of a bracket bound one number: at another degree a larger bound may be true."""
    lower = others.get(f"{upper[:-6]}-lower")
    return lower is not None and all(others[upper]["parameters"].get(k) == v for k, v in lower["parameters"].items())


ATTACKS: tuple[Attack, ...] = (
    no_number,
    other_shape,
    better_bound,
    other_subject,
    altered_subject,
    other_witness,
    other_text,
    unrelated_claim,
    own_for_claims,
    other_reading,
    borrowed_words,
    near_rounding,
)
