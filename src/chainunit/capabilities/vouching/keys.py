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

_HINT = "chainunit vouch key makes"


def _library() -> tuple[Any, Any]:
    """The modules of Ed25519 and of the forms of keys.

    Raises
    ------
    InputError
        if the package is not installed.
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
    made: list[Path] = []
    try:
        for path, content, mode in ((file, secret, 0o600), (public_file, text, 0o644)):
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
        if the file has none.
    """
    ed25519, forms = _library()
    text = _text(file)
    hint = "; it has a public key: name the file without .pub" if b"PUBLIC KEY" in text else ""
    load = partial(forms.load_pem_private_key, text, None)
    kind = f"private key in PEM without password{hint}"
    return _loaded(file, kind, load, ed25519.Ed25519PrivateKey)


def readable_by_others(file: Path) -> bool:
    """Whether other users of this machine can read a file; never on systems without such modes."""
    return os.name == "posix" and bool(file.stat().st_mode & 0o077)


def public_key(file: Path) -> bytes:
    """The public key of a file, 32 B; of a private key its public one.

    Raises
    ------
    InputError
        if the file has neither.
    """
    ed25519, forms = _library()
    text = _text(file)
    if b"PRIVATE KEY" in text:
        return private_key(file).public_key().public_bytes_raw()
    load = partial(forms.load_pem_public_key, text)
    return bytes(_loaded(file, "public key in PEM", load, ed25519.Ed25519PublicKey).public_bytes_raw())


def _text(file: Path) -> bytes:
    try:
        return file_bytes(file, MIB)
    except InputError as error:
        raise InputError(f"{error}; {_HINT} a file with a key") from error


def _loaded(file: Path, kind: str, load: Callable[[], Any], key_class: type) -> Any:
    try:
        key = load()
    except Exception as error:  # the library has several, by the kind of fault
        raise InputError(f"{file}: has no {kind}; {_HINT} one") from error
    if not isinstance(key, key_class):
        raise InputError(f"{file}: is a key of another kind; must be Ed25519, as {_HINT} it")
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
