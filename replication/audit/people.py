"""Who stands behind a text and its audit: authors with ORCIDs, their replies to claims, who checks it."""

import re

import msgspec

PLACEHOLDER = re.compile(r"FIXME|TODO|X{4,}|^TITLE$|\bA\. AUTHOR\b|\bIN A SENTENCE\b")
"""What a template or a form leaves to be filled in."""
_ORCID = re.compile(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]")
_CERTIFICATE = re.compile(r"\d{4}-\d{3}")
_ORCID_ADDRESS = "https://orcid.org/"


def plain_orcid(text: str) -> str:
    """The identifier without an address in front; ValueError for one whose check digit (ISO 7064, 11-2) is wrong."""
    digits = text.removeprefix(_ORCID_ADDRESS)
    total = 0
    for digit in digits.replace("-", "")[:-1]:
        total = (total + int(digit)) * 2 if digit.isdigit() else 0
    check = "0123456789X"[(12 - total % 11) % 11]
    if not _ORCID.fullmatch(digits) or digits[-1] != check:
        raise ValueError(f"the ORCID {text!r} is none; copy it from orcid.org, such as 0000-0002-1825-0097")
    return digits


class Named(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A person; orcid: the plain identifier, empty if it is not known."""

    name: str
    orcid: str = ""

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise ValueError("a name is empty; write it")
        if self.orcid and plain_orcid(self.orcid) != self.orcid:
            raise ValueError(f"the ORCID {self.orcid!r} has an address in front; write {plain_orcid(self.orcid)!r}")


class Reply(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the authors answer to the verdict on a claim; it is shown with the claim, and changes no verdict.

    claim: its id, without the key of the paper in `paper.toml`. by: who replies. date: such as 2026-11-24.
    """

    claim: str
    text: str
    by: str = ""
    date: str = ""

    def __post_init__(self) -> None:
        if not self.text.strip():
            raise ValueError(f"the reply to {self.claim!r} is empty; write what the authors say, or take it out")
        if self.date and not re.fullmatch(r"\d{4}-\d\d-\d\d", self.date):
            raise ValueError(f'the date {self.date!r} of a reply is none; write year, month and day, as "2026-11-24"')


class Codecheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What codecheck.yml says of a check, by the person who does it.

    paper: the key of the paper that is checked, if there are several. codechecker: who checks. certificate: the number
    that the register gave, such as 2026-001. report: address or DOI of the certificate. check_time: when it was done.
    summary: of the certificate; without one, how many claims agree.
    """

    paper: str = ""
    codechecker: tuple[Named, ...] = ()
    certificate: str = ""
    report: str = ""
    check_time: str = ""
    summary: str = ""

    def __post_init__(self) -> None:
        if self.certificate and not _CERTIFICATE.fullmatch(self.certificate):
            raise ValueError(
                f"the certificate {self.certificate!r} is no number of the register; write year and number, as 2026-001"
            )
        for name, text in (("report", self.report), ("summary", self.summary), ("check_time", self.check_time)):
            if PLACEHOLDER.search(text):
                raise ValueError(f"{name} = {text!r} is a placeholder; write what it stands for, or leave it out")
