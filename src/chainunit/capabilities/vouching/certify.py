"""Certification: what an FMU computed is written into it and signed; of an SSP package into each own FMU."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree.ElementTree import Element

from ... import __version__, machines
from ...core.errors import InputError, RunError, printable
from ...core.inputs import ARCHIVE, file_bytes
from ...core.model import Model
from ...fmu.description import Interface, Signal
from ...fmu.pack import interface_of, xml_bytes
from ...fmu.reference import REFERENCE, RELATED, related_files
from ...fmu.script import Names, name_in_fmu
from ...mechanism.models import MACHINES
from . import experiments as ex
from .archive import archives_in, contents, signed
from .integrity import EVIDENCE
from .runs import TYPES, UnpackedFmu, make_runnable, unpacked

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

DESCRIPTION = "modelDescription.xml"
LEFT_OUT = "left out: points, as the model is not one of this package by its name; name its file by --of"
_TOOL = f"chainunit {__version__}"


class Certified(NamedTuple):
    """A certified file: its content, and sentences on what it carries."""

    data: bytes
    sentences: list[str]


def members_of(file: Path) -> dict[str, bytes]:
    """The members of a file without those of an earlier certification.

    Raises
    ------
    InputError
        if the file is no sound archive.
    """
    return _without_evidence(contents(file_bytes(file, ARCHIVE), str(file)))


def _without_evidence(members: Mapping[str, bytes]) -> dict[str, bytes]:
    kept = {name: data for name, data in members.items() if name != EVIDENCE}
    return _related(kept) if len(kept) < len(members) else kept


def _related(members: dict[str, bytes]) -> dict[str, bytes]:
    """The members with or without the evidence, as they have it, in the manifest of FMI-LS-REF."""
    root = related_files(members.get(RELATED))
    source = EVIDENCE.removeprefix(f"{REFERENCE}/")
    for node in root.findall(f"Related[@source='{source}']"):
        root.remove(node)
    if EVIDENCE in members:
        text = "Experiments of this FMU and its deviations from their results; signed in the comment of the archive"
        node = Element("Related", type="application/json", source=source, role="report", description=text)
        # what follows the related files, by the schema, is annotations
        root.insert(len(root.findall("Related")), node)
    others = {name: data for name, data in members.items() if name != RELATED}
    return others | ({RELATED: xml_bytes(root)} if len(root) else {})


def kind_of(members: Mapping[str, bytes], name: str) -> str:
    """The kind of a file with these members, "fmu" or "ssp"; `name` is its file, for errors.

    Raises
    ------
    InputError
        for another file.
    """
    for member, kind in ((DESCRIPTION, "fmu"), ("SystemStructure.ssd", "ssp")):
        if member in members:
            return kind
    raise InputError(f"{name}: is neither an FMU ({DESCRIPTION}) nor an SSP package (SystemStructure.ssd)")


def is_of_this_version(members: Mapping[str, bytes]) -> bool:
    """Whether these are the members of an FMU that this version of the package made."""
    return _TOOL.encode() in members.get(DESCRIPTION, b"")


def certified(
    members: Mapping[str, bytes], name: str, key: Ed25519PrivateKey, model: type[Model] | None
) -> Certified:
    """The certified file with these members, an FMU or an SSP package.

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
    if kind_of(members, name) == "fmu":
        evidence, sentences = _evidence(members, name, model)
        data = json.dumps(evidence, indent=1, sort_keys=True, allow_nan=False).encode() + b"\n"
        return Certified(signed(_related({**members, EVIDENCE: data}), key), sentences)
    sentences, inside = [], {}
    for member in archives_in(members):
        place = f"{name}: {printable(member)}"
        content = contents(members[member], place)
        if is_of_this_version(content):
            fmu = certified(_without_evidence(content), place, key, None)
            inside[member] = fmu.data
            sentences += [f"{printable(member)}: {sentence}" for sentence in fmu.sentences]
        else:
            sentences.append(f"{printable(member)}: is not of this version of chainunit, and not judged")
    return Certified(signed({**members, **inside}, key), sentences)


def _evidence(
    members: Mapping[str, bytes], name: str, model: type[Model] | None
) -> tuple[dict[str, Any], list[str]]:
    """The content of evidence.json of an FMU, and the same in sentences."""
    with unpacked(members, name) as fmu:
        if (tool := str(fmu.description.generationTool or "")) != _TOOL:
            remedy = (
                "export it anew first" if tool.startswith("chainunit ") else "must be an FMU of chainunit"
            )
            maker = printable(tool) or "an unknown tool"
            raise InputError(f"{name}: was made by {maker}, this is {_TOOL}; {remedy}")
        interface = interface_in(fmu, model)
        if interface is None and (model or packaged_model(fmu.name)):
            remedy = "name another file by --of" if model else "export it anew"
            model_name = model.name if model else fmu.name
            raise InputError(f"{name}: is no FMU of {model_name}, or its start values make none; {remedy}")
        # an importer reads the results of the equations in the file: the FMU must give these
        experiments = ex.Experiments(ex.tables_in(fmu), ex.chosen_points(interface) if interface else ())
        make_runnable(fmu)
        deviations = ex.measured(fmu, experiments)
    tolerance = ex.tolerance(interface)
    sentences = [f"{topic}: {gap.sentence()}, allowed are {tolerance:g}" for topic, gap in deviations.items()]
    for sentence, gap in zip(sentences, deviations.values(), strict=True):
        if not gap.value <= tolerance:
            raise RunError(f"{name}: is not certified: {sentence}")
    if not experiments.reference:
        sentences.append("reference experiment: the FMU has none, as its states are too fast or run away")
    evidence: dict[str, Any] = {"model": fmu.name, "chainunit": __version__, "tolerance": tolerance}
    evidence["deviations"] = {topic: gap.value for topic, gap in deviations.items()}
    if interface is None:
        sentences.append(LEFT_OUT)
        evidence["left_out"] = LEFT_OUT
    return evidence, sentences


def packaged_model(name: str) -> type[Model] | None:
    """The packaged model of that name; None for any other name. For a machine the modules up to its own are imported:
    all together take longer than a check of its file."""
    for module in iter_modules(machines.__path__):
        import_module(f"{machines.__name__}.{module.name}")
        if name in MACHINES:
            return MACHINES[name]
    from ...models import MODELS

    return MODELS.get(name)


def interface_in(fmu: UnpackedFmu, model: type[Model] | None = None) -> Interface | None:
    """The interface of the model with the start values of the FMU, whose variables get the names of the model; None
    for a model that this package does not know, and if the variables are not those of the model."""
    names: Names = "flat" if fmu.description.variableNamingConvention == "flat" else "structured"
    if fmu.name == "ChainUnitFlexible" and model is None:
        from ...machines.flexible import with_rods

        rods = sum(name.startswith(name_in_fmu("left.theta_", names)) for name in fmu.variables)
        model = with_rods(rods, fmu.start("parameter"))
    if (model := model or packaged_model(fmu.name)) is None:
        return None
    if names == "flat":
        fmu.rename({s.name: name_in_fmu(s.name, names) for s in Interface(model, {}).signals})
    try:
        interface = interface_of(model, fmu.start("parameter") | fmu.start("input"))
    except (KeyError, InputError):
        return None
    return interface if all(_is_in(fmu, signal) for signal in interface.signals) else None


def _is_in(fmu: UnpackedFmu, signal: Signal) -> bool:
    """Whether an FMU has a variable with its unit and its nominal size, over which deviations are told."""
    there, variable = fmu.variables.get(signal.name), signal.variable
    if there is None or TYPES[there.type] != variable.type:
        return False
    numbers = (str(there.unit or ""), there.nominal)
    return variable.type != "Real" or numbers == (variable.unit, variable.quantity.nominal or 1.0)
