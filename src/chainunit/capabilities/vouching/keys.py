"""Keys of signatures: Ed25519 (RFC 8032), in PEM files."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.errors import InputError
from ...core.files import writing
from ...core.inputs import MIB, file_bytes

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey


def _library() -> tuple[Any, Any]:
    """The modules of Ed25519 and of the forms of keys."""
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
        if one of the two files is there already: a key is never written over.
    WriteError
        if a file cannot be written; then neither is there.
    """
    ed25519, forms = _library()
    public_file = file.with_name(f"{file.name}.pub")
    for path in (file, public_file):
        if path.exists() or path.is_symlink():
            raise InputError(f"{path}: is there already; a key is never written over: name another with -o")
    key = ed25519.Ed25519PrivateKey.generate()
    secret = key.private_bytes(forms.Encoding.PEM, forms.PrivateFormat.PKCS8, forms.NoEncryption())
    public = key.public_key()
    text = public.public_bytes(forms.Encoding.PEM, forms.PublicFormat.SubjectPublicKeyInfo)
    written: list[Path] = []
    try:
        for path, content, mode in ((file, secret, 0o600), (public_file, text, 0o644)):
            with writing(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
                written.append(path)
                with os.fdopen(handle, "wb") as stream:
                    stream.write(content)
    except BaseException:
        for path in written:
            path.unlink(missing_ok=True)
        raise
    return public_file, fingerprint(public.public_bytes_raw())


def private_key(file: Path) -> Ed25519PrivateKey:
    """The private key of a file.

    Raises
    ------
    InputError
        if the file has none.
    """
    ed25519, forms = _library()
    load = partial(forms.load_pem_private_key, password=None)
    return _loaded(file, load, "private key in PEM without password", ed25519.Ed25519PrivateKey)


def public_key(file: Path) -> bytes:
    """The public key of a file, 32 B.

    Raises
    ------
    InputError
        if the file has none.
    """
    ed25519, forms = _library()
    key = _loaded(file, forms.load_pem_public_key, "public key in PEM", ed25519.Ed25519PublicKey)
    return bytes(key.public_bytes_raw())


def _loaded(file: Path, load: Callable[[bytes], Any], kind: str, key_class: type) -> Any:
    """The key in a file, read by `load`; `kind` is its noun."""
    try:
        key = load(file_bytes(file, MIB))
    except InputError as error:
        raise InputError(f"{error}; chainunit vouch key makes a file with a key") from error
    except Exception as error:  # the library has several, by the kind of fault
        hint = "makes it, and the public one beside it with .pub"
        raise InputError(f"{file}: has no {kind}; chainunit vouch key {hint}") from error
    if not isinstance(key, key_class):
        raise InputError(
            f"{file}: is a key of another kind; must be Ed25519, as chainunit vouch key makes it"
        )
    return key


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
