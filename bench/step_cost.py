# %% [markdown]
# Cost of a step
#
# Microseconds of one kernel call under `math` (a point) and `numpy` (per point of an array), of one FMU step
# through fmpy, and of one from a C loop, measured side by side in one run. The limits: through fmpy, an empty FMU
# (one input, its multiple as output), which is the importer's own overhead; from C, the bare generated kernel,
# which a step with all outputs may exceed by half. Then the kernels of each model with the package's own sine and the
# like, beside the same kernels with those of the C library; the own ones may take a tenth more.

# %%
from __future__ import annotations

import shutil
import subprocess
import tempfile
import timeit
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from figures import parser, save
from rich.console import Console
from rich.table import Table

from chainunit import ChainUnitMachine
from chainunit.core import engines
from chainunit.core.integrators import rk4
from chainunit.core.model import Model, Part
from chainunit.core.printing.python_functions import function_text
from chainunit.core.quantities import Value, declaration, quantity
from chainunit.drives.dc_motor import DcMotor
from chainunit.fmu.backends import export
from chainunit.fmu.model_instance import Settable
from chainunit.fmu.native import export as native
from chainunit.fmu.pack import interface_of
from chainunit.fmu.printed_model import printed_model
from chainunit.machines.chain_unit import ChamberForces
from chainunit.models import MODELS, model_named
from chainunit.system.instance import Fmu, Instance


@declaration
class Gain:
    k: Value = quantity("1", "factor", default=1.0)


@declaration
class One:
    u: Value = quantity("1", "a number", default=0.0)


@declaration
class Same:
    y: Value = quantity("1", "that number times the factor")


Empty = Model(
    name="Empty",
    text="A model that does nothing.",
    description="one input, its multiple as the output",
    Parameters=Gain,
    Inputs=One,
    parts=(Part(Same, lambda xp, p, u, x, shared: Same(y=p.k * u.u)),),
)


def cost(call, number: int = 1000, repeat: int = 5) -> float:
    """The least time of a call [us] over `repeat` rounds."""
    return 1e6 * min(timeit.repeat(call, number=number, repeat=repeat)) / number


def from_c(folder: Path) -> list[tuple[str, float]]:
    """The FMU's sources with loop.c, compiled as the FMU is."""
    file = native.export(ChamberForces, folder / "loop.fmu")
    sources = folder / "sources"
    with zipfile.ZipFile(file) as archive:
        for name in archive.namelist():
            if name.startswith("sources/"):
                archive.extract(name, folder)
    command = [
        shutil.which("cc"),
        "-std=gnu99",
        "-O2",
        "-fPIC",
        "-ffp-contract=off",
        "-o",
        str(folder / "loop"),
    ]
    loop = Path(__file__).parent / "loop.c"
    subprocess.run(
        [
            *command,
            str(loop),
            *(str(sources / n) for n in ("kernels.c", "model.c", "fmi2.c")),
            "-I",
            str(sources),
            "-lm",
        ],
        check=True,
    )
    fmu = Fmu(file)
    names = ["phi", "w", "a", "tau_bias", "J", "dJ_dphi", "phi0", "w0", "tau_bias_dphi", "tau_bias_dw"]
    references = [str(fmu.variables[n].valueReference) for n in names]
    fmu.close()
    output = subprocess.run(
        [str(folder / "loop"), *references], check=True, capture_output=True, text=True
    ).stdout
    bare, plain, port, everything = (1e-3 * float(x) for x in output.split())
    print(
        f"From C, set + step + get all outputs costs {everything / bare:.2f} times the bare kernel (limit: 1.5)."
    )
    return [
        ("bare generated kernel, all outputs, from C", bare),
        ("native FMU from C, set three inputs + step", plain),
        ("native FMU from C, set + step + get the load port", port),
        ("native FMU from C, set + step + get all outputs", everything),
    ]


GALLERY = Path(__file__).parents[1] / "examples" / "linkages"
PROCESSES = 7
LINKAGES = ("slider_crank_press", "stephenson_six_bar")
FLAGS = ("-std=gnu99", "-O2", "-fPIC", "-ffp-contract=off")


def beside_the_library(model: Model, folder: Path) -> dict[str, list[float]]:
    """The cost of all outputs and of the derivatives [ns], with the own functions and with those of the C library."""
    folder.mkdir()
    with zipfile.ZipFile(native.export(model, folder / "a.fmu")) as archive:
        archive.extractall(folder)
    sources, bench, other = folder / "sources", Path(__file__).parent, folder / "libm"
    other.mkdir()
    for name in ("kernels.c", "model.h"):
        shutil.copy(sources / name, other)
    shutil.copy(bench / "libm.h", other / "elementary.h")
    for prefix, of in (("own", sources), ("libm", other)):
        command = ["cc", *FLAGS, f"-DFMI2_FUNCTION_PREFIX={prefix}_", "-c", of / "kernels.c"]
        subprocess.run([*command, "-o", folder / f"{prefix}.o"], check=True)
    files = [bench / "kernels.c", sources / "model.c", folder / "own.o", folder / "libm.o"]
    program = folder / "kernels"
    subprocess.run(["cc", *FLAGS, "-I", sources, *files, "-o", program, "-lm"], check=True)
    moved = [v for layout in (model.input_layout, model.state_layout) if layout for v in layout.variables]
    angles = [str(k) for k, v in enumerate(moved) if v.unit == "rad"]
    # in each process the memory lies elsewhere, which may cost more than the functions
    texts = [
        subprocess.run([program, *angles], check=True, capture_output=True, text=True).stdout
        for _ in range(PROCESSES)
    ]
    own, libm, own_rates, libm_rates = np.min([np.fromstring(t, sep=" ") for t in texts], axis=0).tolist()
    costs = {"all outputs": [own, libm]}
    return costs | ({"derivatives of the states": [own_rates, libm_rates]} if model.state_layout else {})


def own_functions(folder: Path) -> dict[str, dict[str, list[float]]]:
    """The costs of `beside_the_library` of each model, shown in a table."""
    models = dict(MODELS) | {name: model_named(str(GALLERY / f"{name}.toml")) for name in LINKAGES}
    table = Table("model", "what", "own, ns", "C library, ns", "ratio")
    costs = {}
    for name, model in models.items():
        costs[name] = beside_the_library(model, folder / name)
        for what, (own, libm) in costs[name].items():
            table.add_row(name, what, f"{own:.0f}", f"{libm:.0f}", f"{own / libm:.2f}")
    Console(width=110).print(table)
    return costs


def printed_outputs() -> Callable[[], tuple[float, ...]]:
    """The function of all outputs as a Python FMU has it, called with the start values."""
    module = ModuleType("printed")
    module.__package__ = "chainunit"
    exec(printed_model(interface_of(ChamberForces, None)), vars(module))
    names: dict[str, Any] = {}
    exec(function_text("def values(p, u, x):", module.STATEMENTS, module.OUTPUTS), vars(module), names)
    starts = [Settable(*row).start for row in module.SETTABLE]
    p, u = starts[: module.PARAMETERS], starts[module.PARAMETERS :]
    return lambda: names["values"](p, u, ())


def main() -> None:
    options, sizes = parser().parse_args(), {}
    p = ChainUnitMachine().p
    u = ChamberForces.Inputs(phi=0.5, w=6.0, a=1.0)
    outputs, slopes = (part.equations for part in ChamberForces.parts)
    rows: list[tuple[str, float]] = []

    def kernel(xp, inputs, *parts):
        shared = ChamberForces.shared(xp, p, inputs, None)
        for part in parts:
            part(xp, p, inputs, None, shared)

    by_math = cost(lambda: kernel(engines.MATH, u, outputs))
    rows.append(("kernel, all outputs but slopes, math, one point", by_math))
    rows.append(
        ("kernel, all outputs, math, one point", cost(lambda: kernel(engines.MATH, u, outputs, slopes)))
    )
    rows.append(("kernel, all outputs, printed Python, one point", cost(printed_outputs())))
    xp = engines.numpy_()
    scalar = ChamberForces.Inputs(phi=np.float64(0.5), w=np.float64(6.0), a=np.float64(1.0))
    rows.append(
        ("kernel, all outputs but slopes, numpy, one point", cost(lambda: kernel(xp, scalar, outputs), 200))
    )
    n = 10_000
    many = ChamberForces.Inputs(phi=np.linspace(0.0, 6.0, n), w=6.0, a=1.0)
    rows.append(
        (
            "kernel, all outputs but slopes, numpy, per point of 10,000",
            cost(lambda: kernel(xp, many, outputs), 5) / n,
        )
    )
    rows.append(
        (
            "kernel, all outputs, numpy, per point of 10,000",
            cost(lambda: kernel(xp, many, outputs, slopes), 5) / n,
        )
    )
    motor, layout = DcMotor.Parameters(), DcMotor.state_layout
    x, at = layout.values(DcMotor.initial_states(engines.MATH, motor)), DcMotor.Inputs(w_ref=100.0)
    rows.append(
        (
            "motor, step of 1 ms (4 internal), math",
            cost(
                lambda: rk4(
                    lambda _, y: DcMotor.derivatives(engines.MATH, motor, at, layout.instance(y)),
                    x, 1e-3, DcMotor.internal_step(engines.MATH, motor),
                )
            ),
        )
    )  # fmt: skip

    with tempfile.TemporaryDirectory() as folder:
        for backend in ("python", "native"):
            file = Path(folder) / f"{backend}.fmu"
            export(ChamberForces, file, backend=backend)
            sizes[backend] = file.stat().st_size
            print(f"{backend} FMU of ChamberForces: {sizes[backend] / 1000:.0f} kB")
            fmu = Fmu(file)
            unit = Instance(fmu, "unit")
            unit.initialize({}, 0.0)
            unit.finish_initialization()
            inputs = unit.handle(["phi", "w", "a"])
            port = unit.handle(["tau_bias", "J", "dJ_dphi", "tau_bias_dphi", "tau_bias_dw"])
            everything = unit.handle(fmu.outputs())
            without = unit.handle([n for n in fmu.outputs() if n not in ("tau_bias_dphi", "tau_bias_dw")])
            state = [0.0]

            def step(handle, unit=unit, inputs=inputs, state=state):
                unit.write(inputs, (state[0], 6.0, 1.0))
                unit.step(state[0], 1e-3)
                state[0] += 1e-3
                if handle:
                    unit.read(handle)

            def measure(what, call, backend=backend):
                rows.append((f"{backend} FMU through fmpy, {what}", cost(call)))

            measure("an empty step", lambda unit=unit: unit.step(0.0, 0.0))
            measure("set three inputs + step", lambda step=step: step(None))
            measure("set + step + get all but slopes", lambda step=step, h=without: step(h))
            measure("set + step + get the load port", lambda step=step, h=port: step(h))
            measure("set + step + get all outputs", lambda step=step, h=everything: step(h))
            unit.close()
            fmu.close()

        empty = Path(folder) / "empty.fmu"
        native.export(Empty, empty)
        fmu = Fmu(empty)
        unit = Instance(fmu, "unit")
        unit.initialize({}, 0.0)
        unit.finish_initialization()
        into, outof = unit.handle(["u"]), unit.handle(["y"])

        time = [0.0]

        def step_empty():
            unit.write(into, (1.0,))
            unit.step(time[0], 1e-3)
            time[0] += 1e-3
            unit.read(outof)

        rows.append(("an empty native FMU through fmpy, set + step + get", cost(step_empty)))
        unit.close()
        fmu.close()
        rows += from_c(Path(folder))
        own = own_functions(Path(folder))

    table = Table(title="Cost of a step", title_justify="left")
    table.add_column("what")
    table.add_column("us", justify="right")
    table.add_column("to the math kernel", justify="right")
    for what, time in rows:
        table.add_row(what, f"{time:.3g}", f"{time / by_math:.3g}")
    Console(width=110).print(table)
    save(options.json, {"us": dict(rows), "size": sizes, "own": own})


if __name__ == "__main__":
    main()
