"""CuPy without a GPU: its arrays are those of numpy, and its kernels come from a C++ compiler, with threads of
a device as in cuda_threads.h. As those of CuPy, an array becomes one of numpy by `get` alone."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import ClassVar

import numpy as np

from chainunit.core.files import scratch

THREADS = Path(__file__).with_name("cuda_threads.h")
COMPILER = next((path for name in ("c++", "g++", "clang++") if (path := shutil.which(name))), None)


class DeviceArray(np.lib.mixins.NDArrayOperatorsMixin):
    """An array of the device."""

    def __init__(self, array):
        self.on_device = array

    dtype, shape, ndim, size, itemsize = (
        property(lambda self, name=name: getattr(self.on_device, name))
        for name in ("dtype", "shape", "ndim", "size", "itemsize")
    )

    @property
    def flags(self):
        return SimpleNamespace(c_contiguous=self.on_device.flags.c_contiguous)

    @property
    def data(self):
        return SimpleNamespace(ptr=self.on_device.ctypes.data)

    @property
    def __cuda_array_interface__(self):
        return self.on_device.__array_interface__

    def get(self):
        return self.on_device.copy()

    def __array__(self, *_, **__):
        raise TypeError("Implicit conversion to a NumPy array is not allowed. Please use `.get()`")

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        if any(isinstance(x, np.ndarray) and x.ndim for x in inputs):
            raise TypeError("Unsupported type <class 'numpy.ndarray'>")
        return wrapped(getattr(ufunc, method)(*map(plain, inputs), **options))

    def __array_function__(self, function, types, arguments, options):
        return wrapped(function(*map(plain, arguments), **{k: plain(x) for k, x in options.items()}))

    def __len__(self):
        return len(self.on_device)

    def __iter__(self):
        return map(DeviceArray, self.on_device)

    def __getitem__(self, key):
        return DeviceArray(self.on_device[plain(key)])

    def __setitem__(self, key, value):
        self.on_device[plain(key)] = plain(value)

    def __bool__(self):
        return bool(self.on_device)

    def __getattr__(self, name):
        if name.startswith("_") or name not in (
            "reshape",
            "astype",
            "copy",
            "min",
            "max",
            "any",
            "transpose",
        ):
            raise AttributeError(name)
        method = getattr(self.on_device, name)
        return lambda *arguments, **options: wrapped(method(*arguments, **options))


def plain(x):
    """What numpy has below an array, or below those of a tuple."""
    if isinstance(x, tuple | list):
        return type(x)(map(plain, x))
    return x.on_device if isinstance(x, DeviceArray) else x


def wrapped(x):
    return DeviceArray(np.asarray(x)) if isinstance(x, np.ndarray | np.generic) else x


class RawModule:
    """The kernels of a source."""

    def __init__(self, code, options):
        heads = re.findall(r"__global__ void(?: __launch_bounds__\([^)]*\))? (\w+)\(([^)]*)\)", code)
        self.sources.append(code)
        self._parameters = {name: len(texts.split(",")) for name, texts in _active(code, heads)}
        doors = "".join(
            f'extern "C" void launch_{name}(unsigned grid, unsigned block{"".join(f", {t}" for t in types)}) '
            f"{{ launch(grid, block, [=] {{ {name}({', '.join(names)}); }}); }}\n"
            for name, types, names in _doors(_active(code, heads))
        )
        with scratch() as folder:
            (folder / "kernels.cpp").write_text(f'#include "{THREADS}"\n{code}\n{doors}')
            command = [
                COMPILER,
                "-std=c++17",
                "-O1",
                "-w",
                "-fPIC",
                "-shared",
                "kernels.cpp",
                "-o",
                "kernels.so",
            ]
            subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
            self._library = ctypes.CDLL(str(folder / "kernels.so"))

    sources: ClassVar[list[str]] = []

    def get_function(self, name):
        if name not in self._parameters:
            raise KeyError(name)

        def call(grid, block, arguments):
            assert len(arguments) == self._parameters[name]
            getattr(self._library, f"launch_{name}")(
                *(ctypes.c_uint(n) for (n,) in (grid, block)),
                *(
                    ctypes.c_void_p(x.data.ptr) if isinstance(x, DeviceArray) else ctypes.c_longlong(int(x))
                    for x in arguments
                ),
            )

        return call


def _active(code, heads):
    """The kernels that the source has."""
    reduced = "#define REDUCED 1" in code
    return [(name, texts) for name, texts in heads if name == "rows" or (name == "stored") != reduced]


def _doors(kernels):
    for name, texts in kernels:
        parameters = [" ".join(text.split()) for text in texts.split(",")]
        names = [re.search(r"(\w+)$", text)[1] for text in parameters]
        yield name, parameters, names


def cupy(devices=1):
    """The module."""
    module = ModuleType("cupy")
    module.ndarray = DeviceArray
    module.RawModule = RawModule
    module.empty = lambda shape, dtype=float: DeviceArray(np.full(shape, 77, dtype))
    module.zeros = lambda shape, dtype=float: DeviceArray(np.zeros(shape, dtype))
    module.asarray = lambda x, dtype=None: DeviceArray(np.asarray(plain(x), dtype))
    module.ascontiguousarray = lambda x, dtype=None: DeviceArray(np.ascontiguousarray(plain(x), dtype))
    module.concatenate = lambda arrays: DeviceArray(np.concatenate(plain(list(arrays))))
    error = type("CUDARuntimeError", (RuntimeError,), {})

    def count():
        if not devices:
            raise error("cudaErrorNoDevice")
        return devices

    runtime = SimpleNamespace(getDeviceCount=count, CUDARuntimeError=error)
    compiler = SimpleNamespace(CompileException=type("CompileException", (Exception,), {}))
    module.cuda = SimpleNamespace(runtime=runtime, compiler=compiler)
    return module
