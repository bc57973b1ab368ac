"""A statement, declared once: what its certificate holds, how each field is read, and the sentence that is proved.

    @statement("family.what", plant=read_plant, witness={"left": positive, "right": positive}, holds=True)
    def what(plant: Plant, left: fmpq, right: fmpq) -> None:
        '''The plant has a root between {left:down} and {right:up 7}.'''
        ...  # refuse unless the witness proves it

The sentence is the first paragraph of the docstring, a format string on what is read and found, in which `{x:down}` and
`{x:up 7}` round to 9 and 7 decimals, to the safe side, and `{x:ball 9}` shows balls to 9 digits with their radius. The
ends of a range for which something is said to hold are rounded into it, or not at all.
`{subject}` is the plant, by its name in the papers' `plants.py`; one of one's own is "this plant".
`<Theorem 3|the program>` names a place of the paper `source` in a certificate of that paper, and says the other words
in any other; a statement with a source and no such words stands with certificates of that paper alone: a plant of
one's own never borrows a paper's words.
A group (plant, parameters, bound, witness) is a table of readers by field, whose values are passed by the names of the
fields, or a reader of the whole, passed by the name of the group; None is not read. The plant is None and the others
are empty unless declared. Groups and fields are read in the order in which they are declared.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from keyword import iskeyword
from string import Formatter
from types import ModuleType, SimpleNamespace
from typing import Any

from flint import arb, ctx, fmpq

from replication.verify.algebra.linear import above, below
from replication.verify.algebra.work import budget
from replication.verify.predicate import Says, as_data
from replication.verify.reading import Reader, fields, positive
from replication.verify.theorem import Found, Theorem, require


@dataclass(frozen=True)
class Depends:
    """A reader, or a table of readers, made from what was read before it, which are the attributes of its argument."""

    make: Callable[[Any], Any]


Table = Mapping[str, Reader | Depends]
Group = Table | Reader | Depends | None
LOWER: Mapping[str, Reader] = {"lower": positive}
UPPER: Mapping[str, Reader] = {"upper": positive}
BOTH: Mapping[str, Reader] = {**LOWER, **UPPER}
GROUPS: Mapping[str, Group] = {"plant": None, "parameters": {}, "bound": {}, "witness": {}}
WORDINGS = re.compile(r"<([^<>|]*)\|([^<>|]*)>")
"""What a sentence says with the certificates of its paper, and with others."""
DOUBLE = 53
"""Bits of the balls, unless a statement asks for more."""


@dataclass(frozen=True, eq=False)
class Statement:
    """One declared statement; called with the fields of a certificate it gives the theorem, or raises Refused."""

    name: str
    sentence: str
    source: str
    groups: Mapping[str, Group]
    holds: bool | None
    bits: int
    says: tuple[Says, ...]
    prove: Callable[..., Found | None]

    def __call__(self, certificate: Mapping[str, Any], bounds: Mapping[str, fmpq] | None = None) -> Theorem:
        """Read what is declared, prove it, and say so; refused unless what is proved has these bounds, if any."""
        with ctx.workprec(self.bits), budget():
            values = self.read(certificate)
            proof = self.prove(**values) or Found()
            sides = {side: values.get(side, getattr(proof, side)) for side in ("lower", "upper")}
            for side, number in (bounds or {}).items():
                require(sides[side] == number, f"the {side} bound that is proved is {sides[side]}, not {number}")
            whole = replace(proof, holds=self.holds if proof.holds is None else proof.holds, **sides)
            # The name is that of the paper's data: none is taken from a certificate of one's own.
            named = certificate.get("paper") is not None and certificate["plant"].get("name")
            subject = f"the plant {named}" if named else "this plant"
            known = {"subject": subject, **values, **proof.words, **sides}
            sentence = _Words().vformat(self.wording(certificate.get("paper")), (), known)
            says = as_data(self.says, self.source, certificate, known, whole)
            return Theorem(sentence=sentence, says=says, holds=whole.holds, items=whole.items, **sides)

    def wording(self, paper: str | None) -> str:
        """The sentence for a certificate of this paper, to be filled in; refused if it would borrow another's words."""
        borrowed = self.source not in ("", paper)
        require(
            not borrowed or WORDINGS.search(self.sentence) is not None,
            f"{self.name} names places of the paper {self.source}, and stands with certificates of that paper only",
        )
        # A plant of one's own has no name that a sentence could take for one of a paper.
        own = borrowed or paper is None
        return WORDINGS.sub(lambda words: words[2 if own else 1], self.sentence)

    def read(self, certificate: Mapping[str, Any]) -> dict[str, Any]:
        """The values of all declared fields, by name; that of a keyword of Python ends in an underscore."""
        values = SimpleNamespace()
        for name, group in self.groups.items():
            group = _made(group, values)
            if isinstance(group, Mapping):
                for key, value in zip(group, fields(certificate[name], name, *group), strict=True):
                    read = _made(group[key], values)(value, f"{name}.{key}")
                    setattr(values, f"{key}_" if iskeyword(key) else key, read)
            elif group is not None:
                setattr(values, name, group(certificate[name], name))
        return vars(values)


def _made(reader: Any, values: SimpleNamespace) -> Any:
    return reader.make(values) if isinstance(reader, Depends) else reader


def statement(
    name: str,
    *,
    source: str = "",
    holds: bool | None = None,
    bits: int = DOUBLE,
    says: str | Says | tuple[str | Says, ...] = (),
    **groups: Group,
) -> Callable[[Callable[..., Found | None]], Statement]:
    """Declare a statement; the function that is decorated proves it, or raises Refused.

    source: the paper whose places the sentence names. holds: whether a yes/no statement is true, unless the proof finds
    that out. bits: of all balls. says: the quantities of which the theorem speaks, as data; a name is one with all
    parameters in its setting.
    """
    entries = says if isinstance(says, tuple) else (says,)
    terms = tuple(Says(quantity=entry) if isinstance(entry, str) else entry for entry in entries)
    ordered = {**groups, **{group: empty for group, empty in GROUPS.items() if group not in groups}}

    def declared(prove: Callable[..., Found | None]) -> Statement:
        if prove.__doc__ is None:
            raise RuntimeError("the sentences of the theorems are docstrings: run Python without -OO")
        sentence = " ".join(prove.__doc__.split("\n\n")[0].split())
        return Statement(name, sentence, source, ordered, holds, bits, terms, prove)

    return declared


def collected(*families: ModuleType) -> dict[str, Statement]:
    """The statements that the modules of these families declare, by name; raises ValueError if two have the same."""
    modules = [part for family in families for part in vars(family).values() if isinstance(part, ModuleType)]
    declared = [value for module in modules for value in vars(module).values() if isinstance(value, Statement)]
    statements: dict[str, Statement] = {}
    for item in declared:
        if statements.setdefault(item.name, item) is not item:
            raise ValueError(f"two statements are named {item.name}")
    return statements


class _Words(Formatter):
    """Numbers rounded to the safe side, to so many decimals; balls, or lists of them, to so many digits."""

    def format_field(self, value: Any, format_spec: str) -> str:
        kind, *places = format_spec.split(" ")
        if kind == "ball":
            balls = value if isinstance(value, list) else [value]
            return ", ".join(ball.str(*map(int, places), radius=True) for ball in balls)
        if kind not in ("down", "up"):
            return str(super().format_field(value, format_spec))
        if isinstance(value, arb):
            value = (value.lower() if kind == "down" else value.upper()).fmpq()
        return (below if kind == "down" else above)(fmpq(value), *map(int, places))
