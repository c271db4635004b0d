"""The check of the bytes of a certified file, line by line, and its conclusion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from ...core.errors import InputError
from ...fmu.reference import REFERENCE
from .archive import contents, signature_of
from .keys import fingerprint, is_signed

EVIDENCE = f"{REFERENCE}/vouching/evidence.json"
_MOST_NAMED = 12
"""Most faults of members that are named."""
HOLDS, FAILS, OPEN = 0, 1, 3
"""Exit statuses: all holds, a line does not, no line fails but a judgement is left open."""


class Finding(NamedTuple):
    """One line of a check: whether its `topic` holds, None for a remark, and the sentence on it. Without the
    judgement that is left `open` the file does not hold as a whole."""

    holds: bool | None
    topic: str
    sentence: str
    open: str = ""


@dataclass
class Inspection:
    """What a check found so far; the members can be trusted if all of it holds."""

    members: Mapping[str, bytes] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    public: bytes = b""
    """the key that signed, if the signature holds"""

    @property
    def holds(self) -> bool:
        """Whether nothing is wrong."""
        return all(finding.holds is not False for finding in self.findings)

    def add(self, holds: bool | None, topic: str, sentence: str, left_open: str = "") -> None:
        """Add a finding."""
        self.findings.append(Finding(holds, topic, sentence, left_open))


def check_bytes(
    data: bytes, name: str, key: bytes | None = None, whose: str = "the expected key"
) -> Inspection:
    """Check the bytes of a file of that `name`; never an error, whatever they are. `key` is the public key that must
    have signed: that of whom the receiver expects the signature, or as the text `whose` says."""
    check, faults = Inspection(), list[str]()
    try:
        check.members = contents(data, name)
    except InputError as error:
        faults = str(error).splitlines()[:_MOST_NAMED]
    check.findings.append(_signature(check, data, key, whose, is_read=not faults))
    for fault in faults:
        check.add(False, "members", fault.removeprefix(f"{name}: "))
    if check.public and not faults:
        check.add(True, "members", f"{len(check.members)} members and the archive around them are as signed")
    return check


def _signature(check: Inspection, data: bytes, key: bytes | None, whose: str, is_read: bool) -> Finding:
    """The finding on the signature, left open without an expected `key`; the `check` gets the key of one that holds.
    `is_read` tells whether the members of the file could be read."""
    topic, signature = "signature", signature_of(data)
    if not signature and (EVIDENCE in check.members or not is_read):
        remedy = "ask for it as it was certified"
        damaged = f"is missing: the file is damaged, or another program packed it anew; {remedy}"
        return Finding(False, topic, damaged)
    if not signature:
        return Finding(False, topic, "the file is not signed; chainunit vouch certify FILE signs one")
    message, public, number = signature
    signer = fingerprint(public)
    if not is_signed(public, number, message):
        changed = f"does not hold: the file was changed, or not signed by the key {signer} that it names"
        return Finding(False, topic, changed)
    check.public = public
    if key is None:
        remedy = "whose it is, a file cannot tell: get the key of the signer, and give --key"
        left_open = f"signed by {signer}, whom you have not named"
        return Finding(None, topic, f"is of the key {signer}; {remedy}", left_open)
    if key != public:
        other = f"holds, but by another key: expected {fingerprint(key)}, signed by {signer}"
        return Finding(False, topic, other)
    return Finding(True, topic, f"holds, by {whose} {signer}")


def conclusion(findings: Sequence[Finding]) -> tuple[int, str]:
    """The exit status of a check, and its last line: only what was judged as a whole, by a signer who is named,
    holds."""
    if failed := sum(finding.holds is False for finding in findings):
        return FAILS, f"does not hold: {failed} of {len(findings)} lines fail"
    if not (open_points := list(dict.fromkeys(finding.open for finding in findings if finding.open))):
        return HOLDS, "holds"
    unnamed = next((f.open for f in findings if f.topic == "signature" and f.open), None)
    return OPEN, f"intact, {unnamed}" if unnamed else f"holds, but {' and '.join(open_points)}"
