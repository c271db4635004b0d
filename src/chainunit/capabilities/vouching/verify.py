"""Verification: the bytes of a certified file, its evidence by the equations of the package here, and its experiments
again on this machine. The package here sets the limits; a file can only state stricter ones."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...core.errors import InputError, RunError, printable, shown
from ...core.inputs import ARCHIVE, file_bytes, json_of, refuse_large_archive
from ...core.model import Model
from ...fmu.description import Interface
from ...models import MODELS
from . import certify
from . import experiments as ex
from .archive import LOCAL, archives_in, contents
from .integrity import EVIDENCE, Finding, Inspection, check_bytes
from .runs import NoLibraryError, UnpackedFmu, make_runnable, unpacked

NOT_RUN = "experiments"
"""Topic of the line on experiments that are not run."""
_UNRUN = "experiments were not run"


def verify(file: Path, key: bytes | None, model: Model | None = None, *, run: bool = True) -> list[Finding]:
    """Check a certified file line by line.

    Parameters
    ----------
    key : public key of whom the receiver expects the signature; without one no code of the file runs
    model : of the FMU, if the caller has it; else it is found by its name
    run : whether the experiments run again; this loads the library of the FMU

    Raises
    ------
    InputError
        for a file that is not there, that is too large, or no archive at all.
    """
    data = file_bytes(file, ARCHIVE)
    refuse_large_archive(data, str(file))
    if not data.startswith(LOCAL):
        raise InputError(f"{file}: is no FMU and no SSP package: it is not a zip archive")
    check = check_bytes(data, str(file), key)
    unrun = "" if run and key else "as the signer is not named by --key" if run else "as --no-run asks"
    _judge(check, file.name, model, unrun)
    return check.findings


def _judge(check: Inspection, name: str, model: Model | None, unrun: str) -> None:
    """Add the lines after those on the bytes, if these hold; `unrun` tells why no code of the file runs, empty if it
    may."""
    if not check.holds:
        check.add(None, NOT_RUN, "are not run: a file that is not as signed is not loaded")
        return
    try:
        if certify.is_system(check.members):
            _judge_system(check, name, unrun)
            return
        if EVIDENCE not in check.members:
            raise InputError(f"{EVIDENCE}: is missing")
        stated = json_of(check.members[EVIDENCE], EVIDENCE)
        version = printable(str(stated["chainunit"]), 40)
        sentence = f"certified by chainunit {version}, here is {__version__}: must be the same"
        check.add(version == __version__, "version", sentence)
        # numbers from outside, and those of other code
        with np.errstate(all="ignore"), unpacked(check.members, name) as fmu:
            _judge_fmu(check, fmu, stated, model, unrun)
    except InputError as error:
        check.add(False, "evidence", str(error))
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError):
        check.add(False, "evidence", f"{EVIDENCE}: is not of the form that this version writes")


def _judge_system(check: Inspection, name: str, unrun: str) -> None:
    """The FMUs of an SSP package that are certified themselves; the key must be that of the package."""
    if not (archives := archives_in(check.members)):
        check.add(None, "FMUs", "the package has none", "nothing in it was judged")
    for member in archives:
        data, place = check.members[member], printable(member)
        if not certify.is_of_this_version(contents(data, place)):
            check.add(None, place, "is no FMU of this version of chainunit", f"{place} was not judged")
            continue
        inner = check_bytes(data, place, check.public, "the key of the package")
        _judge(inner, f"{name}: {member}", None, unrun)
        for finding in inner.findings:
            check.findings.append(finding._replace(topic=f"{place}, {finding.topic}"))


def _judge_fmu(
    check: Inspection, fmu: UnpackedFmu, stated: Mapping[str, Any], model: Model | None, unrun: str
) -> None:
    """Add the lines on the equations, on the evidence that the file has `stated`, and on its experiments. Code of the
    FMU runs only if all else holds and `unrun`, the reason why it does not run, is empty."""
    # the names of the model come with it, and the tables have them
    interface = certify.interface_in(fmu, model)
    tables = ex.tables_in(fmu)
    experiments, limit = ex.Experiments(tables), ex.tolerance(interface)
    if interface is None:
        remedy = "name its file by --of"
        sentence = f"the model is not one of the package here by its name; {remedy}"
        check.add(None, "equations", sentence, f"was not compared with its equations: {remedy}")
    else:
        try:
            experiments = ex.by_equations(interface)
        except ModuleNotFoundError as error:
            sentence = f"its experiments were not computed again without the package {error.name}"
            check.add(None, "equations", sentence, sentence)
        else:
            gap = ex.table_gap(tables, experiments.reference, fmu)
            check.add(gap.value <= limit, "equations", f"the equations in Python here: {gap.sentence(limit)}")
    for fault in _faults(stated, fmu.name, tables is not None, interface):
        check.add(False, "evidence", f"{EVIDENCE}: {fault}")
    if not check.holds:
        check.add(None, NOT_RUN, "are not run: an FMU that does not fit its evidence is not loaded")
    elif unrun:
        check.add(None, NOT_RUN, f"are not run, {unrun}", _UNRUN)
    else:
        _run(check, fmu, experiments, min(limit, stated["tolerance"]))


def _faults(
    stated: Mapping[str, Any], name: str, has_reference: bool, interface: Interface | None
) -> list[str]:
    """What is wrong with the evidence: it must state the deviation in each experiment, as a number within the limit
    here. A model that is no packaged one may have been unknown where the FMU was certified, without points."""
    faults, is_packaged = [], name in MODELS
    if stated["model"] != name:
        faults.append(f"model = {shown(stated['model'])}: must be that of the FMU, {shown(name)}")
    topics = {"reference experiment"} if has_reference else set()
    least, most = topics | ({"points"} if is_packaged else set()), topics | {"points"}
    if not least <= set(deviations := stated["deviations"]) <= most:
        faults.append(f"deviations: must be those of {' and '.join(sorted(most))}")
    limit = ex.tolerance(interface if is_packaged else None)
    for key, value in {"tolerance": stated["tolerance"], **deviations}.items():
        if type(value) not in (int, float) or not 0.0 <= value <= limit:
            faults.append(f"{key} = {shown(value)}: must be a number from 0 to {limit:g}")
    return faults


def _run(check: Inspection, fmu: UnpackedFmu, experiments: ex.Experiments, limit: float) -> None:
    """Run the experiments, and add a finding for each: it holds up to the `limit` of the deviation."""
    try:
        if sentence := make_runnable(fmu):
            check.add(None, "library", sentence, "its own library was not run")
        deviations = ex.measured(fmu, experiments)
    except NoLibraryError as error:
        check.add(None, NOT_RUN, f"are not run: {error}", _UNRUN)
    except RunError as error:
        check.add(False, NOT_RUN, str(error))
    else:
        if not experiments.reference:
            check.add(None, "reference experiment", "the FMU has none")
        for topic, gap in deviations.items():
            check.add(gap.value <= limit, topic, f"the FMU here: {gap.sentence(limit)}")
