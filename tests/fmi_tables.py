"""Which function may be called in which state: the tables of FMI 2.0.4 (sections 3.2.3 and 4.2.4) and of FMI 3.0 (the
lists "Allowed Function Calls" of sections 2.3, 3.2 and 4.2), and how the native FMUs of this package go beyond them.

A row is a function, or a function with a kind of variable, and a sign for each state:

    x   allowed by the standard: the FMU returns OK
    -   not allowed: the FMU returns an error, and stays as it is
    +   not allowed, but the FMU returns OK, for the reason in `MORE`
    d   the FMU has nothing to tell: it returns Discard

`failed` is a co-simulation step that was discarded (`stepFailed` of FMI 2.0), `error` is any error in the state
`continuous` or `step`. FMI 3.0 has no such states: a discarded step leaves the FMU in Step Mode, an error takes it to
`terminated`. The states `stepInProgress` and `stepCanceled` do not occur, as no step is asynchronous.
"""

EXCHANGE_2 = """
                                       instantiated initialization event continuous terminated error
GetTypesPlatform                             x            x          x       x          x        x
GetVersion                                   x            x          x       x          x        x
SetDebugLogging                              x            x          x       x          x        x
SetupExperiment                              x            -          -       -          -        -
EnterInitializationMode                      x            -          -       -          -        -
ExitInitializationMode                       -            x          -       -          -        -
Terminate                                    -            -          x       x          -        +
Reset                                        x            x          x       x          x        x
GetReal output                               -            x          x       x          x        x
GetReal derivative                           -            x          x       x          x        x
GetReal input                                +            +          x       x          x        x
GetReal parameter                            +            +          x       x          x        x
GetInteger output                            -            x          x       x          x        x
GetInteger parameter                         +            +          x       x          x        x
GetBoolean parameter                         +            +          x       x          x        x
GetInteger none                              +            x          x       x          x        x
GetBoolean none                              +            x          x       x          x        x
GetString none                               +            x          x       x          x        x
SetReal fixed parameter                      x            x          -       -          -        -
SetReal tunable parameter                    x            x          x       +          -        +
SetReal input                                +            x          x       x          -        +
SetReal state                                -            -          -       x          -        +
SetReal output                               -            -          -       -          -        -
SetInteger fixed parameter                   x            x          -       -          -        -
SetInteger output                            -            -          -       -          -        -
SetBoolean fixed parameter                   x            x          -       -          -        -
SetInteger none                              x            x          x       +          +        +
SetBoolean none                              x            x          x       +          +        +
SetString none                               x            x          x       +          +        +
GetFMUstate                                  x            x          x       x          x        x
SetFMUstate                                  x            x          x       x          x        x
FreeFMUstate                                 x            x          x       x          x        x
SerializedFMUstateSize                       x            x          x       x          x        x
SerializeFMUstate                            x            x          x       x          x        x
DeSerializeFMUstate                          x            x          x       x          x        x
GetDirectionalDerivative                     -            x          x       x          x        x
EnterEventMode                               -            -          x       x          -        +
NewDiscreteStates                            -            -          x       -          -        -
EnterContinuousTimeMode                      -            -          x       -          -        -
CompletedIntegratorStep                      -            -          -       x          -        +
SetTime                                      -            -          +       x          -        +
SetContinuousStates                          -            -          +       x          -        +
GetEventIndicators                           -            x          x       x          x        x
GetContinuousStates                          -            x          x       x          x        x
GetDerivatives                               -            x          x       x          x        x
GetNominalsOfContinuousStates                x            x          x       x          x        x
SetRealInputDerivatives                      -            -          -       -          -        -
GetRealOutputDerivatives                     -            -          -       -          -        -
DoStep                                       -            -          -       -          -        -
CancelStep                                   -            -          -       -          -        -
GetStatus                                    -            -          -       -          -        -
GetRealStatus                                -            -          -       -          -        -
GetIntegerStatus                             -            -          -       -          -        -
GetBooleanStatus                             -            -          -       -          -        -
GetStringStatus                              -            -          -       -          -        -
"""

STEPS_2 = """
                                       instantiated initialization step failed terminated error
GetTypesPlatform                             x            x         x     x        x        x
GetVersion                                   x            x         x     x        x        x
SetDebugLogging                              x            x         x     x        x        x
SetupExperiment                              x            -         -     -        -        -
EnterInitializationMode                      x            -         -     -        -        -
ExitInitializationMode                       -            x         -     -        -        -
Terminate                                    -            -         x     x        -        +
Reset                                        x            x         x     x        x        x
GetReal output                               -            x         x     x        x        x
GetReal derivative                           -            x         x     x        x        x
GetReal input                                +            +         x     x        x        x
GetReal parameter                            +            +         x     x        x        x
GetInteger output                            -            x         x     x        x        x
GetInteger parameter                         +            +         x     x        x        x
GetBoolean parameter                         +            +         x     x        x        x
GetInteger none                              +            x         x     x        x        x
GetBoolean none                              +            x         x     x        x        x
GetString none                               +            x         x     x        x        x
SetReal fixed parameter                      x            x         -     -        -        -
SetReal tunable parameter                    x            x         x     +        -        +
SetReal input                                +            x         x     +        -        +
SetReal state                                -            -         -     -        -        -
SetReal output                               -            -         -     -        -        -
SetInteger fixed parameter                   x            x         -     -        -        -
SetInteger output                            -            -         -     -        -        -
SetBoolean fixed parameter                   x            x         -     -        -        -
SetInteger none                              x            x         x     +        +        +
SetBoolean none                              x            x         x     +        +        +
SetString none                               x            x         x     +        +        +
GetFMUstate                                  x            x         x     x        x        x
SetFMUstate                                  x            x         x     x        x        x
FreeFMUstate                                 x            x         x     x        x        x
SerializedFMUstateSize                       x            x         x     x        x        x
SerializeFMUstate                            x            x         x     x        x        x
DeSerializeFMUstate                          x            x         x     x        x        x
GetDirectionalDerivative                     -            x         x     x        x        x
EnterEventMode                               -            -         -     -        -        -
NewDiscreteStates                            -            -         -     -        -        -
EnterContinuousTimeMode                      -            -         -     -        -        -
CompletedIntegratorStep                      -            -         -     -        -        -
SetTime                                      -            -         -     -        -        -
SetContinuousStates                          -            -         -     -        -        -
GetEventIndicators                           -            -         -     -        -        -
GetContinuousStates                          -            -         -     -        -        -
GetDerivatives                               -            -         -     -        -        -
GetNominalsOfContinuousStates                -            -         -     -        -        -
SetRealInputDerivatives                      x            x         x     +        -        +
GetRealOutputDerivatives                     -            -         x     x        x        x
DoStep                                       -            -         x     +        -        +
CancelStep                                   -            -         -     -        -        -
GetStatus                                    -            -         d     d        d        d
GetRealStatus                                -            -         x     x        x        +
GetIntegerStatus                             -            -         d     d        d        d
GetBooleanStatus                             -            -         x     x        x        +
GetStringStatus                              -            -         d     d        d        d
"""

EXCHANGE_3 = """
                                       instantiated initialization event continuous terminated error
GetVersion                                   x            x          x       x          x        x
SetDebugLogging                              x            x          x       x          x        x
EnterInitializationMode                      x            -          -       -          -        -
ExitInitializationMode                       -            x          -       -          -        -
EnterEventMode                               -            -          +       x          -        +
Terminate                                    -            -          x       x          -        +
Reset                                        x            x          x       x          x        x
GetFloat64 output                            -            x          x       x          x        x
GetFloat64 derivative                        -            x          x       x          x        x
GetFloat64 input                             x            x          x       x          x        x
GetFloat64 parameter                         x            x          x       x          x        x
GetFloat64 time                              +            x          x       x          x        x
GetInt32 output                              -            x          x       x          x        x
GetInt32 parameter                           x            x          x       x          x        x
GetBoolean parameter                         x            x          x       x          x        x
SetFloat64 fixed parameter                   x            x          -       -          -        -
SetFloat64 tunable parameter                 x            x          x       +          -        +
SetFloat64 input                             x            x          x       x          -        +
SetFloat64 state                             -            -          -       x          -        +
SetFloat64 output                            -            -          -       -          -        -
SetInt32 fixed parameter                     x            x          -       -          -        -
SetInt32 output                              -            -          -       -          -        -
SetBoolean fixed parameter                   x            x          -       -          -        -
Get* none                                    x            x          x       x          x        x
Set* none                                    x            x          x       +          +        +
GetClock none                                +            +          x       +          +        +
SetClock none                                +            +          x       +          +        +
GetInterval* none                            +            x          x       +          +        +
SetInterval* none                            +            x          +       +          +        +
GetShift* none                               +            x          +       +          +        +
SetShift* none                               +            x          +       +          +        +
GetNumberOfVariableDependencies              -            -          -       -          -        -
GetVariableDependencies                      -            -          -       -          -        -
GetFMUState                                  x            x          x       x          x        x
SetFMUState                                  x            x          x       x          x        x
FreeFMUState                                 x            x          x       x          x        x
SerializedFMUStateSize                       x            x          x       x          x        x
SerializeFMUState                            x            x          x       x          x        x
DeserializeFMUState                          x            x          x       x          x        x
GetDirectionalDerivative                     -            x          x       x          x        x
GetAdjointDerivative                         -            -          -       -          -        -
EnterConfigurationMode                       -            -          -       -          -        -
ExitConfigurationMode                        -            -          -       -          -        -
EvaluateDiscreteStates                       -            -          x       -          -        -
UpdateDiscreteStates                         -            -          x       -          -        -
EnterContinuousTimeMode                      -            -          x       -          -        -
CompletedIntegratorStep                      -            -          -       x          -        +
SetTime                                      -            -          +       x          -        +
SetContinuousStates                          -            -          +       x          -        +
GetContinuousStateDerivatives                -            x          x       x          x        x
GetEventIndicators                           -            x          x       x          x        x
GetContinuousStates                          -            x          x       x          x        x
GetNominalsOfContinuousStates                +            x          x       x          x        x
GetNumberOfEventIndicators                   x            +          x       +          +        +
GetNumberOfContinuousStates                  x            +          x       +          +        +
EnterStepMode                                -            -          -       -          -        -
GetOutputDerivatives                         -            -          -       -          -        -
DoStep                                       -            -          -       -          -        -
ActivateModelPartition                       -            -          -       -          -        -
"""

STEPS_3 = """
                                       instantiated initialization step failed terminated error
GetVersion                                   x            x         x     x        x        x
SetDebugLogging                              x            x         x     x        x        x
EnterInitializationMode                      x            -         -     -        -        -
ExitInitializationMode                       -            x         -     -        -        -
EnterEventMode                               -            -         -     -        -        -
Terminate                                    -            -         x     x        -        +
Reset                                        x            x         x     x        x        x
GetFloat64 output                            -            x         x     x        x        x
GetFloat64 derivative                        -            x         x     x        x        x
GetFloat64 input                             x            x         x     x        x        x
GetFloat64 parameter                         x            x         x     x        x        x
GetFloat64 time                              +            x         x     x        x        x
GetInt32 output                              -            x         x     x        x        x
GetInt32 parameter                           x            x         x     x        x        x
GetBoolean parameter                         x            x         x     x        x        x
SetFloat64 fixed parameter                   x            x         -     -        -        -
SetFloat64 tunable parameter                 x            x         x     x        -        +
SetFloat64 input                             x            x         x     x        -        +
SetFloat64 state                             -            -         -     -        -        -
SetFloat64 output                            -            -         -     -        -        -
SetInt32 fixed parameter                     x            x         -     -        -        -
SetInt32 output                              -            -         -     -        -        -
SetBoolean fixed parameter                   x            x         -     -        -        -
Get* none                                    x            x         x     x        x        x
Set* none                                    x            x         x     x        +        +
GetClock none                                +            +         +     +        +        +
SetClock none                                +            +         +     +        +        +
GetInterval* none                            +            x         +     +        +        +
SetInterval* none                            +            x         +     +        +        +
GetShift* none                               +            x         +     +        +        +
SetShift* none                               +            x         +     +        +        +
GetNumberOfVariableDependencies              -            -         -     -        -        -
GetVariableDependencies                      -            -         -     -        -        -
GetFMUState                                  x            x         x     x        x        x
SetFMUState                                  x            x         x     x        x        x
FreeFMUState                                 x            x         x     x        x        x
SerializedFMUStateSize                       x            x         x     x        x        x
SerializeFMUState                            x            x         x     x        x        x
DeserializeFMUState                          x            x         x     x        x        x
GetDirectionalDerivative                     -            x         x     x        x        x
GetAdjointDerivative                         -            -         -     -        -        -
EnterConfigurationMode                       -            -         -     -        -        -
ExitConfigurationMode                        -            -         -     -        -        -
EvaluateDiscreteStates                       -            -         -     -        -        -
UpdateDiscreteStates                         -            -         -     -        -        -
EnterContinuousTimeMode                      -            -         -     -        -        -
CompletedIntegratorStep                      -            -         -     -        -        -
SetTime                                      -            -         -     -        -        -
SetContinuousStates                          -            -         -     -        -        -
GetContinuousStateDerivatives                -            -         -     -        -        -
GetEventIndicators                           -            -         -     -        -        -
GetContinuousStates                          -            -         -     -        -        -
GetNominalsOfContinuousStates                -            -         -     -        -        -
GetNumberOfEventIndicators                   -            -         -     -        -        -
GetNumberOfContinuousStates                  -            -         -     -        -        -
EnterStepMode                                -            -         -     -        -        -
GetOutputDerivatives                         -            -         x     x        x        x
DoStep                                       -            -         x     x        -        +
ActivateModelPartition                       -            -         -     -        -        -
"""

TABLES = {
    (2, "exchange"): EXCHANGE_2,
    (2, "steps"): STEPS_2,
    (3, "exchange"): EXCHANGE_3,
    (3, "steps"): STEPS_3,
}

NOTHING = "a call for no variable does nothing"
CONSTANT = "the numbers of states and indicators are constant"
MORE = {
    "instantiated": f"start values may be read, those of inputs be set, as most importers do; {NOTHING}",
    "initialization": f"parameters and inputs may be read; {CONSTANT}; {NOTHING}",
    "event": f"importers set time and states in it; FMI 2.0 allows a second EnterEventMode; {NOTHING}",
    "continuous": f"a parameter that is tuned takes effect at once; {CONSTANT}; {NOTHING}",
    "step": NOTHING,
    "failed": "a discarded step leaves the FMU as it was: another input or a shorter step may follow",
    "terminated": f"{CONSTANT}; {NOTHING}",
    "error": "an error leaves the FMU as it was, so that a good value may follow",
}
"""Why the FMUs of this package allow more, by state."""

_STEP = {"GetRealOutputDerivatives", "GetOutputDerivatives"}
NO_VALUE_YET = {
    "initialization": _STEP,
    "instantiated": _STEP
    | {f"Get{type_} output" for type_ in ("Real", "Float64", "Integer", "Int32")}
    | {f"Get{type_} derivative" for type_ in ("Real", "Float64")}
    | {"GetDirectionalDerivative", "GetEventIndicators", "GetContinuousStates", "GetDerivatives"}
    | {"GetContinuousStateDerivatives"},
}
"""Calls that the standard allows after any error, "for debugging only". So early there is nothing that they could
return, so that they are an error, by the state in which the first error came."""


def read(table):
    """A table as {(row, state): sign}."""
    head, *lines = table.strip("\n").splitlines()
    states = head.split()
    cells = {}
    for line in lines:
        *name, signs = line[:39].strip(), line[39:].split()
        assert len(signs) == len(states) and set(signs) <= set("x-+d"), line
        for state, sign in zip(states, signs, strict=True):
            assert (name[0], state) not in cells, line
            cells[name[0], state] = sign
    return cells
