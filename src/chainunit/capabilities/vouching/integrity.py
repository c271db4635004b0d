"""The check of the bytes of a certified file: signature, members, and the archive around them."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from ...core.errors import printable
from . import archive
from .keys import fingerprint
from .manifest import MANIFEST, OWN, SIGNATURE, Manifest, SignedMember, check_signature, parsed, sha3

NOT_RUN = "experiments"
"""Topic of the line on experiments that are not run."""
_MOST_NAMED = 12
"""Largest number of members that are named one by one."""


class Finding(NamedTuple):
    """One line of a check: whether its `topic` holds, and the words on it; None for a remark. Without the judgement
    that is left `open` the file does not hold as a whole."""

    holds: bool | None
    topic: str
    words: str
    open: str = ""


@dataclass
class Integrity:
    """What the check of the bytes found; the members can be trusted where all of it holds."""

    findings: list[Finding] = field(default_factory=list)
    members: Mapping[str, bytes] = field(default_factory=dict)
    manifest: Manifest | None = None
    is_archive: bool = True
    public: bytes = b""
    """the key that signed, where the signature holds"""

    @property
    def holds(self) -> bool:
        """Whether nothing is wrong."""
        return all(each.holds is not False for each in self.findings)

    def trusted_manifest(self) -> Manifest | None:
        """The manifest of a file that is as signed; of another one a line is added, that its experiments are not
        run."""
        if self.manifest is not None and not self.holds:
            self.add(None, NOT_RUN, "are not run: a file that is not as signed is not loaded")
        return self.manifest if self.holds else None

    def add(self, holds: bool | None, topic: str, words: str, left_open: str = "") -> None:
        """Add a finding."""
        self.findings.append(Finding(holds, topic, words, left_open))


def integrity(data: bytes, key: bytes | None = None, whose: str = "the expected key") -> Integrity:
    """Check the bytes of a file; never an error, whatever they are. `key` is the public key that must have signed:
    that of whom the receiver expects the signature, or as the words `whose` say."""
    read = archive.contents(data)
    found = Integrity(members=read.members, is_archive=read.is_archive)
    places = [archive.located(data, name) for name in (MANIFEST, SIGNATURE)]
    if places == [None, None] and not any(name.startswith(OWN) for name in (*read.members, *read.faults)):
        for name, fault in read.faults.items():
            found.add(False, "archive", _told(name, fault))
        if not read.faults or read.members:
            found.add(False, "signature", "the file is not signed; chainunit vouch certify FILE signs one")
        return found
    contents: dict[str, bytes] = {}
    for name, place in zip((MANIFEST, SIGNATURE), places, strict=True):
        if name in read.members:
            contents[name] = read.members[name]
        elif place is not None:
            # what the directory cannot read stands there all the same: the signature judges it
            contents[name] = data[place[1] : place[2]]
        else:
            found.add(False, "signature", f"{name}: is missing, or its place in the archive is damaged")
    if not found.holds:
        return found
    _judge_signature(found, contents, key, whose)
    if found.public:
        _judge_members(found, data, read, contents, places[0][0] if places[0] else 0)
    return found


def _judge_signature(found: Integrity, contents: Mapping[str, bytes], key: bytes | None, whose: str) -> None:
    public, fault = check_signature(contents[MANIFEST], contents[SIGNATURE])
    if fault:
        found.add(False, "signature", fault)
        return
    found.public, of = public, fingerprint(public)
    if key is None:
        words = f"is of the key {of}; whose key it is, a file cannot tell: get the key of the signer, and give --key"
        found.add(None, "signature", words, f"signed by {of}, whom you have not named")
    elif key == public:
        found.add(True, "signature", f"holds, by {whose} {of}")
    else:
        words = f"holds, but by another key: expected {fingerprint(key)}, signed by {of}"
        found.add(False, "signature", words)


def _judge_members(
    found: Integrity,
    data: bytes,
    read: archive.ArchiveContents,
    contents: Mapping[str, bytes],
    behind: int,
) -> None:
    if (stated := parsed(contents[MANIFEST])) is None:
        found.add(False, "manifest", f"{MANIFEST}: is of a form that this version of chainunit does not know")
        return
    found.manifest = stated
    faults = (
        list(_members(data, read, stated.members, behind))
        or list(_around(data, contents, stated.members))
        or list(_forms(data, read, stated.members))
    )
    for words in faults:
        found.add(False, "members", words)
    if not faults:
        found.add(True, "members", f"{len(stated.members)} members and the archive around them are as signed")


def _told(name: str, fault: str) -> str:
    return f"{printable(name)}: {fault}" if name else fault


def _members(
    data: bytes, read: archive.ArchiveContents, signed: Mapping[str, SignedMember], behind: int
) -> Iterator[str]:
    """Sentences on the members that are not as signed; the manifest stands at the place `behind` [B]."""
    entries = {name: data[own.at : own.at + own.length] for name, own in signed.items()}
    moved = [name for name, own in signed.items() if sha3(entries[name]) != own.entry]
    if not moved:
        return
    if behind == sum(own.length for own in signed.values()):
        # the entries stand where they stood: each is judged at its place, whatever the directory says
        yield from (f"{printable(name)}: {_change(entries[name], signed[name])}" for name in moved)
        return
    if "" in read.faults:
        yield read.faults[""]
        return
    missing, added = archive.missing_and_added(
        [*signed, MANIFEST, SIGNATURE], {**read.members, **read.faults}
    )
    yield from _named(missing, "is missing")
    yield from _named(added, "was added: it is not signed")
    changed = [
        name
        for name, content in read.members.items()
        if name in signed and sha3(content) != signed[name].content
    ]
    yield from _named(changed, "its content is changed")
    yield from (_told(name, fault) for name, fault in read.faults.items())
    if not (missing or added or changed or read.faults):
        yield (
            "the members are as signed, but another program packed the archive anew: its order, times and "
            "compression are not the signed ones; ask for the file as it was certified"
        )


def _named(names: Sequence[str], words: str) -> Iterator[str]:
    yield from (f"{printable(name)}: {words}" for name in names[:_MOST_NAMED])
    if len(names) > _MOST_NAMED:
        yield f"and {len(names) - _MOST_NAMED} more members: {words}"


def _change(entry: bytes, signed: SignedMember) -> str:
    """Words on an entry that is not as signed."""
    content = archive.content_of(entry, signed.size)
    if content is None:
        return "is damaged: it cannot be unpacked at its place in the archive"
    if sha3(content) == signed.content:
        return "its entry in the archive is changed (name, time, sizes or compression), its content is not"
    return "its content is changed"


def _forms(data: bytes, read: archive.ArchiveContents, signed: Mapping[str, SignedMember]) -> Iterator[str]:
    """Sentences on signed entries that are not of the one form: each holds the member that the manifest names, and
    begins at the end of the one before."""
    yield from (_told(name, fault) for name, fault in read.faults.items())
    begin = 0
    for name, own in signed.items():
        content = read.members.get(name)
        if content is None or not archive.is_entry(data[own.at : own.at + own.length], name, content):
            yield f"{printable(name)}: its entry in the archive is of another member, or of another form"
        elif own.at != begin or (own.size, own.content) != (len(content), sha3(content)):
            yield f"{printable(name)}: its place, size or content is not as the manifest says"
        begin = own.at + own.length


def _around(data: bytes, contents: Mapping[str, bytes], signed: Mapping[str, SignedMember]) -> Iterator[str]:
    """Sentences on bytes of the archive beside the signed entries that are not as they must be."""
    heads = [(archive.head_of(data, own.at), own.at) for own in signed.values()]
    names = list(signed)
    at = sum(own.length for own in signed.values())
    for name in (MANIFEST, SIGNATURE):
        last = archive.entry(name, contents[name], stored=True)
        if data[at : at + len(last.whole)] != last.whole:
            yield f"{name}: its entry in the archive is changed (name, time or sizes), its content is not"
        heads.append((last.head, at))
        names.append(name)
        at += len(last.whole)
    try:
        records = archive.directory(heads)
        end = archive.end(records, at)
    except struct.error:
        yield f"{MANIFEST}: tells of entries that no archive has"
        return
    for name, record in zip(names, records, strict=True):
        if data[at : at + len(record)] != record:
            yield f"{printable(name)}: its line in the directory of the archive is changed, its content is not"
        at += len(record)
    if data[at:] != end:
        yield "the end of the archive is changed: count of members, place of the directory, or a comment"
