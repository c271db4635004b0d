"""Every function of FMI 2.0 and 3.0 in every state, for Model Exchange and Co-Simulation, against `fmi_tables`."""

from __future__ import annotations

import ctypes
import re
from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path

import fmpy
import pytest
from fmi_tables import MORE, NO_VALUE_YET, TABLES, read
from systems import whole_systems

from chainunit.core.native.compilers import compiler
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import read_linkage
from chainunit.models import MODELS
from chainunit.system import export_compiled

GALLERY = sorted((Path(__file__).parents[1] / "examples" / "linkages").glob("*.toml"))
_, SYSTEMS = whole_systems()
HEADERS = Path(fmpy.__file__).parent / "c-code"
OK, DISCARD, ERROR = 0, 2, 3
STATUS = {"x": OK, "+": OK, "-": ERROR, "d": DISCARD}
KINDS = [(2, "exchange"), (2, "steps"), (3, "exchange"), (3, "steps")]


class Types:
    """The types of variables in FMI 3.0 beside Float64, and the arguments of a call for none of them."""

    plain = ("Float32", *(f"{u}Int{n}" for u in ("", "U") for n in (8, 16, 32, 64)), "Boolean", "String")


class Unit:
    """One instance of a native FMU in a state of the standard. `call` calls a row of a table and gives the status."""

    def __init__(self, library, description, fmi, kind):
        self.fmi, self.messages = fmi, []
        self.exchange = kind == "exchange"
        self.library, self.prefix = library, f"fmi{fmi}"
        logger = {
            2: ctypes.CFUNCTYPE(None, c_void_p, ctypes.c_char_p, c_int, ctypes.c_char_p, ctypes.c_char_p),
            3: ctypes.CFUNCTYPE(None, c_void_p, c_int, ctypes.c_char_p, ctypes.c_char_p),
        }[fmi]
        self._logger = logger(lambda *given: self.messages.append(given[-1].decode()))
        token = (description.guid or description.instantiationToken).encode()
        make = f"fmi{fmi}Instantiate"
        if fmi == 2:
            # logger, allocate, free, step finished, environment
            self._callbacks = (c_void_p * 5)(ctypes.cast(self._logger, c_void_p))
            given = [b"unit", 0 if self.exchange else 1, token, None, self._callbacks, 0, 1]
        elif self.exchange:
            make += "ModelExchange"
            given = [b"unit", token, None, False, True, None, self._logger]
        else:
            make += "CoSimulation"
            given = [
                b"unit",
                token,
                None,
                False,
                True,
                False,
                False,
                None,
                c_size_t(0),
                None,
                self._logger,
                None,
            ]
        function = getattr(library, make)
        function.restype = c_void_p
        self.component = c_void_p(function(*given))
        assert self.component, self.messages
        self.saved = c_void_p()
        self._sort(description)

    def _sort(self, description):
        """One variable of each type and kind, by the words of the tables; a model may lack some."""
        self.variables = {}
        states = {v.derivative.valueReference for v in description.modelVariables if v.derivative}
        self.n_x = len(states)
        for v in description.modelVariables:
            if v.causality == "parameter":
                kinds = ["parameter", f"{v.variability} parameter"]
            elif v.causality == "input":
                kinds = ["input"]
            elif v.causality == "output":
                kinds = ["state" if v.valueReference in states else "output"]
            else:
                kinds = ["time" if v.causality == "independent" else "derivative"]
            for kind in kinds:
                self.variables.setdefault((v.type, kind), v)
        self.bounded = next(
            (v for v in description.modelVariables if v.causality == "input" and v.min is not None), None
        )
        self.number = "Real" if self.fmi == 2 else "Float64"
        self.budget = next((v for v in description.modelVariables if v.name == "solver.max_steps"), None)

    def status(self, name, *given):
        """Call the function of this name without its prefix."""
        return getattr(self.library, f"{self.prefix}{name}")(self.component, *given)

    def free(self):
        """Free the saved state and the instance."""
        free = "FreeFMUstate" if self.fmi == 2 else "FreeFMUState"
        self.status(free, byref(self.saved))
        self.status("FreeInstance")

    # -- the ways into the states

    def enter(self, state):
        """Bring a new instance into a state; False where the model has no such state."""
        if state == "instantiated":
            return True
        if state == "failed":
            # so that a long step fails, and a short one does not
            if self.budget:
                assert not self._set(self.budget, 1)
            elif self.bounded:
                low, high = float(self.bounded.min), float(self.bounded.max or "inf")
                assert not self._set(self.bounded, min(low + 10.0, 0.5 * (low + high)))
        assert not self._initialize()
        if state == "initialization":
            return True
        assert not self.status("ExitInitializationMode")
        if state == "event" or (state == "step" and not self.exchange):
            return True
        if state == "failed":
            return self._fail()
        if self.exchange:
            update = self.call("NewDiscreteStates" if self.fmi == 2 else "UpdateDiscreteStates")
            assert not update and not self.status("EnterContinuousTimeMode")
        if state == "terminated":
            assert not self.status("Terminate")
        if state == "error":
            self.err()
        return True

    def err(self):
        """An error that is possible in any state: a value that is no number."""
        assert self._set(self.variables[self.number, "input"], float("nan")) == ERROR

    def _initialize(self):
        if self.fmi == 3:
            return self.status(
                "EnterInitializationMode", False, c_double(0.0), c_double(0.0), False, c_double(0.0)
            )
        return self.status(
            "SetupExperiment", 0, c_double(0.0), c_double(0.0), 0, c_double(0.0)
        ) or self.status("EnterInitializationMode")

    def _fail(self):
        if self.budget is None:
            if self.fmi == 3 or self.bounded is None:
                return False
            falling = (c_uint(self.bounded.valueReference),), (c_int(1),), (c_double(-1.0),)
            arrays = [(type(x[0]) * 1)(*x) for x in falling]
            assert not self.status("SetRealInputDerivatives", arrays[0], c_size_t(1), arrays[1], arrays[2])
        assert self._step(1e4) == DISCARD
        return True

    # -- the calls

    def _value(self, verb, v, value=0):
        """Get or set a variable by the function of its type."""
        counted = () if self.fmi == 2 else (c_size_t(1),)
        room = (c_double if v.type == self.number else c_int)(value)
        return self.status(verb + v.type, byref(c_uint(v.valueReference)), c_size_t(1), byref(room), *counted)

    def _set(self, v, value):
        return self._value("Set", v, value)

    def _step(self, size):
        if self.fmi == 2:
            return self.status("DoStep", c_double(0.0), c_double(size), 1)
        flags, last = [ctypes.c_bool() for _ in range(3)], c_double()
        return self.status("DoStep", c_double(0.0), c_double(size), True, *map(byref, flags), byref(last))

    def call(self, row):
        """The status of the call of a row, with arguments that are right."""
        name, _, what = row.partition(" ")
        if (v := self.variables.get((name[3:], what))) is not None:
            start = {"true": 1, "false": 0}.get(v.start, v.start) or 0
            return self._value(name[:3], v, float(start) if v.type == self.number else int(start))
        return getattr(self, "_" + name.replace("*", ""), lambda: self._plain(name, what))()

    def _plain(self, name, what):
        if what == "none":  # of FMI 2.0
            return self.status(name, None, c_size_t(0), None)
        return self.status(name, *self._arguments(name))

    def _arguments(self, name):
        """The arguments behind the instance."""
        states, n = (c_double * max(self.n_x, 1))(*[0.1] * self.n_x), c_size_t(self.n_x)
        flags, number, none = [c_int() for _ in range(6)], c_double(), c_size_t(0)
        status = "Status" in name and name.startswith("Get")
        if status:
            # LastSuccessfulTime, Terminated; else DoStepStatus, PendingStatus
            asked = {"GetRealStatus": 2, "GetBooleanStatus": 3, "GetStatus": 0, "GetStringStatus": 1}
            return asked.get(name, 0), byref(c_void_p())
        if name in ("SetContinuousStates", "GetContinuousStates", "GetDerivatives",
                    "GetContinuousStateDerivatives", "GetNominalsOfContinuousStates"):  # fmt: skip
            if name == "SetContinuousStates":
                states = (c_double * max(self.n_x, 1))(*self._states())
            return states, n
        one, output = (
            byref(c_uint(self.variables[self.number, kind].valueReference)) for kind in ("input", "output")
        )
        order, value = byref(c_int(1)), byref(c_double(0.0))
        counted = () if self.fmi == 2 else (c_size_t(1),)
        return {
            "SetDebugLogging": (1, none, None),
            "SetupExperiment": (0, number, number, 0, number),
            "GetEventIndicators": (None, none),
            "SetTime": (number,),
            "NewDiscreteStates": (byref((c_double * 8)()),),
            "UpdateDiscreteStates": (*map(byref, flags[:5]), byref(number)),
            "CompletedIntegratorStep": (1, byref(flags[0]), byref(flags[1])),
            "GetNumberOfEventIndicators": (byref(none),),
            "GetNumberOfContinuousStates": (byref(none),),
            "GetDirectionalDerivative": (
                output, c_size_t(1), one, c_size_t(1), value, *counted, byref(number), *counted,
            ),
            "GetAdjointDerivative": (
                output, c_size_t(1), one, c_size_t(1), value, *counted, byref(number), *counted,
            ),
            "SetRealInputDerivatives": (one, c_size_t(1), order, value),
            "GetRealOutputDerivatives": (output, c_size_t(1), order, byref(number)),
            "GetOutputDerivatives": (output, c_size_t(1), order, byref(number), c_size_t(1)),
            "GetNumberOfVariableDependencies": (0, byref(none)),
            "GetVariableDependencies": (0, None, None, None, None, none),
            "ActivateModelPartition": (0, number),
        }.get(name, ())  # fmt: skip

    def _states(self):
        """The present states, or zeros where they cannot be read."""
        x = (c_double * max(self.n_x, 1))()
        self.status("GetContinuousStates", x, c_size_t(self.n_x))
        return x

    def _GetTypesPlatform(self):
        return self._text("GetTypesPlatform", b"default")

    def _GetVersion(self):
        return self._text("GetVersion", b"2.0" if self.fmi == 2 else b"3.0")

    def _text(self, name, wanted):
        function = getattr(self.library, self.prefix + name)
        function.restype = ctypes.c_char_p
        return OK if function() == wanted else ERROR

    def _EnterInitializationMode(self):
        return self.status("EnterInitializationMode") if self.fmi == 2 else self._initialize()

    def _DoStep(self):
        return self._step(1e-6)

    def _Get(self):
        return self._types("Get")

    def _Set(self):
        return self._types("Set")

    def _types(self, verb):
        """All types of variables but Float64: the worst status."""
        none = c_size_t(0)
        found = [self.status(verb + name, None, none, None, none) for name in Types.plain]
        return max(*found, self.status(f"{verb}Binary", None, none, None, None, none))

    def _GetClock(self):
        return self.status("GetClock", None, c_size_t(0), None)

    def _SetClock(self):
        return self.status("SetClock", None, c_size_t(0), None)

    def _of_clocks(self, name, n_arguments):
        nothing = [None] * n_arguments
        return max(
            self.status(f"{name}Decimal", None, c_size_t(0), *nothing),
            self.status(f"{name}Fraction", None, c_size_t(0), None, *nothing),
        )

    def _GetInterval(self):
        return self._of_clocks("GetInterval", 2)

    def _SetInterval(self):
        return self._of_clocks("SetInterval", 1)

    def _GetShift(self):
        return self._of_clocks("GetShift", 1)

    def _SetShift(self):
        return self._of_clocks("SetShift", 1)

    # saved states; a state that the call needs is taken before it

    def _state(self, name):
        return self.status(name + ("state" if self.fmi == 2 else "State"), *([byref(self.saved)]))

    def _GetFMUstate(self):
        return self._state("GetFMU")

    def _FreeFMUstate(self):
        return self._state("GetFMU") or self._state("FreeFMU")

    def _SetFMUstate(self):
        name = "SetFMUstate" if self.fmi == 2 else "SetFMUState"
        return self._GetFMUstate() or self.status(name, self.saved)

    def _size(self):
        size = c_size_t()
        name = "SerializedFMUstateSize" if self.fmi == 2 else "SerializedFMUStateSize"
        return self._GetFMUstate() or self.status(name, self.saved, byref(size)), size

    def _SerializedFMUstateSize(self):
        return self._size()[0]

    def _serialized(self):
        status, size = self._size()
        raw = ctypes.create_string_buffer(size.value)
        name = "SerializeFMUstate" if self.fmi == 2 else "SerializeFMUState"
        return status or self.status(name, self.saved, raw, size), raw, size

    def _SerializeFMUstate(self):
        return self._serialized()[0]

    def _DeSerializeFMUstate(self):
        status, raw, size = self._serialized()
        name = "DeSerializeFMUstate" if self.fmi == 2 else "DeserializeFMUState"
        return status or self.status(name, raw, size, byref(self.saved))

    _GetFMUState, _SetFMUState, _FreeFMUState = _GetFMUstate, _SetFMUstate, _FreeFMUstate
    _SerializedFMUStateSize, _SerializeFMUState = _SerializedFMUstateSize, _SerializeFMUstate
    _DeserializeFMUState = _DeSerializeFMUstate


def wrong_cells(folder, fmi, kind):
    """The cells of the table of this version and kind in which the unpacked FMU differs, and the number of calls."""
    description = fmpy.read_model_description(str(folder))
    interface = description.modelExchange if kind == "exchange" else description.coSimulation
    (file,) = Path(folder, "binaries").glob(f"*/{interface.modelIdentifier}.*")
    library = ctypes.CDLL(str(file))
    wrong, calls = [], 0

    def attempt(row, state, wanted, before=None):
        nonlocal calls
        unit = Unit(library, description, fmi, kind)
        what = row.partition(" ")[2]
        try:
            lacks = what not in ("", "none") and (row[3:].partition(" ")[0], what) not in unit.variables
            if lacks or not unit.enter(before or state):
                return
            if before:
                unit.err()
            heard = len(unit.messages)
            status = unit.call(row)
            calls += 1
            told = len(unit.messages) > heard
            if status != wanted or told != (wanted != OK):
                wrong.append((row, state, before, status, unit.messages[heard:]))
        finally:
            unit.free()

    table = read(TABLES[fmi, kind])
    for (row, state), sign in table.items():
        attempt(row, state, STATUS[sign])
        if state == "error" and sign == "x":
            # an error may also come before the run
            for before, rows in NO_VALUE_YET.items():
                attempt(row, state, ERROR if row in rows else OK, before)
    return wrong, calls


pytestmark = [pytest.mark.second, pytest.mark.skipif(compiler() is None, reason="no C compiler")]


@pytest.mark.parametrize(("fmi", "kind"), KINDS)
@pytest.mark.parametrize("name", list(MODELS))
def test_every_function_in_every_state(native_fmus, name, fmi, kind):
    wrong, calls = wrong_cells(native_fmus[name, fmi][1], fmi, kind)
    assert wrong == [] and calls > 200


def every_table(folder, write):
    """Check all tables of the FMU that ``write(file, fmi)`` writes in both versions."""
    for fmi in (2, 3):
        file = folder / f"{fmi}.fmu"
        write(file, fmi)
        fmpy.extract(str(file), unzipdir=str(file.with_suffix("")))
        for kind in ("exchange", "steps"):
            wrong, calls = wrong_cells(file.with_suffix(""), fmi, kind)
            assert wrong == [] and calls > 200


@pytest.mark.slow
@pytest.mark.parametrize("direct", [False, True], ids=["inverse", "direct"])
@pytest.mark.parametrize("file", GALLERY, ids=lambda file: file.stem)
def test_every_function_in_every_state_of_a_linkage(tmp_path, file, direct):
    model = read_linkage(file).direct() if direct else read_linkage(file)
    every_table(tmp_path, lambda file, fmi: export(model, file, fmi=fmi))


@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_every_function_in_every_state_of_a_whole_system(tmp_path, name):
    every_table(tmp_path, lambda file, fmi: export_compiled(SYSTEMS[name], file, backend="native", fmi=fmi))


def test_an_instance_of_no_kind_that_the_fmu_has_is_refused(native_fmus):
    """Scheduled execution, and events in co-simulation; by the standard the FMU tells why."""
    folder = native_fmus["DcMotor", 3][1]
    description = fmpy.read_model_description(folder)
    (file,) = Path(folder, "binaries").glob("*/DcMotor.*")
    library, token, told = ctypes.CDLL(str(file)), description.instantiationToken.encode(), []
    message = ctypes.CFUNCTYPE(None, c_void_p, c_int, ctypes.c_char_p, ctypes.c_char_p)
    logger = message(lambda *given: told.append(given[-1].decode()))
    for make, arguments in (
        (library.fmi3InstantiateScheduledExecution, [None, logger, None, None, None]),
        (library.fmi3InstantiateCoSimulation, [True, False, None, c_size_t(0), None, logger, None]),
    ):
        make.restype = c_void_p
        assert make(b"unit", token, None, False, True, *arguments) is None
    assert told == [
        "scheduled execution is not supported",
        "eventModeUsed must be false: there is no event mode in co-simulation",
    ]


def test_the_tables_have_every_function_of_the_headers():
    for fmi in (2, 3):
        text = (HEADERS / f"fmi{fmi}Functions.h").read_text()
        functions = set(re.findall(rf"fmi{fmi}FullName\(fmi{fmi}(\w+)\)", text))
        # they make and end an instance
        functions -= {name for name in functions if name.startswith("Instantiate")} | {"FreeInstance"}
        every = {f"{verb}{name}" for verb in ("Get", "Set") for name in (*Types.plain, "Binary")}
        groups = {"Get*": {x for x in every if x[0] == "G"}, "Set*": {x for x in every if x[0] == "S"}} | {
            f"{name}*": {f"{name}Decimal", f"{name}Fraction"}
            for name in ("GetInterval", "SetInterval", "GetShift", "SetShift")
        }
        for kind in ("exchange", "steps"):
            cells = read(TABLES[fmi, kind])
            names = {row.partition(" ")[0] for row, _ in cells}
            assert functions == set().union(*(groups.get(name, {name}) for name in names))
            assert {state for (_, state), sign in cells.items() if sign == "+"} <= set(MORE)
