"""Certification: what is known about an FMU or an SSP package, written into it and signed."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ... import __version__
from ...core.errors import InputError, RunError, printable
from ...core.files import atomic_file
from ...core.inputs import ARCHIVE, file_bytes, regular_bytes
from ...core.model import Model
from ...fmu.description import Interface, Signal, generation_time
from ...fmu.pack import interface_of
from ...fmu.recipe import recipes
from ...fmu.reference import RELATED
from ...fmu.script import Names, name_in_fmu
from ...models import MODELS
from . import documents as docs
from . import experiments as ex
from .archive import LOCAL, contents, unsafe
from .domain import domain
from .manifest import MANIFEST, OWN, SIGNATURE, json_bytes, sha3, signed
from .rerun import TimeTable, UnpackedFmu, unpacked

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

SMOOTH_IN, SMOOTH_OUT = f"{OWN}/smooth_in.csv", f"{OWN}/smooth_out.csv"
Told = Callable[[str], Any]


class Certified(NamedTuple):
    """A certified file: its content, sentences on what it carries, and the same as entries of its SRMD."""

    data: bytes
    words: list[str]
    entries: dict[str, dict[str, str]]


def sources_hash() -> str:
    """The SHA3-256 over the sources of this package and of the C layer of its FMUs: of each file, in the order of
    their paths, its path and its own hash."""
    lines = []
    for name, root in (("chainunit", Path(str(resources.files("chainunit")))), ("fmu", recipes())):
        for path in sorted(root.rglob("*")):
            inside = path.relative_to(root).as_posix()
            if path.suffix in (".py", ".c", ".h", ".js") and not inside.startswith("fmu/recipes/"):
                lines.append(f"{name}/{inside} {sha3(path.read_bytes())}\n")
    return sha3("".join(lines).encode())


def members_of(file: Path) -> dict[str, bytes]:
    """The members of a file without those of an earlier certification.

    Raises
    ------
    InputError
        where the file is no sound archive.
    """
    read = contents(file_bytes(file, ARCHIVE))
    for name, fault in read.faults.items():
        raise InputError(f"{file}: {printable(name) + ': ' if name else ''}{fault}; it is not certified")
    if bad := unsafe(read.members):
        raise InputError(
            f"{file}: the member {printable(bad[0])!r} leads out of its folder; it is not certified"
        )
    return without_certification(read.members)


def without_certification(members: Mapping[str, bytes]) -> dict[str, bytes]:
    """The members as they were before an earlier certification."""
    own = {n: x for n, x in members.items() if not n.startswith(f"{OWN}/") and n != docs.SRMD}
    if len(own) < len(members) and RELATED in own:
        before = docs.related(own.pop(RELATED), ())
        if before is not None:
            own[RELATED] = before
    return own


def place_of(target: Path, members: Mapping[str, bytes], asked: bool) -> Path:
    """The place `target` of a certified file with these members; with `asked` the option -o gave it.

    Raises
    ------
    InputError
        where its name does not end as that of such a file.
    """
    ending = f".{kind_of(members) or 'fmu'}"
    if target.suffix.lower() != ending:
        what = "an SSP package" if ending == ".ssp" else "an FMU"
        remedy = "" if asked else "; name one with -o"
        raise InputError(
            f"{'-o ' if asked else ''}{target}: must be a file name that ends in {ending}, as {what} has it{remedy}"
        )
    return target


def place_beside(file: Path) -> Path:
    """The place of the SRMD beside a certified file.

    Raises
    ------
    InputError
        where meta-data of another file stand there, which would be lost.
    """
    place = file.with_suffix(".srmd")
    if (text := regular_bytes(place)) is None:
        return place
    try:
        of, _ = docs.resource_of(text, str(place))
    except InputError:
        of = ""
    if of != file.name:
        what = f"those of {printable(of)}" if of else "not those of a certified file"
        raise InputError(
            f"{place}: the meta-data there are {what} and would be lost; move them, or name another file with -o"
        )
    return place


def kind_of(members: Mapping[str, bytes]) -> str:
    """The kind of a file with these members, "fmu" or "ssp"; empty for another one."""
    kinds = {"modelDescription.xml": "fmu", "SystemStructure.ssd": "ssp"}
    return next((kind for name, kind in kinds.items() if name in members), "")


def certified(
    members: Mapping[str, bytes], name: str, key: Ed25519PrivateKey, model: Model | None, told: Told
) -> Certified:
    """The certified file with these members, an FMU or an SSP package.

    Parameters
    ----------
    name : of the file, for errors and in its documents
    model : of an FMU, where the caller has it; else it is found by its name
    told : is called with texts on the work

    Raises
    ------
    InputError
        for a file that is neither, or not of this version of the package.
    RunError
        where the FMU does not run on this machine.
    """
    kind = kind_of(members)
    if kind == "fmu":
        return _certified_fmu(dict(members), name, key, model, told)
    if kind == "ssp":
        return _certified_ssp(dict(members), name, key, told)
    raise InputError(
        f"{name}: is neither an FMU (modelDescription.xml) nor an SSP package (SystemStructure.ssd)"
    )


def _certified_fmu(
    members: dict[str, bytes], name: str, key: Ed25519PrivateKey, model: Model | None, told: Told
) -> Certified:
    with unpacked(members, name) as read:
        _require_own(read, name)
        fmu, interface = with_interface(read, model)
        if interface is None and (model or MODELS.get(fmu.name)):
            remedy = "name another file by --of" if model else "export it anew"
            raise InputError(
                f"{name}: is no FMU of {model.name if model else fmu.name}, or its start values make none; {remedy}"
            )
        found = evidence(fmu, interface, told)
        given = [t for t in (found.tables and found.tables[0], found.given) if t]
        limits = domain(fmu, interface, found.points, given)
        if found.given is not None and found.results is not None:
            members[SMOOTH_IN] = fmu.table_bytes(found.given)
            members[SMOOTH_OUT] = fmu.table_bytes(found.results)
        if found.tables:
            members[docs.EXPERIMENTS] = docs.experiments(
                fmu.name, found.tolerance, smooth=found.given is not None
            )
        title = fmu.name
    words = told_evidence(found.data, limits)
    return _signed(members, ("fmu", title), (found.data, limits, words), key)


def _certified_ssp(members: dict[str, bytes], name: str, key: Ed25519PrivateKey, told: Told) -> Certified:
    words, inner = [], {}
    for member, is_own in fmus_in(members).items():
        read = contents(members[member])
        if read.faults:
            raise InputError(f"{name}: {printable(member)} is damaged: {next(iter(read.faults.values()))}")
        if not is_own:
            words.append(
                f"{printable(member)}: is not of this version of chainunit; its hash alone is signed"
            )
            inner[member] = "hash"
            continue
        own = without_certification(read.members)
        made = _certified_fmu(own, f"{name}: {member}", key, None, told)
        members[member] = made.data
        words += [f"{printable(member)}: {line}" for line in made.words]
        inner[member] = "certified"
    found = {"model": "SystemStructure.ssd", "fmus": inner, "sources": sources_hash()}
    return _signed(members, ("ssp", Path(name).stem), (found, None, words), key)


def _signed(
    members: dict[str, bytes],
    of: tuple[str, str],
    found: tuple[dict[str, Any], dict[str, Any] | None, list[str]],
    key: Ed25519PrivateKey,
) -> Certified:
    """The file with the documents on it; `of` is its kind and name, `found` evidence, domain and sentences."""
    kind, title = of
    data, limits, words = found
    members[docs.EVIDENCE] = json_bytes(data)
    if limits is not None:
        members[docs.DOMAIN] = json_bytes(limits)
    # in the order of the files, from which a receiver makes the same texts
    entries = classifications(*(json.loads(json_bytes(each)) for each in (data, limits)))
    members |= reports(title, words, entries, generation_time())
    there = [*members, docs.SBOM, MANIFEST, SIGNATURE]
    members[RELATED] = docs.related(members.get(RELATED), there) or b""
    members[docs.SBOM] = json_bytes(docs.sbom(title, __version__, members))
    head = {"kind": kind, "name": title, "version": __version__, "time": generation_time()}
    return Certified(signed(members, key, **head), words, entries)


def reports(
    title: str, words: Sequence[str], entries: Mapping[str, Mapping[str, str]], time: str
) -> dict[str, bytes]:
    """The members that tell evidence and domain to people and to other programs."""
    head = [f"# {title}", "", f"Certified by chainunit {__version__}.", ""]
    text = "\n".join([*head, *(f"- {line}" for line in words)]) + "\n"
    return {
        docs.REPORT: text.encode(),
        docs.SRMD: docs.srmd(title, entries, __version__, time=time),
    }


def fmus_in(members: Mapping[str, bytes]) -> dict[str, bool]:
    """By the names of the FMUs in an SSP package, and of whatever else is an archive, whether it is an FMU of this
    version of the package."""
    archives = {n: contents(x) for n, x in members.items() if n.endswith(".fmu") or x.startswith(LOCAL)}
    tool = f"chainunit {__version__}".encode()
    return {n: tool in x.members.get("modelDescription.xml", b"") for n, x in sorted(archives.items())}


def _require_own(fmu: UnpackedFmu, name: str) -> None:
    tool = str(fmu.description.generationTool or "")
    if not tool.startswith("chainunit "):
        raise InputError(
            f"{name}: was made by {printable(tool) or 'an unknown tool'}; must be an FMU of chainunit"
        )
    if tool != f"chainunit {__version__}":
        raise InputError(
            f"{name}: was made by {printable(tool)}, this is chainunit {__version__}; export it anew first"
        )


def with_interface(fmu: UnpackedFmu, model: Model | None = None) -> tuple[UnpackedFmu, Interface | None]:
    """The FMU with the names of its model, and the interface of that with its start values; None for a model
    that this package does not know, and where the variables are not those of the model."""
    names: Names = "flat" if fmu.description.variableNamingConvention == "flat" else "structured"
    own = model or MODELS.get(fmu.name)
    if fmu.name == "ChainUnitFlexible" and model is None:
        from ...machines.flexible import with_rods

        rods = sum(name.startswith(name_in_fmu("left.theta_", names)) for name in fmu.variables)
        own = with_rods(rods, fmu.start("parameter"))
    if own is None:
        return fmu, None
    if names == "flat":
        of_model = [signal.name for signal in Interface(own, {}).signals]
        fmu = fmu.with_names({name: name_in_fmu(name, names) for name in of_model})
    try:
        interface = interface_of(own, fmu.start("parameter") | fmu.start("input"))
    except (KeyError, InputError):
        return fmu, None
    return fmu, interface if all(_is_in(fmu, s) for s in interface.signals) else None


def _is_in(fmu: UnpackedFmu, signal: Signal) -> bool:
    """Whether an FMU has a variable with its unit and its nominal size, over which deviations are told."""
    own, variable = fmu.variables.get(signal.name), signal.variable
    if own is None or own.type != variable.type:
        return False
    return variable.type != "Real" or (own.unit, own.nominal) == (
        variable.unit,
        variable.quantity.nominal or 1.0,
    )


class Evidence(NamedTuple):
    """What was found about an FMU: the content of evidence.json, and the tables of its experiments."""

    data: dict[str, Any]
    tables: tuple[TimeTable, TimeTable, TimeTable] | None
    given: TimeTable | None
    results: TimeTable | None
    points: list[ex.StatePoint]
    tolerance: float


def evidence(fmu: UnpackedFmu, interface: Interface | None, told: Told) -> Evidence:
    """Run the experiments of an FMU.

    Raises
    ------
    RunError
        where the FMU does not run on this machine, or does not give its results.
    """
    tolerance = ex.allowed(interface)
    data: dict[str, Any] = {"model": fmu.name, "sources": sources_hash(), "tolerance": tolerance}
    told(f"{fmu.name}: reference experiment")
    tables = ex.reference_tables(fmu)
    if tables:
        data["reference"] = _checked(ex.rerun_reference(fmu, tables), tolerance, "its reference results")
    if interface is None:
        words = (
            "the model is not one of this package by its name; certify its study file or linkage file, or name "
            "it by --of"
        )
        data["left_out"] = f"smooth experiment, energy, points: {words}"
        return Evidence(data, tables, None, None, [], tolerance)
    told(f"{fmu.name}: smooth experiment")
    given = ex.smooth_inputs(interface)
    outputs = [s.name for s in interface.signals_of("output")]
    found, run = ex.convergence(fmu, given, ex.with_shaft(fmu, outputs))
    data["convergence"] = found._asdict()
    _balanced(found.error, ex.STEP_ERROR, "the error of its smallest step is {:.2g}, allowed is {:g}")
    balance = ex.balance_of(run.names)
    if balance:
        missing, flow = ex.energy_residual(run, balance)
        data["energy"] = {"missing": missing, "flow": flow, **balance._asdict()}
        _balanced(
            missing,
            ex.MISSING * flow,
            "its energy does not balance: {:.2g} J are missing, allowed are {:.2g} J",
        )
    told(f"{fmu.name}: points")
    points = ex.chosen_points(interface)
    data["points"] = {
        "at": [point._asdict() for point in points],
        **_checked(ex.rerun_points(fmu, points), tolerance, "the points by the equations in Python"),
        "power_gap": ex.power_gap(interface, points, balance) if balance else None,
    }
    gap = data["points"]["power_gap"]
    _balanced(
        gap or 0.0,
        ex.POWER_GAP,
        "its powers do not balance: the gap is {:.2g} of their size, allowed is {:g}",
    )
    return Evidence(data, tables, given, ex.kept(run, outputs), points, tolerance)


def _checked(found: ex.Deviation, tolerance: float, what: str) -> dict[str, Any]:
    if not found.value <= tolerance:
        raise RunError(
            f"the FMU does not give {what}: {found.of} deviates by {found.value:.2g} of its size, allowed are "
            f"{tolerance:g}; it is not certified"
        )
    return {"deviation": found.value, "of": found.of}


def _balanced(value: float, allowed: float, words: str) -> None:
    if not value <= allowed:
        raise RunError(f"the FMU is not certified: {words.format(value, allowed)}")


def told_evidence(data: Mapping[str, Any], limits: Mapping[str, Any] | None) -> list[str]:
    """Sentences on the evidence and the domain of an FMU."""
    words = []
    if (own := data.get("reference")) is not None:
        words.append(
            f"reference experiment: deviates by {own['deviation']:.2g} of the size of a column, allowed are "
            f"{data['tolerance']:g}"
        )
    else:
        words.append("reference experiment: the FMU has none, as its states are too fast or run away")
    if (own := data.get("convergence")) is not None:
        words.append(f"step: {told_convergence(own)}")
    if (own := data.get("energy")) is not None:
        words.append(
            f"energy: {own['missing']:.2g} J are missing of {own['flow']:.3g} J that went to and fro"
        )
    elif "convergence" in data:
        words.append("energy: no balance, as the model has no outputs of its energies and losses")
    if (own := data.get("points")) is not None:
        gap = own["power_gap"]
        second = (
            ""
            if gap is None
            else f"; the powers balance there to {gap:.2g} by exact derivatives of the energy"
        )
        words.append(
            f"points: {len(own['at'])} states by the equations in Python, deviation {own['deviation']:.2g}{second}"
        )
    if "left_out" in data:
        words.append(f"left out: {data['left_out']}")
    for each in (limits or {}).get("limits", ()):
        value = "none up to 1000 rad/s" if each["value"] is None else f"{each['value']:.4g} rad/s"
        words.append(f"limit: {each['meaning']}: {value}")
    return words


def told_convergence(own: Mapping[str, Any]) -> str:
    """Words on the runs at three steps."""
    at = ", ".join(f"{1e3 * h:g}" for h in own["steps"])
    if own["order"] is None:
        return f"at {at} ms the results differ by {max(own['differences']):.2g}: the step sets no error"
    return f"at {at} ms order {own['order']:.2f}, error {own['error']:.2g} at the smallest"


def classifications(data: Mapping[str, Any], limits: Mapping[str, Any] | None) -> dict[str, dict[str, str]]:
    """The entries of the SRMD: evidence as numbers, domain of validity by variable."""
    general = {"certified by": f"chainunit {__version__}", "sources SHA3-256": data["sources"]}
    for topic, key in (("reference", "deviation"), ("convergence", "error"), ("energy", "missing")):
        if topic in data:
            general[f"{topic} {key}"] = repr(data[topic][key])
    found = {"chainunit.evidence": general}
    if limits is None:
        return found
    found["chainunit.domain-of-validity"] = {
        f"{name} [{own['unit'] or '1'}]": json.dumps(
            {key: own[key] for key in ("start", "min", "max", "tried") if own[key] is not None}
        )
        for name, own in limits["variables"].items()
    }
    found["chainunit.limits"] = {
        f"{each['name']} [{each['unit']}]": json.dumps(each["value"]) for each in limits["limits"]
    }
    return found


def write(made: Certified, file: Path) -> Path:
    """Write a certified file, and its SRMD with checksum beside it; returns the place of the SRMD.

    Raises
    ------
    InputError, WriteError
        see `atomic_file` and `place_beside`.
    """
    beside = place_beside(file)
    with atomic_file(file) as part, atomic_file(beside) as other:
        part.write_bytes(made.data)
        other.write_bytes(docs.srmd(file.name, made.entries, __version__, (file.name, made.data)))
    return beside
