"""Certification: what an FMU computed is written into it and signed; of an SSP package into each own FMU."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element

from ... import __version__
from ...core.errors import InputError, RunError, printable
from ...core.inputs import ARCHIVE, file_bytes
from ...core.model import Model
from ...fmu.description import Interface, Signal, xml_bytes
from ...fmu.pack import interface_of
from ...fmu.reference import REFERENCE, RELATED, related_files
from ...fmu.script import Names, name_in_fmu
from ...models import MODELS
from . import experiments as ex
from .archive import archives_in, contents, signed
from .integrity import EVIDENCE
from .runs import TYPES, UnpackedFmu, make_runnable, unpacked

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

_DESCRIPTION = "modelDescription.xml"
_TOOL = f"chainunit {__version__}"


def members_of(file: Path) -> dict[str, bytes]:
    """The members of a file.

    Raises
    ------
    InputError
        if the file is no sound archive.
    """
    return contents(file_bytes(file, ARCHIVE), str(file))


def is_system(members: Mapping[str, bytes]) -> bool:
    """Whether these are the members of an SSP package."""
    return "SystemStructure.ssd" in members and _DESCRIPTION not in members


def is_of_this_version(members: Mapping[str, bytes]) -> bool:
    """Whether these are the members of an FMU that this version of the package made."""
    return _TOOL.encode() in members.get(_DESCRIPTION, b"")


def certified(
    members: Mapping[str, bytes], name: str, key: Ed25519PrivateKey, model: Model | None
) -> tuple[bytes, list[str]]:
    """The certified file with these members, an FMU or an SSP package, and sentences on what it carries.

    Parameters
    ----------
    name : of the file, for errors
    model : of an FMU, if the caller has it; else it is found by its name

    Raises
    ------
    InputError
        for a file that is neither, or not of this version of the package.
    RunError
        if the FMU does not run on this machine, or does not give its results.
    """
    if not is_system(members):
        evidence, sentences = _evidence(members, name, model)
        data = json.dumps(evidence, indent=1, sort_keys=True, allow_nan=False).encode() + b"\n"
        return signed({**members, EVIDENCE: data, RELATED: _related(members)}, key), sentences
    sentences, certified_members = [], {}
    for member in archives_in(members):
        place = printable(member)
        content = contents(members[member], f"{name}: {place}")
        if not is_of_this_version(content):
            sentences.append(f"{place}: is not of this version of chainunit, and not judged")
            continue
        certified_members[member], lines = certified(content, f"{name}: {place}", key, None)
        sentences += [f"{place}: {line}" for line in lines]
    return signed({**members, **certified_members}, key), sentences


def _related(members: Mapping[str, bytes]) -> bytes:
    """The manifest of FMI-LS-REF with the evidence in it."""
    root, source = related_files(members.get(RELATED)), EVIDENCE.removeprefix(f"{REFERENCE}/")
    if root.find(f"Related[@source='{source}']") is None:
        text = "Deviations of this FMU in its experiments; it is signed in the comment of the archive"
        node = Element("Related", type="application/json", source=source, role="report", description=text)
        # what follows the related files, by the schema, is annotations
        root.insert(len(root.findall("Related")), node)
    return xml_bytes(root)


def _evidence(
    members: Mapping[str, bytes], name: str, model: Model | None
) -> tuple[dict[str, Any], list[str]]:
    """The content of evidence.json of an FMU, and the same in sentences."""
    with unpacked(members, name) as fmu:
        if (tool := str(fmu.description.generationTool or "an unknown tool")) != _TOOL:
            raise InputError(f"{name}: was made by {printable(tool)}; must be by {_TOOL}: export it anew")
        interface = interface_in(fmu, model)
        # an importer reads the results of the equations in the file: the FMU must give these
        experiments = ex.Experiments(ex.tables_in(fmu), ex.chosen_points(interface) if interface else ())
        make_runnable(fmu)
        deviations = ex.measured(fmu, experiments)
    limit, sentences = ex.tolerance(interface), []
    for topic, gap in deviations.items():
        sentences.append(f"{topic}: {gap.sentence(limit)}")
        if not gap.value <= limit:
            raise RunError(f"{name}: is not certified: {sentences[-1]}")
    if not experiments.reference:
        sentences.append("reference experiment: the FMU has none, as its states are too fast or run away")
    if interface is None:
        sentences.append("left out: points, as the model is no packaged one; name its file by --of")
    numbers = {topic: gap.value for topic, gap in deviations.items()}
    evidence = {"model": fmu.name, "chainunit": __version__, "tolerance": limit, "deviations": numbers}
    return evidence, sentences


def interface_in(fmu: UnpackedFmu, model: Model | None = None) -> Interface | None:
    """The interface of the model with the start values of the FMU, whose variables get the names of the model; None
    for a model that this package does not know.

    Raises
    ------
    InputError
        if variables or start values differ from the model.
    """
    names: Names = "flat" if fmu.description.variableNamingConvention == "flat" else "structured"
    if fmu.name == "ChainUnitFlexible" and model is None:
        from ...machines.flexible import with_rods

        rods = sum(name.startswith(name_in_fmu("left.theta_", names)) for name in fmu.variables)
        model = with_rods(rods, fmu.start("parameter"))
    if (model := model or MODELS.get(fmu.name)) is None:
        return None
    if names == "flat":
        fmu.rename({s.name: name_in_fmu(s.name, names) for s in Interface(model, {}).signals})
    try:
        interface = interface_of(model, fmu.start("parameter") | fmu.start("input"))
        if all(_is_in(fmu, signal) for signal in interface.signals):
            return interface
    except (KeyError, InputError):
        pass
    raise InputError(
        f"the FMU is none of {model.name}, or its start values make none; name another file by --of"
    )


def _is_in(fmu: UnpackedFmu, signal: Signal) -> bool:
    """Whether an FMU has a variable with its unit and its nominal size, over which deviations are told."""
    in_fmu, variable = fmu.variables.get(signal.name), signal.variable
    if in_fmu is None or TYPES[in_fmu.type] != variable.type:
        return False
    numbers = (str(in_fmu.unit or ""), in_fmu.nominal)
    return variable.type != "Real" or numbers == (variable.unit, variable.quantity.nominal or 1.0)
