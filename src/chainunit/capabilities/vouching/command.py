"""Certify an FMU or SSP package, verify a certified one, make a key."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ...core.errors import InputError, printable
from ...report.console import show_remark, study_file, terminal_console
from ...report.result_kind import ResultKind

_KEY = Path("chainunit.key")
_MODEL = "Study file or linkage file (TOML) of the FMU, where its model is no packaged one."


def key(
    output: Annotated[Path, typer.Option("-o", "--output", help="File of the private key.")] = _KEY,
) -> None:
    """Make a key for signatures: the private one, which stays with you, and the public one to hand on."""
    from .keys import make_key

    public, print_of = make_key(output)
    print(f"{output}: private key, keep it; {public}: public key, hand it on; fingerprint {print_of}")


def certify(
    file: Annotated[
        Path,
        typer.Argument(
            help="FMU or SSP package of this package; or a study file or linkage file (TOML), whose FMU is written."
        ),
    ],
    key_file: Annotated[
        Path, typer.Option("--key", help="File of the private key, by chainunit vouch key.")
    ] = _KEY,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="Certified file; by default FILE itself, of a TOML file NAME.fmu."
        ),
    ] = None,
    of: Annotated[Path | None, typer.Option("--of", help=_MODEL)] = None,
) -> None:
    """Write into an FMU or SSP package what is known about it, and sign it.

    Writes beside it its meta-data (.srmd).
    """
    from ...core.files import scratch
    from .certify import certified, members_of, place_beside, place_of, write
    from .keys import private_key, readable_by_others

    if file.is_dir():
        raise InputError(
            f"{file}: is a folder; must be an FMU, an SSP package, a study file or a linkage file"
        )
    secret = private_key(key_file)
    if readable_by_others(key_file):
        show_remark(f"{key_file}: other users of this machine can read this key; chmod 600 {key_file}")
    with terminal_console(stderr=True).status("certifying") as status, scratch() as folder:
        if file.suffix.lower() == ".toml":
            if of is not None:
                raise InputError(f"--of {of}: is for FMUs; leave it out for {file}")
            model, source = _exported(file, folder, status.update)
        else:
            model, source = (_model_and_start(of, status.update)[0] if of else None), file
        members = members_of(source)
        target = place_of(
            output or (Path(source.name) if source != file else file), members, output is not None
        )
        place_beside(target)
        made = certified(members, target.name, secret, model, status.update)
        beside = write(made, target)
    print(f"{target}: certified; {beside}: its meta-data with checksum")
    for line in made.words:
        print(f"  {line}")


def verify(
    file: Annotated[Path, typer.Argument(help="Certified FMU or SSP package.")],
    key_file: Annotated[
        Path | None, typer.Option("--key", help="Public key of whom you expect the signature.")
    ] = None,
    no_run: Annotated[
        bool,
        typer.Option("--no-run", help="Check bytes and equations alone; no code of the FMU is run."),
    ] = False,
    of: Annotated[Path | None, typer.Option("--of", help=_MODEL)] = None,
) -> None:
    """Check a certified FMU or SSP package: signature, every member, and its experiments again on this machine.

    Code of the file runs only if --key names its signer. The exit status is 0 if all holds, 1 if a line does not,
    2 for bad input, 3 if no line fails but something is not judged: the signer is not named, experiments are not run,
    not by the FMU's own library, or not compared with the equations.
    """
    from .keys import public_key
    from .verify import conclusion
    from .verify import verify as check

    expected = public_key(key_file) if key_file else None
    with terminal_console(stderr=True).status("verifying") as status:
        model = _model_and_start(of, status.update)[0] if of else None
        found = check(file, expected, model, run=not no_run, told=status.update)
    wide = max(len(each.topic) for each in found)
    for each in found:
        sign = {True: "holds", False: "FAILS", None: "note"}[each.holds]
        print(f"{sign:5}  {each.topic:{wide}}  {printable(each.words, 2000)}")
    code, words = conclusion(found)
    print(f"{file}: {printable(words, 2000)}")
    if code:
        raise typer.Exit(code)


def _model_and_start(file: Path, progress: Any) -> Any:
    """The model of a study file or linkage file, with its start values."""
    from ...models import is_study_file
    from ...study.package import model_and_start

    loaded = study_file(file) if is_study_file(str(file)) else None
    return model_and_start(str(file), loaded, progress=progress)


def _exported(file: Path, folder: Path, progress: Any) -> tuple[Any, Path]:
    """The model of a study file or linkage file, and its FMU in the folder."""
    from ...fmu.backends import export

    model, start = _model_and_start(file, progress)
    target = folder / f"{model.name}.fmu"
    export(model, target, start, progress=progress)
    return model, target


GROUP = "vouch"
"""The command below which these stand."""
COMMANDS = (key, certify, verify)
KINDS: dict[str, ResultKind] = {}
