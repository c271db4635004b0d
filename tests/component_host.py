"""A host of FMUs for WebAssembly: wasmtime, with the component that an FMU has by the draft FMI-LS-WASM."""

from __future__ import annotations

import zipfile
from xml.etree import ElementTree

from wasmtime import Engine, Store
from wasmtime.component import Component, Linker, Variant

PACKAGE = "fmi:fmi3/{}@3.0.0"
FOLDER = "binaries/wasm32-wasip2"


class FailedError(RuntimeError):
    """A call whose status is not ok."""


class Fmu:
    """The component of an FMU in wasmtime; `messages` are those that it gave: instance, status, category, text."""

    def __init__(self, file, most=None):
        """`most`: bytes of memory that it may have at most."""
        with zipfile.ZipFile(file) as archive:
            self.description = ElementTree.fromstring(archive.read("modelDescription.xml"))
            identifier = self.description.find("CoSimulation").get("modelIdentifier")
            content = archive.read(f"{FOLDER}/{identifier}.wasm")
        engine = Engine()
        self.component = Component(engine, content)
        self.imports = self.component.type.imports(engine)
        self.exports = self.component.type.exports(engine)
        self.store, self.messages = Store(engine), []
        if most:
            self.store.set_limits(memory_size=most)
        linker = Linker(engine)
        with linker.root() as root, root.add_instance(PACKAGE.format("callbacks")) as callbacks:
            callbacks.add_func("log-message", lambda store, *words: self.messages.append(words))
        self.instance = linker.instantiate(self.store, self.component)
        self.references = {
            v.get("name"): int(v.get("valueReference")) for v in self.description.find("ModelVariables")
        }

    def function(self, interface, name):
        """An exported function."""
        index = self.instance.get_export_index(self.store, PACKAGE.format(interface))
        index = self.instance.get_export_index(self.store, name, index)
        function = self.instance.get_func(self.store, index)

        def call(*arguments):
            result = function(self.store, *arguments)
            function.post_return(self.store)
            return result

        return call

    def made(self, interface, *more, name="one", token=None):
        """A new instance; None where the FMU makes none."""
        token = token or self.description.get("instantiationToken")
        make = self.function(interface, f"[static]{interface}-instance.instantiate-{interface}")
        handle = make(name, token, "", False, False, *more)
        return Made(self, interface, handle) if handle else None


class Made:
    """An instance in a component: each function of its interface is one of it, with _ for -."""

    def __init__(self, fmu, interface, handle):
        self.fmu, self.interface, self.handle, self.known = fmu, interface, handle, {}

    def __getattr__(self, name):
        if name not in self.known:
            of_fmu = f"[method]{self.interface}-instance.{name.replace('_', '-')}"
            self.known[name] = self.fmu.function(self.interface, of_fmu)

        def call(*arguments):
            result = self.known[name](self.handle, *arguments)
            if isinstance(result, Variant):
                if result.tag == "err":
                    raise FailedError(name, result.payload)
                return result.payload
            if isinstance(result, str) and result != "ok":
                raise FailedError(name, result)
            return None if result == "ok" else result

        return call

    def set(self, **values):
        """Set variables of any number, by name."""
        for name, value in values.items():
            self.set_float64([self.fmu.references[name]], [float(value)])

    def get(self, *names):
        """Values by name."""
        return self.get_float64([self.fmu.references[name] for name in names])

    def drop(self):
        """End the instance."""
        self.handle.drop(self.fmu.store)
