"""The manifest of a certified file: every member by name, place and hash; and the signature over it.

The manifest and its signature are the last two entries of the archive, without compression. The manifest states for
each other member the SHA3-256 (FIPS 202) of its content, and of its whole entry in the archive, head and compressed
bytes. All that is left of the file - the heads of the last two entries and the directory - follows from the manifest
and is compared byte for byte. So the signature covers each bit of the file.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from ...core.errors import InputError
from ...core.inputs import json_of
from ...fmu.reference import REFERENCE
from . import archive
from .keys import fingerprint, is_signed

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

OWN = f"{REFERENCE}/vouching"
"""The folder of what is written about a file."""
MANIFEST, SIGNATURE = f"{OWN}/manifest.json", f"{OWN}/signature.json"
FORM = "chainunit vouching 1"
"""Form of the manifest: its number changes where an earlier `verify` would misread it."""
ALGORITHM = "Ed25519"


def sha3(content: bytes) -> str:
    """The SHA3-256 of some bytes in hexadecimal digits."""
    return hashlib.sha3_256(content).hexdigest()


def json_bytes(data: Any) -> bytes:
    """A file in JSON with one form only: sorted keys, no character beyond ASCII."""
    return json.dumps(data, indent=1, sort_keys=True, allow_nan=False).encode() + b"\n"


def json_value(content: bytes | None, name: str) -> Any:
    """The value in a file in JSON, whose numbers are finite.

    Raises
    ------
    InputError
        where there is no such file, or it is none.
    """
    if content is None:
        raise InputError(f"{name}: is missing")
    return json_of(content, name)


class SignedMember(NamedTuple):
    """A member as the manifest states it: size and hash of its content; place, length and hash of its entry."""

    size: int
    content: str
    at: int
    length: int
    entry: str


@dataclass(frozen=True)
class Manifest:
    """What is signed."""

    kind: str
    """"fmu" or "ssp\""""
    name: str
    version: str
    """of this package, when it certified"""
    time: str
    members: Mapping[str, SignedMember]

    def data(self) -> dict[str, Any]:
        """The content of manifest.json."""
        members = {name: member._asdict() for name, member in self.members.items()}
        head = {"form": FORM, "hash": "SHA3-256", "chainunit": self.version, "time": self.time}
        return {**head, "kind": self.kind, "name": self.name, "members": members}


def parsed(content: bytes) -> Manifest | None:
    """The manifest in the content of its file; None where it is not of this form."""
    try:
        data = json_value(content, MANIFEST)
        members = {str(name): SignedMember(**own) for name, own in data["members"].items()}
        texts = [data[key] for key in ("kind", "name", "chainunit", "time")]
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None
    for member in members.values():
        counts, hashes = (member.size, member.at, member.length), (member.content, member.entry)
        if any(type(x) is not int or x < 0 for x in counts) or any(type(x) is not str for x in hashes):
            return None
    if not all(isinstance(text, str) for text in texts):
        return None
    manifest = Manifest(texts[0], texts[1], texts[2], texts[3], members)
    # there is one form of these data: of a name that stands twice, another reader may take the other
    return manifest if json_bytes(manifest.data()) == content else None


def signed(
    contents: Mapping[str, bytes], key: Ed25519PrivateKey, *, kind: str, name: str, version: str, time: str
) -> bytes:
    """The certified file with these members, signed with the key; the same arguments give the same bytes.

    Raises
    ------
    InputError
        see `archive.archive`.
    """
    entries, members, at = [], {}, 0
    for member in sorted(contents):
        content = contents[member]
        own = archive.entry(member, content)
        whole = own.whole
        entries.append(own)
        members[member] = SignedMember(len(content), sha3(content), at, len(whole), sha3(whole))
        at += len(whole)
    manifest = json_bytes(Manifest(kind, name, version, time, members).data())
    public = key.public_key().public_bytes_raw()
    last = json_bytes(_signature(manifest, public, key.sign(manifest)))
    entries += [
        archive.entry(MANIFEST, manifest, stored=True),
        archive.entry(SIGNATURE, last, stored=True),
    ]
    return archive.archive(entries)


def _signature(manifest: bytes, public: bytes, signature: bytes) -> dict[str, str]:
    return {
        "algorithm": ALGORITHM,
        "of": MANIFEST.rpartition("/")[2],
        "sha3_256": sha3(manifest),
        "public_key": public.hex(),
        "signature": signature.hex(),
    }


class Signed(NamedTuple):
    """The outcome of the check of a signature: the public key, and a sentence on what is wrong, or none."""

    public: bytes
    fault: str


def check_signature(manifest: bytes, content: bytes) -> Signed:
    """Check the content of signature.json against that of manifest.json; of one change it names the file."""
    try:
        data = json.loads(content)
        public, signature = bytes.fromhex(data["public_key"]), bytes.fromhex(data["signature"])
        stated = data["sha3_256"]
        own = json_bytes(_signature(manifest, public, signature))
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return Signed(b"", f"{SIGNATURE}: is changed, it is no signature any more")
    if is_signed(public, signature, manifest):
        fault = "" if content == own else f"{SIGNATURE}: is changed beside the signature itself"
    elif stated != sha3(manifest):
        fault = f"{MANIFEST}: is changed, so that the signature does not hold"
    else:
        fault = (
            f"{SIGNATURE}: does not hold: it is changed, or was not made by the key {fingerprint(public)} "
            "that it names"
        )
    return Signed(public, fault)
