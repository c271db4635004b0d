"""Certify an FMU or SSP package, verify a certified one, make a key."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ...core.errors import printable
from ...report.console import study_file, terminal_console
from ...report.result_kind import ResultKind

_KEY = Path("chainunit.key")
_Of = Annotated[
    Path | None,
    typer.Option(
        "--of", help="Study file or linkage file (TOML) of the FMU, if its model is no packaged one."
    ),
]


def key(
    output: Annotated[Path, typer.Option("-o", "--output", help="File of the private key.")] = _KEY,
) -> None:
    """Make a key for signatures: the private one, which stays with you, and the public one to hand on."""
    from .keys import make_key

    public, print_of = make_key(output)
    print(f"{output}: private key, keep it; {public}: public key, hand it on; fingerprint {print_of}")


def certify(
    file: Annotated[Path, typer.Argument(help="FMU or SSP package of this package.")],
    key_file: Annotated[
        Path, typer.Option("--key", help="File of the private key, by chainunit vouch key.")
    ] = _KEY,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Certified file; by default FILE itself.")
    ] = None,
    of: _Of = None,
) -> None:
    """Run the experiments of an FMU or SSP package, write what they gave into it, and sign it."""
    from ...core.files import write_file
    from .certify import certified, members_of
    from .keys import private_key

    secret, members, target = private_key(key_file), members_of(file), output or file
    with terminal_console(stderr=True).status("certifying") as status:
        data, sentences = certified(members, target.name, secret, _model(of, status.update))
        write_file(target, data)
    print("\n  ".join([f"{target}: certified", *sentences]))


def verify(
    file: Annotated[Path, typer.Argument(help="Certified FMU or SSP package.")],
    key_file: Annotated[
        Path | None, typer.Option("--key", help="Public key of whom you expect the signature.")
    ] = None,
    no_run: Annotated[
        bool,
        typer.Option("--no-run", help="Inspection bytes and equations alone; no code of the FMU is run."),
    ] = False,
    of: _Of = None,
) -> None:
    """Check a certified FMU or SSP package: signature, every member, and its experiments again on this machine.

    Code of the file runs only if --key names its signer. The exit status is 0 if all holds, 1 if a line does not,
    2 for bad input, 3 if no line fails but something is not judged: the signer is not named, experiments are not run,
    not by the FMU's own library, or not compared with the equations.
    """
    from .integrity import conclusion
    from .keys import public_key
    from .verify import verify as check

    expected = public_key(key_file) if key_file else None
    with terminal_console(stderr=True).status("verifying") as status:
        findings = check(file, expected, _model(of, status.update), run=not no_run)
    wide = max(len(finding.topic) for finding in findings)
    for finding in findings:
        sign = {True: "holds", False: "FAILS", None: "note"}[finding.holds]
        print(f"{sign:5}  {finding.topic:{wide}}  {printable(finding.sentence, 2000)}")
    code, sentence = conclusion(findings)
    print(f"{file}: {printable(sentence, 2000)}")
    if code:
        raise typer.Exit(code)


def _model(file: Path | None, progress: Any) -> Any:
    """The model of a study file or linkage file."""
    if file is None:
        return None
    from ...models import linkage_named
    from ...study.package import model_and_start

    linkage = linkage_named(str(file))
    if linkage is not None:
        return linkage
    loaded = study_file(file) if file.suffix.lower() == ".toml" else None
    return model_and_start(str(file), loaded, progress=progress)[0]


GROUP = "vouch"
"""The command below which these stand."""
COMMANDS = (key, certify, verify)
KINDS: dict[str, ResultKind] = {}
