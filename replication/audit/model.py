"""The words of an audit as frozen data: claims, evidence, verdicts, errata, figures, scope, papers.

A paper module builds one `Paper` from these. Everything that reaches the disk is a `msgspec.Struct`; what holds a
function beside it stays in memory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import msgspec

from replication.audit.brief import Consequence
from replication.verify.predicate import NO_READING as NO_READING
from replication.verify.predicate import Predicate

Results = Mapping[str, Any]
"""Results of the experiments of a paper, by their names without its key; plain JSON values."""

Numbers = float | tuple[float | tuple[float, ...], ...]
"""A computed quantity in the layout of its print: scalar, list or matrix; a complex entry is (real, imaginary)."""


class Kind(StrEnum):
    """What sort of statement a claim makes; decides how `verdict.judge` compares it."""

    VALUE = "value"
    MATRIX = "matrix"
    BOUND = "bound"
    ORDER = "order"
    FEASIBLE = "feasible"
    STATISTICAL = "statistical"
    CITED = "cited"


NUMERIC = (Kind.VALUE, Kind.MATRIX, Kind.BOUND)
"""Kinds that compare printed numbers."""


class Verdict(StrEnum):
    """The outcome of comparing a claim with its evidence; `ERROR` means that there is no evidence to compare."""

    REPRODUCED = "reproduced"
    REPRODUCED_AFTER_ERRATUM = "reproduced after erratum"
    COMPATIBLE = "compatible"
    CONSISTENT = "consistent"
    DIFFERS = "differs"
    REFUTED = "refuted"
    UNDETERMINED = "undetermined"
    ERROR = "error"


AGREES = (Verdict.REPRODUCED, Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.COMPATIBLE, Verdict.CONSISTENT)
DISAGREES = (Verdict.DIFFERS, Verdict.REFUTED)
HOLDS = (Verdict.REPRODUCED, Verdict.CONSISTENT)
"""Of claims that agree as they stand."""
CORRECTED = (Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.COMPATIBLE)
"""Of claims that agree with what is meant, not with what is printed."""


class Policy(StrEnum):
    """A rule that like cases share, over all papers; `judge.policies` says each and applies it."""

    SOLVER = "level that a solver found"
    SOME = "agreement under some readings"
    CONSTANT = "constant that the text leaves open"
    RULED_OUT = "reading that the text rules out"
    FACT = "one fact, one count"
    OWN = "own plants and own draws"
    ERRATUM = "agrees once corrected"
    SCAN = "slip of the text at hand"
    INPUTS = "rounding of printed inputs"
    REMARK = "remark of ours"


class SolverRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a numerical solver said of itself: never an answer, always shown beside one."""

    name: str
    version: str
    status: str
    options: dict[str, float | int | str | bool] = {}
    residuals: dict[str, float] = {}
    iterations: int | None = None


class Reading(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is assumed where the text leaves a choice: a norm, a start, a degree rule, a class of estimators.

    name: by which claims refer to it. place: where the text leaves the choice. text: the assumption in plain words.
    short: the same in a few words that follow "assuming"; the name if empty.
    inference: whether it was chosen with the printed numbers in view. policy: why it is one, where a policy says what
    follows: a plant, filter or draw of ours, a constant that the text leaves open, a level where a solver stopped, or
    a reading that the text rules out, which is told and not counted. accuracy: of such a solver, relative, of the
    square of the level, which is what the inequalities are linear in.
    """

    name: str
    place: str
    text: str
    short: str = ""
    inference: bool = False
    policy: Policy | None = None
    accuracy: float | None = None


class Outcome(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What comes out for a claim under one reading of a family: a value with its bracket, or whether it holds."""

    reading: str
    value: Numbers | None = None
    lower: Numbers | None = None
    upper: Numbers | None = None
    holds: bool | None = None
    margin: float | None = None

    @property
    def evidence(self) -> Evidence:
        """The same as evidence of its own."""
        fields = {name: getattr(self, name) for name in self.__struct_fields__ if name != "reading"}
        return Evidence(method=f"under {self.reading}", **fields)


class How(StrEnum):
    """How the range of an outcome over printed inputs was found: an enclosure, or the ends that a search reached."""

    INTERVALS = "interval arithmetic"
    SEARCH = "search"


class OverInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The range of a computed number over all inputs that round to their prints, and how it was found."""

    lower: float
    upper: float
    how: How


class Evidence(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What was computed for a claim, how, and how that was checked.

    value: the computed quantity, in the layout of the printed value (`Numbers`).
    lower, upper: a bracket of the true quantity, same layout as `value`.
    holds, margin: for order and feasible claims, whether the statement holds and by how much (positive if it holds).
    threshold: for those, the number that `holds` compares a residual with, if the statement holds up to rounding, a
    printed digit or the like; the residual is then threshold − margin. threshold_reason: why that much is allowed.
    probability: for statistical claims, the two-sided probability of a draw at least as extreme as the printed one.
    draws: the number of draws among which that probability is a rank; it cannot be shown to be less than they allow.
    quantities: named numbers that stand behind the answer and are shown with it.
    as_printed: for a claim with an erratum, the evidence for the text as printed (`value` is then the corrected one).
    outcomes: under each reading of a family, where the text leaves a choice on which the answer may depend.
    over_inputs: the range of a single number over all inputs that round to their prints.
    not_checkable: the reason, if the text does not settle the claim. settled_by: what would, such as another paper.

    The run fills in the rest. code: file:line of the function that answers the claim. seconds: of the experiments that
    it uses, together. certificates: the files whose theorems support the claim. untraced: what those experiments did
    that nothing can follow, such as starting a program that they do not declare.
    """

    method: str
    cross_check: str = ""
    value: Numbers | None = None
    lower: Numbers | None = None
    upper: Numbers | None = None
    holds: bool | None = None
    margin: float | None = None
    threshold: float | None = None
    threshold_reason: str = ""
    probability: float | None = None
    draws: int | None = None
    quantities: dict[str, float] = {}
    solvers: tuple[SolverRecord, ...] = ()
    note: str = ""
    outcomes: tuple[Outcome, ...] = ()
    over_inputs: OverInputs | None = None
    not_checkable: str = ""
    settled_by: str = ""
    as_printed: Evidence | None = None
    code: str = ""
    seconds: float = 0.0
    certificates: tuple[str, ...] = ()
    untraced: tuple[str, ...] = ()


class Judgement(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What comparing a claim with its evidence gives; `judge.verdict` is the only maker.

    reason: why this verdict, in one sentence.
    deviation_ulp: (computed − printed) in units of the last printed place, the largest in size over the entries.
    intervals: ends of what each printed number stands for, as exact fractions; none beside a relation.
    proved: whether a theorem says what the claim says. supported: else, if there are theorems beside it, what they do
    not say. unproved: why there is none. policies: those that touched the claim. readings: under how many it agrees,
    of how many that the verdict counts, where there are several.
    """

    verdict: Verdict
    reason: str
    deviation_ulp: float | None = None
    intervals: tuple[tuple[str, str], ...] = ()
    proved: bool = False
    supported: str = ""
    unproved: str = ""
    policies: tuple[Policy, ...] = ()
    readings: tuple[int, int] = (0, 0)

    def further(self, *sentences: str, policies: Iterable[Policy] = (), **changes: Any) -> Judgement:
        """The same with more sentences in its reason, the policies that touched it too, and other changes."""
        fields = {
            "reason": " ".join(filter(None, (self.reason, *sentences))),
            "policies": tuple(dict.fromkeys((*self.policies, *policies))),
        }
        return msgspec.structs.replace(self, **(fields | changes))


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """A pure function of `inputs` (JSON values) that returns JSON values; cached by its sources, inputs and the lock.

    `name` starts with the key of its paper. `function` is importable at module level, so that a worker can find it.
    timeout: seconds after which it is ended; None for those of the run. needs: experiments whose files a command gets.
    given: the printed values among its inputs, each with its place.
    """

    name: str
    function: Callable[..., Any]
    inputs: Mapping[str, Any] = field(default_factory=dict)
    timeout: float | None = None
    needs: tuple[str, ...] = ()
    given: frozenset[tuple[str, str]] = field(default=frozenset(), repr=False)

    def is_given(self, claim: StatedClaim) -> bool:
        """Whether it is given the print of this claim, which it may then only hand back."""
        return bool(claim.printed) and (claim.printed, claim.place) in self.given


class StatedClaim(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One checkable statement of a paper, as the results hold it.

    id: `paper.topic.detail`, lower case. place: where it stands, for example `Table 1, column (2,3)`.
    statement: in plain words of ours. printed: the printed string, empty if the claim prints no number.
    expected: the pinned verdict. uses: names of the experiments whose results `answer` read, filled in by the run.
    tolerance: half-width other than half a unit in the last printed place; needs `tolerance_reason`.
    uncertainty: what the uncertainty that is printed with the number is, one of `judge.agreement.KINDS`.
    erratum: id of the erratum under which the claim is reproduced, if it is one of those.
    meant: what must be printed instead, if that erratum corrects the printed result and not what it follows from.
    reading: name of the reading of the paper that the claim rests on, or `NO_READING`.
    optimum: whether the printed number is the least level that any design reaches.
    repeats: id of the claim that says the same as data, filled in by `declare.paper`; totals count the fact once.
    ours: whether the text does not say it, but we do beside it; totals leave it out.
    consequence: what falls with it, where kind and place do not tell.
    says: the same statement as data, all of which must be so; a theorem proves the claim only if it says that.
    unit, remark: of the print, the unit and the note of the file of printed data.
    """

    id: str
    place: str
    kind: Kind
    statement: str
    expected: Verdict
    uses: tuple[str, ...] = ()
    printed: str = ""
    tolerance: str | None = None
    tolerance_reason: str = ""
    erratum: str | None = None
    reading: str = ""
    optimum: bool = False
    repeats: str = ""
    ours: bool = False
    consequence: Consequence | None = None
    says: tuple[Predicate, ...] = ()
    meant: str = ""
    unit: str = ""
    remark: str = ""
    uncertainty: str = ""


class Claim(StatedClaim, frozen=True, kw_only=True):
    """A claim as its paper declares it, on the function that answers it."""

    answer: Callable[[Results], Evidence]


class Proof(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The computation behind an erratum: whether it bears the correction out, and the numbers that say so."""

    holds: bool
    text: str
    quantities: dict[str, float] = {}


@dataclass(frozen=True)
class Erratum:
    """A misprint: what is printed, what must be meant, and the computation that proves or suggests it.

    scan: whether the slip may be of the text at hand and not of the paper; what rests on it alone is not charged.
    """

    id: str
    place: str
    printed: str
    meant: str
    prove: Callable[[Results], Proof]
    inference: bool = False
    scan: bool = False
