"""Verification: the bytes of a certified file, and its experiments again on this machine."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...core.errors import InputError, RunError, printable
from ...core.inputs import ARCHIVE, file_bytes, json_of, refuse_large_archive, regular_bytes
from ...core.model import Model
from . import documents as docs
from . import experiments as ex
from .certify import SMOOTH_IN, SMOOTH_OUT, Told, interface_for, sources_hash, told_convergence
from .domain import domain
from .integrity import Finding, Integrity, integrity
from .libraries import usable
from .manifest import Manifest, sha3
from .rerun import NoLibraryError, UnpackedFmu, deviation, table, unpacked

NOT_RUN = "experiments"
"""Topic of the line on experiments that are not run."""
_GROWTH = 4.0
"""An error on this machine may be so many times the stated one: rounding is another with another library of C."""


def verify(
    file: Path, key: bytes | None, model: type[Model] | None = None, *, run: bool = True, told: Told = print
) -> list[Finding]:
    """Check a certified file line by line.

    Parameters
    ----------
    key : public key of whom the receiver expects the signature, or None
    model : of the FMU, where the caller has it; else it is found by its name
    run : whether the experiments run again; this loads the library of the FMU
    told : is called with texts on the work

    Raises
    ------
    InputError
        for a file that is not there, or no archive at all.
    """
    data = file_bytes(file, ARCHIVE)
    refuse_large_archive(data, str(file))
    found = integrity(data, key)
    if not found.is_archive:
        raise InputError(f"{file}: is no FMU and no SSP package: it is not a zip archive")
    _beside(found, file, data)
    _judge(found, file.name, model, run, told)
    return found.findings


def _judge(found: Integrity, name: str, model: type[Model] | None, run: bool, told: Told) -> None:
    """Add the lines behind those on the bytes."""
    if found.manifest is None:
        return
    _version(found, found.manifest)
    if not found.holds and any(each.topic != "version" for each in found.findings if each.holds is False):
        found.add(None, NOT_RUN, "are not run: a file that is not as signed is not loaded")
        return
    try:
        stated = json_of(found.members[docs.EVIDENCE], "evidence")
        if found.manifest.kind == "ssp":
            _system(found, stated, name, run, told)
        else:
            with unpacked(found.members, name) as fmu:
                _Experiments(found, fmu, stated, model, told).judge(run)
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        words = str(error) if isinstance(error, InputError) else "is not of the form that this version writes"
        found.add(False, "evidence", f"{docs.EVIDENCE}: {words}")


def _version(found: Integrity, manifest: Manifest) -> None:
    own, theirs = _numbers(__version__), _numbers(manifest.version)
    if manifest.version == __version__:
        found.add(True, "version", f"certified by chainunit {__version__}, as is installed here")
    elif theirs < own:
        found.add(
            False,
            "version",
            f"certified by chainunit {printable(manifest.version, 40)}, older than {__version__} here: its "
            "equations may have been mended since; export and certify it again",
        )
    else:
        found.add(
            False,
            "version",
            f"certified by chainunit {printable(manifest.version, 40)}, newer than {__version__} here: install that "
            "version",
        )


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(n) for n in re.findall(r"\d+", version)[:6] if len(n) < 10)


def _beside(found: Integrity, file: Path, data: bytes) -> None:
    """The checksum of the SRMD beside the file, if it is there."""
    text = regular_bytes(file.with_suffix(".srmd"))
    if text is None:
        return
    name = printable(file.with_suffix(".srmd").name)
    stated = re.search(rb'\schecksum="([0-9A-Fa-f]{64})"', text[:10_000])
    if stated is None:
        found.add(False, "SRMD", f"{name} beside the file: has no checksum of 256 bits")
    elif stated[1].decode().lower() == sha3(data):
        found.add(True, "SRMD", f"{name} beside the file has its SHA3-256")
    elif (of := docs.resource_of(text)) not in ("", file.name):
        found.add(None, "SRMD", f"{name} beside the file: is that of {printable(of)}")
    else:
        found.add(False, "SRMD", f"{name} beside the file: is of another file, its SHA3-256 differs")


def _system(found: Integrity, stated: Mapping[str, Any], name: str, run: bool, told: Told) -> None:
    """The FMUs of an SSP package that are certified themselves; the key must be that of the package."""
    _sources(found, stated)
    for member, how in stated["fmus"].items():
        if how != "certified":
            found.add(None, printable(member), "is no FMU of this package; its hash alone is signed")
            continue
        inner = integrity(found.members[member], found.public, "the key of the package")
        _judge(inner, f"{name}: {member}", None, run, told)
        for each in inner.findings:
            found.add(each.holds, f"{printable(member)}, {each.topic}", each.words)


def _sources(found: Integrity, stated: Mapping[str, Any]) -> None:
    if stated["sources"] != sources_hash():
        words = (
            "the sources of chainunit here are not those that certified the file, though the version may be"
        )
        found.add(None, "sources", words)


class _Experiments:
    """The experiments of a certified FMU again, on this machine."""

    def __init__(
        self,
        found: Integrity,
        fmu: UnpackedFmu,
        stated: Mapping[str, Any],
        model: type[Model] | None,
        told: Told,
    ) -> None:
        self._found, self._fmu, self._stated, self._told = found, fmu, stated, told
        self._tolerance = float(stated["tolerance"])
        self._model = model
        self._interface = interface_for(fmu, model)
        self._points = [ex.StatePoint(**each) for each in stated.get("points", {}).get("at", ())]

    def judge(self, run: bool) -> None:
        """Add a line for each experiment."""
        _sources(self._found, self._stated)
        self._domain()
        self._equations()
        if not run:
            self._found.add(None, NOT_RUN, "are not run, as --no-run asks")
            return
        try:
            self._fmu, words = usable(self._fmu)
            if words:
                self._found.add(None, "library", words)
            self._reference()
            self._smooth()
            self._at_points()
        except NoLibraryError as error:
            self._found.add(None, NOT_RUN, f"are not run: {error}")
        except RunError as error:
            self._found.add(False, NOT_RUN, str(error))

    def _add(self, topic: str, gap: ex.Deviation, what: str) -> None:
        holds = gap.value <= self._tolerance
        most = (
            f"largest deviation {gap.value:.2g} of the size of {printable(gap.of)}"
            if gap.value
            else "no deviation"
        )
        self._found.add(holds, topic, f"{what}: {most}, allowed are {self._tolerance:g}")

    def _reference(self) -> None:
        if "reference" not in self._stated:
            self._found.add(None, "reference experiment", "the FMU has none")
            return
        self._told("reference experiment")
        tables = ex.reference_tables(self._fmu)
        if tables is None:
            self._found.add(False, "reference experiment", "its files are missing")
            return
        self._add("reference experiment", ex.rerun_reference(self._fmu, tables), "the FMU here")

    def _smooth(self) -> None:
        if "convergence" not in self._stated:
            return
        self._told("smooth experiment")
        given, wanted = (table(self._fmu.file(name) or b"") for name in (SMOOTH_IN, SMOOTH_OUT))
        own, run = ex.convergence(self._fmu, given, ex.with_shaft(self._fmu, wanted.names))
        gap = deviation(ex.kept(run, wanted.names), wanted, self._fmu)
        self._add("smooth experiment", ex.Deviation(*gap), "the FMU here")
        stated = self._stated["convergence"]
        holds = own.error <= _GROWTH * stated["error"] + 1e-10
        words = f"{told_convergence(own._asdict())}; certified with an error of {stated['error']:.2g}"
        self._found.add(holds, "step", words)
        if (energy := self._stated.get("energy")) is None:
            return
        missing, flow = ex.energy_residual(
            run, ex.EnergyBalance(*(tuple(energy[k]) for k in ex.EnergyBalance._fields))
        )
        holds = missing <= _GROWTH * energy["missing"] + 1e-9 * flow
        words = f"{missing:.2g} J are missing of {flow:.3g} J; certified with {energy['missing']:.2g} J"
        self._found.add(holds, "energy", words)

    def _at_points(self) -> None:
        if self._points:
            self._told("points")
            count = len(self._points)
            self._add("points", ex.rerun_points(self._fmu, self._points), f"the FMU here, at {count} states")

    def _equations(self) -> None:
        """The equations in Python of the package here, which need no library of the FMU."""
        if not self._points:
            words = self._stated.get("left_out", "no points were certified")
            self._found.add(None, "equations", printable(words, 300))
        elif self._interface is None:
            words = (
                "the model of the file that --of names is not that of the FMU"
                if self._model
                else "the model is not one of the package here by its name; name its file by --of"
            )
            self._found.add(None, "equations", words)
        else:
            gap = ex.recompute_points(self._fmu, self._interface.model, self._points)
            self._add("equations", gap, f"the equations in Python here, at {len(self._points)} states")

    def _domain(self) -> None:
        content = self._fmu.file(docs.DOMAIN)
        stated = json_of(content or b"null", docs.DOMAIN)
        # a certificate that was made without the model has no conditions of it
        has_model = "left_out" not in self._stated
        if has_model and self._interface is None:
            self._found.add(
                None, "domain", f"{len(stated['variables'])} variables, as certified; not computed again"
            )
            return
        tables = ex.reference_tables(self._fmu)
        smooth = self._fmu.file(SMOOTH_IN)
        given = [t for t in (tables and tables[0], table(smooth) if smooth else None) if t]
        own = domain(self._fmu, self._interface if has_model else None, self._points, given)
        different = _difference(stated, json.loads(json.dumps(own)), "")
        words = (
            f"{len(own['variables'])} variables and {len(own['limits'])} limits are computed again, the same"
        )
        limits = "".join(
            f"; {each['name']} {each['value']:.4g} rad/s"
            for each in own["limits"]
            if each["value"] is not None
        )
        self._found.add(
            not different,
            "domain",
            f"{different} differs from the certified one" if different else words + limits,
        )


def _difference(one: Any, other: Any, place: str) -> str:
    """The place of the first difference of two values of JSON, empty where they are alike. Numbers are so to 1e-7: a
    limit that is searched for is known to 1e-9 rad/s, and depends on the functions of the C library."""
    if isinstance(one, dict) and isinstance(other, dict):
        if one.keys() != other.keys():
            return f"{place}: its keys"
        return next((d for k in one if (d := _difference(one[k], other[k], f"{place}.{k}".strip(".")))), "")
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        pairs = enumerate(zip(one, other, strict=True))
        return next((d for k, (a, b) in pairs if (d := _difference(a, b, f"{place}[{k}]"))), "")
    if isinstance(one, float | int) and isinstance(other, float | int):
        return "" if bool(np.isclose(one, other, rtol=1e-7, atol=1e-12)) else place
    return "" if one == other else place
