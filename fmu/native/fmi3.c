/* FMI 3.0, Co-Simulation and Model Exchange, on top of runtime.c. This file names no model. */
#include "fmi3Functions.h"
#include "runtime.c"

static const char *const type_names[] = {"Float64", "Int32", "Boolean"};

static void report(const Instance *c, Status status, const char *message) {
    const fmi3LogMessageCallback log = (fmi3LogMessageCallback)c->log;
    if (log) log(c->environment, (fmi3Status)status, status == DISCARD ? "logStatusDiscard" : "logStatusError", message);
}

#define OF_VERSION(name) fmi3##name
#define FMI(name) OF_VERSION(name)
typedef fmi3Status Result;
typedef fmi3Instance Handle;
typedef fmi3Boolean Boolean;
typedef fmi3FMUState Memory;
typedef fmi3Byte Byte;
typedef fmi3String Text;
#include "fmi.h"

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    (void)resources, (void)visible, (void)logging;
    return instantiate(name, "token", token, model.guid, 1, environment, (void (*)(void))log);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n_required,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    (void)resources, (void)visible, (void)logging, (void)early, (void)required, (void)n_required;
    (void)update;
    Instance *c = instantiate(name, "token", token, model.guid, 0, environment, (void (*)(void))log);
    if (!c || !events) return c;
    complain(c, ERROR, "eventModeUsed must be false: there is no event mode in co-simulation");
    instance_free(c);
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
    if (log) log(environment, fmi3Error, "logStatusError", "scheduled execution is not supported");
    return NULL;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance, fmi3Float64 time,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
    (void)has_tolerance, (void)tolerance;
    NEED(INSTANTIATED);
    Status status = set_experiment(INSTANCE, time, has_stop, stop);
    if (!status) status = start(INSTANCE);
    if (status) return (fmi3Status)status;
    INSTANCE->mode = INITIALIZATION;
    return fmi3OK;
}

/* -- values */

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 value[], size_t n_values) {
    NEED(ANY);
    NOT_NULL(!n || (vr && value));
    CHECK(n == n_values, "as many values as references are needed");
    return (fmi3Status)get(INSTANCE, REAL, vr, n, value);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 value[],
                          size_t n_values) {
    NEED(INSTANTIATED | INITIALIZATION | RUNNING);
    NOT_NULL(!n || (vr && value));
    CHECK(n == n_values, "as many values as references are needed");
    return (fmi3Status)set_all(INSTANCE, vr, n, value);
}

#define V const fmi3ValueReference vr[], size_t n
#define COUNTED CHECK(n == n_values, "as many values as references are needed");
fmi3Status fmi3GetInt32(fmi3Instance c, V, fmi3Int32 value[], size_t n_values) {
    NEED(ANY);
    COUNTED
    GET_EACH(INTEGER, integer)
}
fmi3Status fmi3SetInt32(fmi3Instance c, V, const fmi3Int32 value[], size_t n_values) {
    NEED(ANY);
    COUNTED
    SET_EACH(INTEGER, integer)
}
fmi3Status fmi3GetBoolean(fmi3Instance c, V, fmi3Boolean value[], size_t n_values) {
    NEED(ANY);
    COUNTED
    GET_EACH(BOOLEAN, boolean)
}
fmi3Status fmi3SetBoolean(fmi3Instance c, V, const fmi3Boolean value[], size_t n_values) {
    NEED(ANY);
    COUNTED
    SET_EACH(BOOLEAN, boolean)
}

#define NO_SUCH_TYPE(type)                                                                                    \
    fmi3Status fmi3Get##type(fmi3Instance c, V, fmi3##type value[], size_t n_values) {                        \
        (void)n_values;                                                                                       \
        NONE_OF_TYPE(#type)                                                                                   \
    }                                                                                                         \
    fmi3Status fmi3Set##type(fmi3Instance c, V, const fmi3##type value[], size_t n_values) {                  \
        (void)n_values;                                                                                       \
        NONE_OF_TYPE(#type)                                                                                   \
    }
NO_SUCH_TYPE(Float32)
NO_SUCH_TYPE(Int8)
NO_SUCH_TYPE(UInt8)
NO_SUCH_TYPE(Int16)
NO_SUCH_TYPE(UInt16)
NO_SUCH_TYPE(UInt32)
NO_SUCH_TYPE(Int64)
NO_SUCH_TYPE(UInt64)
NO_SUCH_TYPE(String)

#define NOT_THERE(what)                                    \
    {                                                      \
        NEED(ANY);                                         \
        CHECK(0, what);                                    \
    }
/* as for the types of variables: a call for none of them is right */
#define NONE_OF(what)                                      \
    {                                                      \
        NEED(ANY);                                         \
        CHECK(!n, "there are no " what);                   \
        return fmi3OK;                                     \
    }
fmi3Status fmi3GetBinary(fmi3Instance c, V, size_t sizes[], fmi3Binary value[], size_t n_values)
    NONE_OF("binary variables")
fmi3Status fmi3SetBinary(fmi3Instance c, V, const size_t sizes[], const fmi3Binary value[], size_t n_values)
    NONE_OF("binary variables")
fmi3Status fmi3GetClock(fmi3Instance c, V, fmi3Clock value[]) NONE_OF("clocks")
fmi3Status fmi3SetClock(fmi3Instance c, V, const fmi3Clock value[]) NONE_OF("clocks")
fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, V, fmi3Float64 interval[], fmi3IntervalQualifier qualifier[])
    NONE_OF("clocks")
fmi3Status fmi3GetIntervalFraction(fmi3Instance c, V, fmi3UInt64 counter[], fmi3UInt64 resolution[],
                                   fmi3IntervalQualifier qualifier[]) NONE_OF("clocks")
fmi3Status fmi3GetShiftDecimal(fmi3Instance c, V, fmi3Float64 shift[]) NONE_OF("clocks")
fmi3Status fmi3GetShiftFraction(fmi3Instance c, V, fmi3UInt64 counter[], fmi3UInt64 resolution[]) NONE_OF("clocks")
fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, V, const fmi3Float64 interval[]) NONE_OF("clocks")
fmi3Status fmi3SetIntervalFraction(fmi3Instance c, V, const fmi3UInt64 counter[], const fmi3UInt64 resolution[])
    NONE_OF("clocks")
fmi3Status fmi3SetShiftDecimal(fmi3Instance c, V, const fmi3Float64 shift[]) NONE_OF("clocks")
fmi3Status fmi3SetShiftFraction(fmi3Instance c, V, const fmi3UInt64 counter[], const fmi3UInt64 resolution[])
    NONE_OF("clocks")
fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
    NOT_THERE("scheduled execution is not supported")
fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *n)
    NOT_THERE("dependencies stand in the model description")
fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t of[], fmi3ValueReference by[],
                                       size_t elements[], fmi3DependencyKind kinds[], size_t n)
    NOT_THERE("dependencies stand in the model description")
fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t n_unknown,
                                    const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
    NOT_THERE("adjoint derivatives are not provided, directional ones are")
fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) NOT_THERE("there are no structural parameters")
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) NOT_THERE("there are no structural parameters")

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t n_unknown,
                                        const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    NEED(STARTED);
    NOT_NULL(unknown && known && seed && sensitivity);
    CHECK(n_seed == n_known && n_sensitivity == n_unknown, "as many values as references are needed");
    return (fmi3Status)forward(INSTANCE, unknown, n_unknown, known, n_known, seed, sensitivity);
}

/* -- model exchange */

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
    NEED(EVENT);
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *has_next, fmi3Float64 *next) {
    NEED(EVENT);
    NOT_NULL(again && terminate && nominals && values && has_next && next);
    *again = *terminate = *nominals = *has_next = fmi3False;
    *next = 0.0;
    int moved;
    const Status status = project(INSTANCE, &moved);
    *values = moved;
    return (fmi3Status)status;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
    NEED_EXCHANGE(ANY);
    NOT_NULL(n);
    *n = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
    NEED_EXCHANGE(ANY);
    NOT_NULL(n);
    *n = (size_t)model.n_x;
    return fmi3OK;
}

/* -- co-simulation */

fmi3Status fmi3EnterStepMode(fmi3Instance c) NOT_THERE("there is no event mode in co-simulation")

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 order[],
                                    fmi3Float64 value[], size_t n_values) {
    NEED_STEPS(STEP | TERMINATED);
    NOT_NULL(!n || (vr && order && value));
    CHECK(n == n_values, "as many values as references are needed");
    return (fmi3Status)first_derivatives(INSTANCE, vr, n, order, value);
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean no_set, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    (void)no_set;
    NEED(STEP);
    NOT_NULL(event && terminate && early && last);
    *event = *terminate = *early = fmi3False;
    *last = INSTANCE->time;
    CHECK(size != 0.0, "a step must be longer than 0 s");
    const Status status = step(INSTANCE, time, size);
    *last = INSTANCE->time;
    return (fmi3Status)status;
}
