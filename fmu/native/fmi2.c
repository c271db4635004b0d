/* FMI 2.0, Co-Simulation and Model Exchange, on top of runtime.c. This file names no model. */
#include "fmi2Functions.h"
#include "runtime.c"

/* some headers omit the prefix */
#ifdef FMI2_FUNCTION_PREFIX
#undef fmi2FullName
#define fmi2FullName(name) CHAINUNIT_JOIN(FMI2_FUNCTION_PREFIX, name)
#endif

static const char *const type_names[] = {"Real", "Integer", "Boolean"};

static void report(const Instance *c, Status status, const char *message) {
    const fmi2CallbackLogger log = (fmi2CallbackLogger)c->log;
    if (!log) return;
    /* the message is a format, but not every host treats it as one: it has no arguments and no single % */
    char format[1400];
    size_t n = 0;
    for (; *message && n + 3 < sizeof format; ++message) {
        format[n++] = *message;
        if (*message == '%') format[n++] = '%';
    }
    format[n] = 0;
    log(c->environment, c->name, (fmi2Status)status, status == DISCARD ? "logStatusDiscard" : "logStatusError", format);
}

/* names of version 2 */
#define GetFMUState GetFMUstate
#define SetFMUState SetFMUstate
#define FreeFMUState FreeFMUstate
#define SerializedFMUStateSize SerializedFMUstateSize
#define SerializeFMUState SerializeFMUstate
#define DeserializeFMUState DeSerializeFMUstate
#define GetContinuousStateDerivatives GetDerivatives
#define OF_VERSION(name) fmi2##name
#define FMI(name) OF_VERSION(name)
typedef fmi2Status Result;
typedef fmi2Component Handle;
typedef fmi2Boolean Boolean;
typedef fmi2FMUstate Memory;
typedef fmi2Byte Byte;
typedef fmi2String Text;
#include "fmi.h"

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)resources;
    (void)visible;
    (void)logging;
    if (!functions) return NULL;
    /* the host may free the structure after this call */
    return instantiate(name, "GUID", guid, model.guid, type == fmi2ModelExchange, functions->componentEnvironment,
                       (void (*)(void))functions->logger);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real time,
                               fmi2Boolean has_stop, fmi2Real stop) {
    (void)has_tolerance;
    (void)tolerance;
    NEED(INSTANTIATED);
    return (fmi2Status)set_experiment(INSTANCE, time, has_stop, stop);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    NEED(INSTANTIATED);
    const Status status = start(INSTANCE);
    if (status) return (fmi2Status)status;
    INSTANCE->mode = INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    NEED(ANY);
    NOT_NULL(!n || (vr && value));
    return (fmi2Status)get(INSTANCE, REAL, vr, n, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    NEED(INSTANTIATED | INITIALIZATION | RUNNING);
    NOT_NULL(!n || (vr && value));
    return (fmi2Status)set_all(INSTANCE, vr, n, value);
}

#define V const fmi2ValueReference vr[], size_t n
fmi2Status fmi2GetInteger(fmi2Component c, V, fmi2Integer value[]) GET_EACH(INTEGER, integer)
fmi2Status fmi2SetInteger(fmi2Component c, V, const fmi2Integer value[]) SET_EACH(INTEGER, integer)
fmi2Status fmi2GetBoolean(fmi2Component c, V, fmi2Boolean value[]) GET_EACH(BOOLEAN, boolean)
fmi2Status fmi2SetBoolean(fmi2Component c, V, const fmi2Boolean value[]) SET_EACH(BOOLEAN, boolean)
fmi2Status fmi2GetString(fmi2Component c, V, fmi2String value[]) NONE_OF_TYPE("String")
fmi2Status fmi2SetString(fmi2Component c, V, const fmi2String value[]) NONE_OF_TYPE("String")

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) {
    NEED(STARTED);
    NOT_NULL(unknown && known && seed && sensitivity);
    return (fmi2Status)forward(INSTANCE, unknown, n_unknown, known, n_known, seed, sensitivity);
}

/* -- model exchange */

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    NEED(EVENT);
    NOT_NULL(info);
    memset(info, 0, sizeof *info);
    return (fmi2Status)project(INSTANCE, &info->valuesOfContinuousStatesChanged);
}

/* -- co-simulation */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    NEED_STEPS(INSTANTIATED | INITIALIZATION | STEP);
    NOT_NULL(!n || (vr && order && value));
    if (all_real(INSTANCE, vr, n)) return fmi2Error;
    begin_inputs(INSTANCE);
    for (size_t i = 0; i < n; ++i) {
        CHECK(order[i] == 1, "only the first derivative");
        const unsigned k = vr[i] - (unsigned)model.n_p;
        CHECK(k < (unsigned)model.n_u, "a value reference is not that of an input");
        CHECK(isfinite(value[i]), "a derivative is not a finite number");
        INSTANCE->du[k] = value[i];
        INSTANCE->is_set[k] = 1.0;
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[]) {
    NEED_STEPS(STEP | TERMINATED);
    NOT_NULL(!n || (vr && order && value));
    return (fmi2Status)first_derivatives(INSTANCE, vr, n, order, value);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_set) {
    (void)no_set;
    NEED(STEP);
    return (fmi2Status)step(INSTANCE, time, size);
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    NEED(ANY);
    return (fmi2Status)complain(INSTANCE, ERROR, "%s: steps are not asynchronous", __func__);
}

/* The functions for the status of a step: `known` is the only kind of status that this FMU has. */
#define GET_STATUS(name, type, known, answer)                                                                     \
    fmi2Status name(fmi2Component c, const fmi2StatusKind kind, type *value) {                                    \
        NEED_STEPS(STEP | TERMINATED);                                                                            \
        NOT_NULL(value);                                                                                          \
        if ((int)kind != (known)) return (fmi2Status)complain(INSTANCE, DISCARD, "%s: not available", __func__);  \
        *value = answer;                                                                                          \
        return fmi2OK;                                                                                            \
    }
#define NONE (-1)
GET_STATUS(fmi2GetStatus, fmi2Status, NONE, fmi2OK)
GET_STATUS(fmi2GetRealStatus, fmi2Real, fmi2LastSuccessfulTime, INSTANCE->time)
GET_STATUS(fmi2GetIntegerStatus, fmi2Integer, NONE, 0)
GET_STATUS(fmi2GetBooleanStatus, fmi2Boolean, fmi2Terminated, fmi2False)
GET_STATUS(fmi2GetStringStatus, fmi2String, NONE, NULL)
