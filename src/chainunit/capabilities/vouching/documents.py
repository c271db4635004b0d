"""The documents that go with a certified file, each in the form of its standard.

- the manifest of FMI-LS-REF (1.0.0-beta.1), which tells the role of each related file;
- meta-data as SRMD of SSP Traceability 1.0 (`SimulationResourceMetaData`), inside the file and beside it;
- a bill of materials in CycloneDX 1.6 (JSON).
"""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from ...core.inputs import xml_of
from ...fmu.description import generation_time
from ...fmu.pack import xml_bytes
from ...fmu.reference import (
    EXPERIMENTS_TYPE,
    INPUTS,
    REFERENCE,
    STEP,
    STEPPED,
    ReferenceExperiment,
    experiments_file,
    related_files,
)
from .manifest import OWN, sha3

SRMD = "extra/org.ssp-standard.ssp-traceability.srmd/resourceMetaData.srmd"
SRMD_VERSION = "1.0.0"
SBOM, EVIDENCE, DOMAIN, REPORT, EXPERIMENTS = (
    f"{OWN}/{name}"
    for name in ("sbom.cdx.json", "evidence.json", "domain.json", "report.md", "experiments.exp")
)
_FOLDER = OWN.rpartition("/")[2]
_SRMD_SOURCE = "../" + SRMD.removeprefix("extra/")
_JSON = "application/json"
_RELATED = (
    ("report", "text/markdown", f"{_FOLDER}/report.md", "What is known about this file, and what was found"),
    ("report", _JSON, f"{_FOLDER}/evidence.json", "The same as numbers: experiments, errors, energy, points"),
    ("meta-data", _JSON, f"{_FOLDER}/domain.json", "Domain of validity by variable"),
    ("meta-data", "application/vnd.cyclonedx+json", f"{_FOLDER}/sbom.cdx.json", "Bill of materials, CycloneDX"),
    ("meta-data", "application/x-srmd-meta-data", _SRMD_SOURCE, "SRMD of SSP Traceability"),
    ("experiment/validation", EXPERIMENTS_TYPE, f"{_FOLDER}/experiments.exp", "Experiments with inputs and results"),
    ("signature", _JSON, f"{_FOLDER}/manifest.json", "SHA3-256 of every member of this file"),
    ("signature", _JSON, f"{_FOLDER}/signature.json", "Ed25519 signature of manifest.json"),
)  # fmt: skip
_COMPONENTS = ("casadi", "fmpy", "numpy", "scipy")
"""Packages that make an FMU or its evidence."""


def related(content: bytes | None, there: Sequence[str]) -> bytes | None:
    """The manifest of FMI-LS-REF with the files of a certification in place of those of an earlier one; None where it
    would name no file.

    Parameters
    ----------
    content : the present manifest, or None
    there : names of the members of the certified file
    """
    root = related_files(content)
    for node in list(root.findall("Related")):
        source = node.get("source", "")
        if source.startswith(f"{_FOLDER}/") or source == _SRMD_SOURCE:
            root.remove(node)
    # what follows the related files, by the schema, is annotations
    at = len(root.findall("Related"))
    for role, kind, source, words in _RELATED:
        place = SRMD if source == _SRMD_SOURCE else f"{REFERENCE}/{source}"
        if place in there:
            root.insert(at, Element("Related", type=kind, source=source, role=role, description=words))
            at += 1
    return xml_bytes(root) if len(root) else None


def experiments(name: str, tolerance: float, *, smooth: bool) -> bytes:
    """The experiments of an FMU: file of inputs, file of results, step and tolerance of each."""
    reference = ReferenceExperiment(
        "reference",
        "all inputs move and are set at the begin of each step; results at the end of each step",
        STEP,
        f"../{name}_{INPUTS}.csv",
        f"../{name}_{STEPPED}.csv",
        tolerance,
    )
    words = "a shaft moves smoothly, all else stays; results every 40 ms, read once the inputs are set"
    smoothly = ReferenceExperiment("smooth", words, 0.001, "smooth_in.csv", "smooth_out.csv", tolerance)
    return experiments_file(
        name,
        "Experiments whose results a certified FMU must give",
        [reference, smoothly] if smooth else [reference],
    )


def srmd(
    name: str,
    entries: Mapping[str, Mapping[str, str]],
    version: str,
    data: tuple[str, bytes] | None = None,
    time: str = "",
) -> bytes:
    """Meta-data as SRMD.

    Parameters
    ----------
    entries : by the type of a classification, its values by keyword
    version : of this package
    data : for a file beside a resource, its name and content, whose SHA3-256 becomes the checksum
    time : of the file, by default that of this version
    """
    root = Element(
        "srmd:SimulationResourceMetaData",
        {
            "xmlns:srmd": "http://ssp-standard.org/SSPTraceability1/SimulationResourceMetaData",
            "xmlns:stc": "http://ssp-standard.org/SSPTraceability1/SSPTraceabilityCommon",
            "version": SRMD_VERSION,
            "name": name,
            "generationTool": f"chainunit {version}",
            "generationDateAndTime": time or generation_time(),
        },
    )
    if data:
        root.set("data", data[0])
        root.set("checksum", sha3(data[1]))
        root.set("checksumType", "SHA3-256")
    for kind, values in entries.items():
        group = SubElement(root, "stc:Classification", type=kind)
        for keyword, value in values.items():
            SubElement(group, "stc:ClassificationEntry", keyword=keyword, type="text/plain").text = value
    return xml_bytes(root)


def resource_of(content: bytes, name: str) -> tuple[str, str]:
    """The name and the checksum of the file of which an SRMD tells; empty where it gives none.

    Raises
    ------
    InputError
        in one line that begins with the `name` of the SRMD.
    """
    root = xml_of(content, name)
    return root.get("data", ""), root.get("checksum", "")


def sbom(name: str, version: str, members: Mapping[str, bytes]) -> dict[str, Any]:
    """A bill of materials in CycloneDX 1.6: the file, its members with hashes, and what made it."""
    files = [
        {
            "type": "file",
            "bom-ref": f"member:{member}",
            "name": member,
            "hashes": [{"alg": "SHA3-256", "content": sha3(content)}],
        }
        for member, content in sorted(members.items())
    ]
    tools = [
        _package("chainunit", version),
        *(_package(each, metadata.version(each)) for each in _COMPONENTS),
    ]
    if any(member.startswith("resources/") and member.endswith(".py") for member in members):
        tools.append(_package("pythonfmu", metadata.version("pythonfmu")))
    digest = sha3("\n".join(f["hashes"][0]["content"] for f in files).encode())  # type: ignore[index]
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{uuid.UUID(digest[:32], version=4)}",
        "version": 1,
        "metadata": {
            "timestamp": generation_time(),
            "tools": {"components": tools},
            "component": {"type": "library", "bom-ref": "certified", "name": name, "version": version},
        },
        "components": files,
        "dependencies": [{"ref": "certified", "dependsOn": [f["bom-ref"] for f in files]}],
    }


def _package(name: str, version: str) -> dict[str, str]:
    purl = f"pkg:pypi/{name}@{version}"
    return {"type": "library", "bom-ref": purl, "name": name, "version": version, "purl": purl}
