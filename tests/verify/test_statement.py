"""A declared statement reads its certificate in the order of its tables, and says what was proved, rounded safely."""

import json
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from flint import arb, ctx, fmpq, fmpq_mat

from replication.verify.reading import Reader, integer, matrix, positive, rational, sized
from replication.verify.run import STATEMENTS, check
from replication.verify.statement import BOTH, DOUBLE, UPPER, Depends, Statement, collected, statement
from replication.verify.theorem import Found, Refused

CERTIFICATES = Path(__file__).parents[2] / "certificates"


def certificate(**fields: Any) -> dict[str, Any]:
    return {"plant": {"name": ""}, "parameters": {}, "bound": {}, "witness": {}, **fields}


@statement(
    "test.sized",
    parameters={"n": sized(integer, 1), "from": rational},
    bound=UPPER,
    witness={"M": Depends(lambda given: sized(matrix, given.n, given.n))},
    holds=True,
)
def of_size(n: int, from_: fmpq, upper: fmpq, M: fmpq_mat) -> None:
    """The matrix of size {n} has from {from_} on
    at most {upper:up 3}, at least {upper:down 1}.

    A second paragraph.
    """
    assert M.nrows() == n


SIZED = certificate(parameters={"n": 1, "from": "-1/2"}, bound={"upper": "2/3"}, witness={"M": [["7"]]})


def test_a_statement_is_read_proved_and_said() -> None:
    theorem = of_size(SIZED)
    assert theorem.sentence == "The matrix of size 1 has from -1/2 on at most 0.667, at least 0.6."
    assert (theorem.upper, theorem.lower, theorem.holds, theorem.items) == (fmpq(2, 3), None, True, ())


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"parameters": {"n": 0, "from": "1"}}, r"parameters\.n must be at least 1, got 0"),
        ({"parameters": {"n": 1}}, "parameters lacks the field from"),
        ({"parameters": {"n": 1, "from": "1", "to": "1"}}, "parameters has the unknown field to"),
        ({"parameters": {"n": 2, "from": "1"}}, r"witness\.M must have 2 entries, got 1"),
        ({"bound": {"upper": "-1"}}, r"bound\.upper must be positive"),
        ({"bound": {}}, "bound lacks the field upper"),
        ({"witness": {"M": [["x"]]}}, r"witness\.M\[0\]\[0\] must be a rational"),
        ({"witness": []}, "witness must be an object"),
    ],
)
def test_what_does_not_fit_its_declaration_is_refused_with_its_path(change: dict[str, Any], reason: str) -> None:
    with pytest.raises(Refused, match=f"^{reason}"):
        of_size({**SIZED, **change})


@pytest.mark.parametrize("group", ["parameters", "bound", "witness"])
def test_what_is_not_declared_must_be_empty(group: str) -> None:
    @statement("test.empty")
    def empty() -> Found:
        """Nothing is {what}."""
        return Found(words={"what": "read"})

    assert empty(certificate()).sentence == "Nothing is read." and empty(certificate()).holds is None
    with pytest.raises(Refused, match=f"{group} has the unknown field lower"):
        empty(certificate(**{group: {"lower": "1"}}))


def test_a_group_may_be_read_as_a_whole_or_left_to_the_proof() -> None:
    @statement("test.whole", plant=lambda value, path: (value, path), bound=None, witness=Depends(whole))
    def of_plant(plant: Any, witness: Any) -> Found:
        """It is."""
        return Found(lower=fmpq(witness), upper=fmpq(len(plant)), holds=False, items=((None, fmpq(1)),))

    theorem = of_plant(certificate(bound={"lower": "anything"}))
    assert (theorem.lower, theorem.upper, theorem.holds, theorem.items) == (7, 2, False, ((None, 1),))


def whole(given: Any) -> Reader:
    assert given.plant == ({"name": ""}, "plant")
    return lambda value, path: 7


def test_a_stated_bound_is_that_of_the_theorem() -> None:
    @statement("test.bound", bound=BOTH)
    def bounded(lower: fmpq, upper: fmpq) -> Found:
        """Between {lower:down} and {upper:up}, from {ball:down 2} to {ball:up 2}, {ball:ball 5}, {balls:ball 3}."""
        ball = arb(1, fmpq(1, 100))
        return Found(lower=fmpq(9), upper=fmpq(9), words={"ball": ball, "balls": [arb(2), arb(3) / 7]})

    theorem = bounded(certificate(bound={"lower": "1", "upper": "2"}))
    assert (theorem.lower, theorem.upper) == (1, 2)
    assert (
        theorem.sentence
        == "Between 1.000000000 and 2.000000000, from 0.98 to 1.02, [1.0 +/- 0.0101], 2.00, [0.429 +/- 4.29e-4]."
    )


def test_a_statement_has_the_bits_it_asks_for() -> None:
    seen: list[int] = []

    def proof() -> None:
        """Done."""
        seen.append(ctx.prec)

    with ctx.workprec(77):
        statement("test.double")(proof)(certificate())
        statement("test.more", bits=128)(proof)(certificate())
        assert ctx.prec == 77
    assert seen == [DOUBLE, 128]


def test_a_statement_without_a_sentence_cannot_be_declared() -> None:
    def silent() -> None:
        pass

    with pytest.raises(RuntimeError, match="run Python without -OO"):
        statement("test.silent")(silent)


def test_statements_are_collected_from_the_modules_of_a_family() -> None:
    family, part = ModuleType("family"), ModuleType("part")
    vars(part).update(of_size=of_size, other=positive)
    vars(family).update(part=part, stray=statement("test.stray")(lambda_with_words))
    assert collected(family) == {"test.sized": of_size}
    vars(part).update(twin=statement("test.sized")(lambda_with_words))
    with pytest.raises(ValueError, match=r"two statements are named test\.sized"):
        collected(family)


def lambda_with_words() -> None:
    """A sentence."""


def test_every_statement_is_declared_once_under_its_name() -> None:
    assert len(STATEMENTS) > 50
    for name, declared in STATEMENTS.items():
        assert isinstance(declared, Statement) and declared.name == name
        assert declared.sentence.endswith(".")
    assert len({id(declared.prove) for declared in STATEMENTS.values()}) == len(STATEMENTS)


@pytest.mark.parametrize("name", STATEMENTS)
def test_no_sentence_on_a_plant_of_ones_own_names_a_plant(name: str) -> None:
    """Its name is free: `motor` would be read as that of a paper."""
    try:
        sentence = STATEMENTS[name].wording(None)
    except Refused:
        return
    assert ".name}" not in sentence


def test_a_plant_of_ones_own_that_is_called_as_that_of_a_paper() -> None:
    """Of all statements on such loops; another gain makes it another plant."""
    for name in ("stable-apo", "hurwitz-feedback", "radius-motor-src"):
        given = json.loads((CERTIFICATES / "shao" / f"{name}.json").read_text(encoding="utf-8"))
        own = {**given, "paper": None, "claims": []}
        assert "motor" in check(given).sentence and "motor" not in check(own).sentence
