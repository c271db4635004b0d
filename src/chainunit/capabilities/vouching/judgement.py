"""The judgement of a certified file whose bytes are as signed: its evidence by the equations of the package here, and
its experiments again on this machine. The limits are those of the package; a file can only state stricter ones."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ... import __version__
from ...core.errors import InputError, RunError, printable, shown
from ...core.model import Model
from ...models import MODELS
from . import certify
from . import documents as docs
from . import experiments as ex
from .domain import domain
from .integrity import NOT_RUN, Integrity, integrity
from .libraries import usable
from .manifest import Manifest, json_value
from .rerun import NoLibraryError, TimeTable, UnpackedFmu, deviation, unpacked

_UNRUN = "experiments were not run"
_GROWTH = 4.0
"""An error on this machine may be so many times the stated one: rounding is another with another library of C."""


def judge(
    found: Integrity, manifest: Manifest, name: str, model: Model | None, unrun: str, told: certify.Told
) -> None:
    """Add the lines after those on the bytes; `unrun` tells why no code of the file runs, empty if it may."""
    kind, members = manifest.kind, found.members
    if kind != certify.kind_of(members):
        found.add(False, "manifest", f"kind = {shown(kind)}: the members are not those of such a file")
        return
    _version(found, manifest)
    try:
        stated = json_value(members.get(docs.EVIDENCE), docs.EVIDENCE)
        if stated["sources"] != certify.sources_hash():
            words = "the sources of chainunit here did not certify the file, even if the version is the same"
            found.add(None, "sources", words)
        with np.errstate(all="ignore"):  # numbers from outside, and those of other code
            if kind == "ssp":
                _system(found, stated, name, unrun, told)
            else:
                with unpacked(members, name) as fmu:
                    _Check(found, fmu, stated, model, told).judge(unrun)
    except InputError as error:
        found.add(False, "evidence", str(error))
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError):
        found.add(False, "evidence", f"{docs.EVIDENCE}: is not of the form that this version writes")


def _version(found: Integrity, manifest: Manifest) -> None:
    own, theirs = _numbers(__version__), _numbers(manifest.version)
    words = f"certified by chainunit {printable(manifest.version, 40)}"
    if manifest.version == __version__:
        found.add(True, "version", f"{words}, as is installed here")
    elif theirs < own:
        mended = "its equations may have been mended since; export and certify it again"
        found.add(False, "version", f"{words}, older than {__version__} here: {mended}")
    else:
        found.add(False, "version", f"{words}, newer than {__version__} here: install that version")


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(n) for n in re.findall(r"\d+", version)[:6] if len(n) < 10)


def _system(found: Integrity, stated: Mapping[str, Any], name: str, unrun: str, told: certify.Told) -> None:
    """The FMUs of an SSP package that are certified themselves; the key must be that of the package."""
    inside = certify.fmus_in(found.members)
    if {member: "certified" if own else "hash" for member, own in inside.items()} != stated["fmus"]:
        found.add(False, "evidence", f"{docs.EVIDENCE}: does not tell of the FMUs that are in the package")
        return
    if not inside:
        found.add(None, "FMUs", "the package has none", "nothing in it was judged")
    for member, own in inside.items():
        if not own:
            words = "is no FMU of this package; its hash alone is signed"
            found.add(None, printable(member), words, f"{printable(member)} was not judged")
            continue
        inner = integrity(found.members[member], found.public, "the key of the package")
        if inner.manifest is None and inner.holds:
            inner.add(False, "manifest", "is missing")
        if manifest := inner.trusted_manifest():
            judge(inner, manifest, f"{name}: {member}", None, unrun, told)
        for each in inner.findings:
            found.add(each.holds, f"{printable(member)}, {each.topic}", each.words, each.open)


class _Check:
    """The evidence and the experiments of a certified FMU by the equations and the limits here."""

    def __init__(
        self,
        found: Integrity,
        fmu: UnpackedFmu,
        stated: Mapping[str, Any],
        model: Model | None,
        told: certify.Told,
    ) -> None:
        fmu, interface = certify.with_interface(fmu, model)
        self._found, self._fmu, self._stated, self._told = found, fmu, stated, told
        self._model, self._interface = model, interface
        # a certificate that was made without the file of the model has the reference experiment alone
        self._left_out = "left_out" in stated and fmu.name not in MODELS
        self._limit = ex.allowed(None if self._left_out else self._interface)
        self._tables = ex.reference_tables(fmu)
        smooth = fmu.file(certify.SMOOTH_IN)
        self._smooth = fmu.table(smooth) if smooth else None
        self._points = [ex.StatePoint(**each) for each in stated.get("points", {}).get("at", ())]

    def judge(self, unrun: str) -> None:
        """Add a line for each part. Code of the FMU runs only if all else holds, and `unrun` gives no reason."""
        if self._interface is None and (self._model or self._fmu.name in MODELS):
            words = (
                "the model of the file that --of names"
                if self._model
                else f"{self._fmu.name} of the package here"
            )
            self._found.add(False, "equations", f"{words} is not that of the FMU")
            return
        faults = self._evidence()
        for words in faults:
            self._found.add(False, "evidence", f"{docs.EVIDENCE}: {words}")
        if not faults:
            self._domain()
            self._equations()
        if not self._found.holds:
            self._found.add(None, NOT_RUN, "are not run: an FMU that does not fit its evidence is not loaded")
        elif unrun:
            self._found.add(None, NOT_RUN, f"are not run, {unrun}", _UNRUN)
        else:
            self._run()

    def _evidence(self) -> list[str]:
        """What is wrong with the evidence: it states all that this version finds, as numbers within the limits
        here."""
        stated, manifest, faults = self._stated, self._found.manifest, []
        if stated["model"] != self._fmu.name:
            faults.append(
                f"model = {shown(stated['model'])}: must be that of the FMU, {shown(self._fmu.name)}"
            )
        if self._interface and not self._left_out:
            faults += [f"{topic}: is missing" for topic in ("convergence", "points") if topic not in stated]
        if ("reference" in stated) != (self._tables is not None):
            faults.append("reference: is missing, or the files of the experiment are")
        most = {
            "tolerance": self._limit,
            "reference.deviation": self._limit,
            "convergence.error": ex.STEP_ERROR,
            "energy.missing": ex.MISSING * stated.get("energy", {"flow": 0.0})["flow"],
            "points.deviation": self._limit,
            "points.power_gap": ex.POWER_GAP,
        }
        for place, limit in most.items():
            topic, _, key = place.partition(".")
            if topic not in stated:
                continue
            value = stated[topic][key] if key else stated[topic]
            if not (_is_number(value) and 0.0 <= value <= limit) and (key, value) != ("power_gap", None):
                faults.append(f"{place} = {shown(value)}: must be a number from 0 to {limit:g}")
        if not all(_is_number(x) for point in self._points for values in point for x in values.values()):
            faults.append("points: have values that are no numbers")
        if faults or manifest is None or manifest.version != __version__:
            return faults
        limits = json_value(self._fmu.file(docs.DOMAIN), docs.DOMAIN)
        words, entries = certify.told_evidence(stated, limits), certify.classifications(stated, limits)
        time = re.search(rb'generationDateAndTime="([-:\w]+)"', self._fmu.file(docs.SRMD) or b"")
        told = certify.reports(self._fmu.name, words, entries, time[1].decode() if time else "")
        return [f"{name} says something else" for name, x in told.items() if self._fmu.file(name) != x]

    def _equations(self) -> None:
        """The experiments in the file against those by the equations of the package here, which need no library of
        the FMU."""
        if self._interface is None:
            remedy = "name its file by --of"
            words = f"the model is not one of the package here by its name; {remedy}"
            self._found.add(None, "equations", words, f"was not compared with its equations: {remedy}")
            return
        self._told("equations")
        try:
            wanted = ex.by_equations(self._interface)
        except ModuleNotFoundError as error:
            left = f"its experiments were not computed again without the package {error.name}"
            self._found.add(None, "evidence", left, left)
            points = ex.recomputed(self._interface.model, self._points)
            wanted = ex.Experiments(self._tables, self._smooth, points)
        if self._left_out:
            self._points = wanted.points
            wanted = wanted._replace(smooth=None)
        gap = ex.point_gap(self._fmu, self._points, wanted.points)
        reference = (self._tables or (None,) * 3, wanted.reference or (None,) * 3)
        for stated, own in [(self._smooth, wanted.smooth), *zip(*reference, strict=True)]:
            if stated and own:
                gap = max(gap, ex.Deviation(*deviation(stated, own, self._fmu)))
            elif stated or own:
                gap = ex.Deviation(math.inf, "an experiment that is missing, or is not of the model")
        self._add("equations", gap, f"the equations in Python here, at {len(self._points)} states")

    def _add(self, topic: str, gap: ex.Deviation, what: str) -> None:
        limit = min(self._limit, self._stated["tolerance"])
        most = (
            f"largest deviation {gap.value:.2g} of the size of {printable(gap.of)}"
            if gap.value
            else "no deviation"
        )
        self._found.add(gap.value <= limit, topic, f"{what}: {most}, allowed are {limit:g}")

    def _run(self) -> None:
        try:
            self._fmu, words = usable(self._fmu)
            if words:
                self._found.add(None, "library", words, "its own library was not run")
            if self._tables:
                self._told("reference experiment")
                self._add("reference experiment", ex.rerun_reference(self._fmu, self._tables), "the FMU here")
            else:
                self._found.add(None, "reference experiment", "the FMU has none")
            if self._smooth:
                self._told("smooth experiment")
                self._rerun_smooth(self._smooth)
            if self._points:
                self._told("points")
                gap = ex.rerun_points(self._fmu, self._points)
                self._add("points", gap, f"the FMU here, at {len(self._points)} states")
        except NoLibraryError as error:
            self._found.add(None, NOT_RUN, f"are not run: {error}", _UNRUN)
        except RunError as error:
            self._found.add(False, NOT_RUN, str(error))

    def _rerun_smooth(self, given: TimeTable) -> None:
        wanted = self._fmu.table(self._fmu.file(certify.SMOOTH_OUT) or b"")
        if not ex.covers(given, ex.STEP / 2**ex.HALVINGS, round(ex.END / ex.STEP) * 2**ex.HALVINGS + 1):
            raise InputError(
                f"{certify.SMOOTH_IN}: must have a row in each {1e3 * ex.STEP / 2**ex.HALVINGS:g} ms of {ex.END:g} s"
            )
        outputs = [s.name for s in self._interface.signals_of("output")] if self._interface else wanted.names
        own, run = ex.convergence(self._fmu, given, ex.with_shaft(self._fmu, outputs))
        self._add(
            "smooth experiment",
            ex.Deviation(*deviation(ex.kept(run, outputs), wanted, self._fmu)),
            "the FMU here",
        )
        error = self._stated["convergence"]["error"]
        holds = own.error <= min(_GROWTH * error + 1e-10, ex.STEP_ERROR)
        words = f"{certify.told_convergence(own._asdict())}; certified with an error of {error:.2g}"
        self._found.add(holds, "step", words)
        if (balance := ex.balance_of(run.names)) is None:
            return
        missing, flow = ex.energy_residual(run, balance)
        certified, most = self._stated["energy"]["missing"], ex.MISSING * flow
        holds = certified <= most and missing <= min(_GROWTH * certified + 1e-9 * flow, most)
        words = f"{missing:.2g} J are missing of {flow:.3g} J; certified with {certified:.2g} J"
        self._found.add(holds, "energy", words)

    def _domain(self) -> None:
        stated = json_value(self._fmu.file(docs.DOMAIN), docs.DOMAIN)
        if self._interface is None and not self._left_out:
            words = f"{len(stated['variables'])} variables, as certified; not computed again"
            self._found.add(None, "domain", words)
            return
        given = [t for t in (self._tables and self._tables[0], self._smooth) if t]
        own = domain(self._fmu, None if self._left_out else self._interface, self._points, given)
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


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and math.isfinite(value)


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
