"""The asset administration shell (AAS, metamodel 3.0) of a sized drive: as JSON and as AASX, and read back."""

from __future__ import annotations

import io
import json
import math
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...core.errors import InputError, printable
from ...core.inputs import JSON, check_archive, file_bytes, json_of, regular
from .template import ROOT, TEMPLATE_ID, TemplateElement, elements, numbered

EXACT = "ExactValue"
"""Name of the extension with the number itself, beside a whole number of the template."""
WITHIN = 0.005
"""Relative difference up to which a whole number stands for the number itself."""
LONGEST = 1023
"""Most letters of a text in a language, by the metamodel."""
_FOLDER = "/aasx/files/"
_WHOLE = ("xs:long", "xs:integer", "xs:unsignedLong")

Content = Mapping[str, Any]
"""What a submodel says, by the names of the template: below a collection or an entity a further content, or a list of
them where there may be several; else a number in the unit of the template, a text, a `LinkedFile`, a `TextRange`, or
None for an element that is there without a value, as nobody knows it."""


@dataclass(frozen=True)
class LinkedFile:
    """A file beside the shell, by its name."""

    name: str
    media_type: str


@dataclass(frozen=True)
class TextRange:
    """A range; None for an end that is not known."""

    low: str | None
    high: str | None


def needs_basyx(what: str) -> Any:
    """The modules of basyx-python-sdk that read and write shells: its AASX and its JSON adapter.

    Raises
    ------
    InputError
        where it is not installed; `what` needs it.
    """
    try:
        from basyx.aas.adapter import aasx
        from basyx.aas.adapter import json as json_adapter
    except ImportError:
        raise InputError(f"{what} needs basyx-python-sdk: pip install 'chainunit[aas]'") from None
    return aasx, json_adapter


def environment(content: Content, identity: str, name: str, folder: str = "") -> dict[str, Any]:
    """The shell with its submodel, as JSON has it.

    Parameters
    ----------
    content : what the submodel says
    identity : text that is the same for the same study; the identifiers follow from it
    name : title of the drive
    folder : what stands before the name of each file
    """
    ids = {each: uuid.uuid5(uuid.NAMESPACE_OID, f"{each} {identity}").urn for each in ("aas", "asset", "sm")}
    submodel = {
        "modelType": "Submodel",
        "idShort": ROOT,
        "id": ids["sm"],
        "kind": "Instance",
        "administration": {"version": "1", "revision": "0", "templateId": TEMPLATE_ID},
        "semanticId": _reference(elements()[ROOT]),
        "submodelElements": _below(content, ROOT, folder),
    }
    shell = {
        "modelType": "AssetAdministrationShell",
        "idShort": "SizedDrive",
        "id": ids["aas"],
        **({"description": _english(name)} if name else {}),
        "assetInformation": {"assetKind": "Instance", "globalAssetId": ids["asset"]},
        "submodels": [
            {"type": "ModelReference", "keys": [{"type": "Submodel", "value": ids["sm"]}]},
        ],
    }
    return {"assetAdministrationShells": [shell], "submodels": [submodel]}


def _below(content: Content, path: str, folder: str) -> list[dict[str, Any]]:
    made = []
    for name, value in content.items():
        template = elements()[f"{path}/{name}"]
        several = value if isinstance(value, list) else [value]
        assert template.repeats or len(several) == 1, template.path
        made += [_element(template, numbered(name, i), each, folder) for i, each in enumerate(several)]
    return made


def _element(template: TemplateElement, name: str, value: Any, folder: str) -> dict[str, Any]:
    head = {"modelType": template.type, "idShort": name, "semanticId": _reference(template)}
    if template.type in ("SubmodelElementCollection", "Entity"):
        key = "value" if template.type == "SubmodelElementCollection" else "statements"
        below = _below(value or {}, template.path, folder)
        own = {key: below} if below else {}
        return head | own | ({"entityType": "CoManagedEntity"} if template.type == "Entity" else {})
    if template.type == "Property":
        return head | {"valueType": template.value_type} | _value(template, value)
    if value is None or value == "":
        return head
    if template.type == "MultiLanguageProperty":
        return head | {"value": _english(value)}
    if isinstance(value, TextRange):
        ends = {"min": value.low, "max": value.high}
        return head | {"valueType": template.value_type} | {k: x for k, x in ends.items() if x is not None}
    assert isinstance(value, LinkedFile), template.path
    return head | {"contentType": value.media_type, "value": f"{folder}{value.name}"}


def _english(text: str) -> list[dict[str, str]]:
    """A text in English, cut at a word where it is longer than the metamodel permits."""
    if len(text) > LONGEST:
        text = f"{text[: LONGEST - 3].rsplit(' ', 1)[0]}..."
    return [{"language": "en", "text": text}]


def _value(template: TemplateElement, value: Any) -> dict[str, Any]:
    """The value of a property. Where the template has a whole number, the number itself stands in an extension, and
    the whole number only where it is near enough."""
    if value is None or value == "":
        return {}
    if template.value_type not in _WHOLE:
        return {"value": str(value)}
    whole = round(value)
    own = {"value": str(whole)} if math.isclose(whole, value, rel_tol=WITHIN) else {}
    if whole == value:
        return own
    unit = f" [{template.unit}]" if template.unit else ""
    return own | {
        "extensions": [{"name": f"{EXACT}{unit}", "valueType": "xs:double", "value": f"{value:.9g}"}]
    }


def _reference(template: TemplateElement) -> dict[str, Any]:
    return {"type": template.reference, "keys": [{"type": template.key, "value": template.semantic_id}]}


def aasx_modules() -> Any:
    """The modules that write an AASX, see `needs_basyx`."""
    return needs_basyx("sizing.aasx: leave it out by --no-aasx, or write it, which")


def write_aasx(
    content: Content,
    identity: str,
    name: str,
    files: Mapping[str, bytes],
    media_types: Mapping[str, str],
    path: Path,
) -> None:
    """Write an AASX: content, identity and name are those of `environment`; bytes and media types of its files by
    their names.

    Raises
    ------
    InputError
        see `aasx_modules`.
    """
    aasx, json_adapter = aasx_modules()
    text = json.dumps(environment(content, identity, name, _FOLDER))
    store = json_adapter.read_aas_json_file(io.StringIO(text), failsafe=False)
    supplements = aasx.DictSupplementaryFileContainer()
    for each, data in files.items():
        supplements.add_file(f"{_FOLDER}{each}", io.BytesIO(data), media_types[each])
    with aasx.AASXWriter(path, failsafe=False) as writer:
        writer.write_all_aas_objects("/aasx/data.json", store, supplements, write_json=True)


def environment_of(path: Path) -> tuple[Mapping[str, Any], Callable[[str], bytes]]:
    """The shells and submodels of an AASX or a JSON file, as JSON has them, and the function that gives the bytes of
    a file that they name.

    Raises
    ------
    InputError
        for a file that is none, for an AASX without basyx-python-sdk, and for a named file that is missing.
    """
    if path.suffix.lower() == ".aasx":
        return _of_aasx(path)
    data = json_of(file_bytes(path, JSON), str(path))
    if not isinstance(data, dict):
        raise InputError(f"{path}: is no asset administration shell")

    def supplement(name: str) -> bytes:
        # a name that leads out of the folder is none of this shell
        file = path.parent / Path(name).name
        try:
            return file_bytes(file)
        except InputError as error:
            raise InputError(f"{error}; {path} names it") from error

    return data, supplement


def _of_aasx(path: Path) -> tuple[Mapping[str, Any], Callable[[str], bytes]]:
    aasx, json_adapter = needs_basyx(f"{path}: reading an AASX")
    from basyx.aas import model

    check_archive(regular(path), str(path), kind="AASX")
    store: Any = model.DictIdentifiableStore()
    files = aasx.DictSupplementaryFileContainer()
    try:
        with aasx.AASXReader(path, failsafe=False) as reader:
            reader.read_into(store, files)
    except Exception as error:  # the library raises errors of its parts
        raise InputError(f"{path}: is no AASX ({printable(str(error))})") from error
    text = io.StringIO()
    json_adapter.write_aas_json_file(text, store)

    def supplement(name: str) -> bytes:
        content = io.BytesIO()
        try:
            files.write_file(name, content)
        except KeyError:
            raise InputError(f"{path}: has no file {printable(name)}, which it names") from None
        return content.getvalue()

    return json.loads(text.getvalue()), supplement
