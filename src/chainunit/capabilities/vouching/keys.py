"""Keys of signatures: Ed25519 (RFC 8032), in PEM files."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.errors import InputError
from ...core.files import writing
from ...core.inputs import MIB, file_bytes

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

_PUBLIC = ".pub"


def _library() -> tuple[Any, Any]:
    """The modules of Ed25519 and of the forms of keys.

    Raises
    ------
    InputError
        where the package is not installed.
    """
    try:
        from cryptography.hazmat.primitives import serialization
        from cryptography.hazmat.primitives.asymmetric import ed25519
    except ImportError as error:
        raise InputError("signatures need cryptography: pip install 'chainunit[vouch]'") from error
    return ed25519, serialization


def make_key(file: Path) -> tuple[Path, str]:
    """Make a key: the private one in `file`, which the user alone can read, the public one beside it.

    Returns
    -------
    the file of the public key, and its fingerprint.

    Raises
    ------
    InputError
        where one of the two files is there already: a key is never written over.
    WriteError
        where a file cannot be written; then neither is there.
    """
    ed25519, forms = _library()
    public_file = file.with_name(file.name + _PUBLIC)
    for each in (file, public_file):
        if each.exists() or each.is_symlink():
            raise InputError(f"{each}: is there already; a key is never written over: name another with -o")
    key = ed25519.Ed25519PrivateKey.generate()
    text = key.private_bytes(forms.Encoding.PEM, forms.PrivateFormat.PKCS8, forms.NoEncryption())
    public = key.public_key()
    words = public.public_bytes(forms.Encoding.PEM, forms.PublicFormat.SubjectPublicKeyInfo)
    made: list[Path] = []
    try:
        for path, content, mode in ((file, text, 0o600), (public_file, words, 0o644)):
            with writing(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
                made.append(path)
                with os.fdopen(handle, "wb") as stream:
                    stream.write(content)
    except BaseException:
        for path in made:
            path.unlink(missing_ok=True)
        raise
    return public_file, fingerprint(public.public_bytes_raw())


def private_key(file: Path) -> Ed25519PrivateKey:
    """The private key of a file.

    Raises
    ------
    InputError
        where the file has none.
    """
    ed25519, forms = _library()
    text = _text(file)
    try:
        key = forms.load_pem_private_key(text, password=None)
    except (ValueError, TypeError) as error:
        hint = "; it has a public key: name the file without .pub" if b"PUBLIC KEY" in text else ""
        raise InputError(
            f"{file}: has no private key in PEM without password{hint}; chainunit vouch key makes one"
        ) from error
    except Exception as error:  # of kinds of keys that the library does not know
        raise InputError(
            f"{file}: has no private key of a known kind; chainunit vouch key makes one"
        ) from error
    if not isinstance(key, ed25519.Ed25519PrivateKey):
        raise InputError(
            f"{file}: is a key of another kind; must be Ed25519, as chainunit vouch key makes it"
        )
    return key


def readable_by_others(file: Path) -> bool:
    """Whether other users of this machine can read a file; never on systems without such modes."""
    return os.name == "posix" and bool(file.stat().st_mode & 0o077)


def public_key(file: Path) -> bytes:
    """The public key of a file, 32 B; of a private key its public one.

    Raises
    ------
    InputError
        where the file has neither.
    """
    ed25519, forms = _library()
    text = _text(file)
    if b"PRIVATE KEY" in text:
        return private_key(file).public_key().public_bytes_raw()
    try:
        key = forms.load_pem_public_key(text)
    except Exception as error:  # the library has several, by the kind of fault
        raise InputError(
            f"{file}: has no public key in PEM; chainunit vouch key writes one beside the key"
        ) from error
    if not isinstance(key, ed25519.Ed25519PublicKey):
        raise InputError(
            f"{file}: is a key of another kind; must be Ed25519, as chainunit vouch key makes it"
        )
    return bytes(key.public_bytes_raw())


def _text(file: Path) -> bytes:
    try:
        return file_bytes(file, MIB)
    except InputError as error:
        raise InputError(f"{error}; chainunit vouch key makes a file with a key") from error


def fingerprint(public: bytes) -> str:
    """The first 128 bits of the SHA3-256 of a public key, in groups of four digits."""
    digits = hashlib.sha3_256(public).hexdigest()[:32]
    return "-".join(digits[k : k + 4] for k in range(0, 32, 4))


def is_signed(public: bytes, signature: bytes, message: bytes) -> bool:
    """Whether the signature of a message is that of a key."""
    from cryptography.exceptions import InvalidSignature

    ed25519, _ = _library()
    try:
        ed25519.Ed25519PublicKey.from_public_bytes(public).verify(signature, message)
    except (InvalidSignature, ValueError):
        return False
    return True
