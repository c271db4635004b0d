/* FMI 2.0, Co-Simulation and Model Exchange, over runtime.c. Names no model. */
#include "fmi2Functions.h"
#include "runtime.c"

/* there are headers about that leave the prefix out */
#ifdef FMI2_FUNCTION_PREFIX
#undef fmi2FullName
#define fmi2FullName(name) CHAINUNIT_JOIN(FMI2_FUNCTION_PREFIX, name)
#endif

#define INSTANCE ((Instance *)c)
#define NEED(modes) \
    if (expect(INSTANCE, (modes), __func__)) return fmi2Error
#define CHECK(condition, what) \
    if (!(condition)) return (fmi2Status)complain(INSTANCE, ERROR, "%s: %s", __func__, what)
#define NOT_NULL(pointer) CHECK(pointer, "null argument")

static void report(const Instance *c, Status status, const char *message) {
    const fmi2CallbackLogger log = (fmi2CallbackLogger)c->log;
    if (!log) return;
    /* the message is a format to the host, but not every host takes it as one: no arguments, and no stray % */
    char format[1400];
    size_t n = 0;
    for (; *message && n + 3 < sizeof format; ++message) {
        format[n++] = *message;
        if (*message == '%') format[n++] = '%';
    }
    format[n] = 0;
    log(c->environment, c->name, (fmi2Status)status, status == DISCARD ? "logStatusDiscard" : "logStatusError", format);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)resources;
    (void)visible;
    (void)logging;
    if (!functions) return NULL;
    Instance *c = instance_new(name && *name ? name : model.name, report);
    if (!c) return NULL;
    /* the host may give up the structure after this call */
    c->log = (void (*)(void))functions->logger;
    c->environment = functions->componentEnvironment;
    c->model_exchange = type == fmi2ModelExchange;
    if (!name || !*name)
        complain(c, ERROR, "the instance has no name");
    else if (!guid || strcmp(guid, model.guid))
        complain(c, ERROR, "the GUID %s is not that of this FMU, %s", guid ? guid : "(null)", model.guid);
    else
        return c;
    instance_free(c);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c) { instance_free(INSTANCE); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)on, (void)n, (void)categories;
    NEED(ANY);
    return fmi2OK;
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

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    NEED(INITIALIZATION);
    const Status status = start(INSTANCE);
    if (status) return (fmi2Status)status;
    INSTANCE->mode = INSTANCE->model_exchange ? EVENT : STEP;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    NEED(RUNNING);
    INSTANCE->mode = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    NEED(ANY);
    instance_reset(INSTANCE);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    NEED(ANY);
    NOT_NULL(!n || (vr && value));
    return (fmi2Status)get(INSTANCE, vr, n, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    NEED(INSTANTIATED | INITIALIZATION | RUNNING);
    NOT_NULL(!n || (vr && value));
    for (size_t i = 0; i < n; ++i) {
        const Status status = set(INSTANCE, vr[i], value[i]);
        if (status) return (fmi2Status)status;
    }
    return fmi2OK;
}

#define NO_SUCH_TYPE(name, type, qualifier)                                                               \
    fmi2Status name(fmi2Component c, const fmi2ValueReference vr[], size_t n, qualifier type value[]) {   \
        (void)vr;                                                                                         \
        (void)value;                                                                                      \
        NEED(ANY);                                                                                        \
        CHECK(!n, "every variable is a Real");                                                            \
        return fmi2OK;                                                                                    \
    }
NO_SUCH_TYPE(fmi2GetInteger, fmi2Integer, )
NO_SUCH_TYPE(fmi2GetBoolean, fmi2Boolean, )
NO_SUCH_TYPE(fmi2GetString, fmi2String, )
NO_SUCH_TYPE(fmi2SetInteger, fmi2Integer, const)
NO_SUCH_TYPE(fmi2SetBoolean, fmi2Boolean, const)
NO_SUCH_TYPE(fmi2SetString, fmi2String, const)

/* -- saved states */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    NEED(ANY);
    NOT_NULL(state);
    return (fmi2Status)state_get(INSTANCE, state);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    NEED(ANY);
    NOT_NULL(state);
    return (fmi2Status)state_set(INSTANCE, state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    NEED(ANY);
    if (!state) return fmi2OK;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    NEED(ANY);
    NOT_NULL(state && size);
    *size = state_size(INSTANCE);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    NEED(ANY);
    NOT_NULL(state && bytes);
    CHECK(size >= state_size(INSTANCE), "too little room");
    memcpy(bytes, state, state_size(INSTANCE));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    NEED(ANY);
    NOT_NULL(bytes && state);
    return (fmi2Status)state_from(INSTANCE, bytes, size, state);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) {
    NEED(INITIALIZATION | RUNNING);
    NOT_NULL(unknown && known && seed && sensitivity);
    return (fmi2Status)forward(INSTANCE, unknown, n_unknown, known, n_known, seed, sensitivity);
}

/* -- model exchange */

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    NEED(EVENT | CONTINUOUS);
    if (step_taken(INSTANCE)) return fmi2Error;
    INSTANCE->mode = EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    NEED(EVENT);
    NOT_NULL(info);
    memset(info, 0, sizeof *info);
    return (fmi2Status)project(INSTANCE, &info->valuesOfContinuousStatesChanged);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    NEED(EVENT);
    INSTANCE->mode = CONTINUOUS;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *enter_event,
                                       fmi2Boolean *terminate) {
    (void)no_set;
    NEED(CONTINUOUS);
    NOT_NULL(enter_event && terminate);
    int wanted;
    const Status status = completed(INSTANCE, &wanted);
    *enter_event = wanted;
    *terminate = fmi2False;
    return (fmi2Status)status;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    NEED(EVENT | CONTINUOUS);
    return (fmi2Status)set_time(INSTANCE, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    NEED(CONTINUOUS | EVENT);
    return (fmi2Status)states_set(INSTANCE, x, n, __func__);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    NEED(INITIALIZATION | EVENT | CONTINUOUS);
    const Status status = derivatives(INSTANCE);
    return (fmi2Status)(status ? status : states_get(INSTANCE, INSTANCE->dx, dx, n, __func__));
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    (void)z;
    NEED(INITIALIZATION | EVENT | CONTINUOUS);
    CHECK(!n, "there are none");
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    NEED(INITIALIZATION | EVENT | CONTINUOUS);
    return (fmi2Status)states_get(INSTANCE, INSTANCE->x, x, n, __func__);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    NEED(ANY);
    return (fmi2Status)states_get(INSTANCE, model.nominal, x, n, __func__);
}

/* -- co-simulation */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    NEED(INITIALIZATION | STEP);
    NOT_NULL(!n || (vr && order && value));
    begin_inputs(INSTANCE);
    for (size_t i = 0; i < n; ++i) {
        CHECK(order[i] == 1, "only the first derivative");
        const unsigned k = vr[i] - (unsigned)model.n_p;
        CHECK(k < (unsigned)model.n_u, "a value reference is not that of an input");
        CHECK(isfinite(value[i]), "a derivative is not a finite number");
        INSTANCE->du[k] = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[]) {
    NEED(STEP);
    NOT_NULL(!n || (vr && order && value));
    for (size_t i = 0; i < n; ++i) {
        CHECK(order[i] == 1, "only the first derivative");
        const Status status = output_derivative(INSTANCE, vr[i], &value[i]);
        if (status) return (fmi2Status)status;
    }
    return fmi2OK;
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

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind, (void)value;
    NEED(ANY);
    return (fmi2Status)complain(INSTANCE, DISCARD, "%s: steps are not asynchronous", __func__);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    NEED(ANY);
    NOT_NULL(value);
    if (kind != fmi2LastSuccessfulTime) return (fmi2Status)complain(INSTANCE, DISCARD, "%s: not available", __func__);
    *value = INSTANCE->time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind, (void)value;
    NEED(ANY);
    return (fmi2Status)complain(INSTANCE, DISCARD, "%s: not available", __func__);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    NEED(ANY);
    NOT_NULL(value);
    if (kind != fmi2Terminated) return (fmi2Status)complain(INSTANCE, DISCARD, "%s: not available", __func__);
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind, (void)value;
    NEED(ANY);
    return (fmi2Status)complain(INSTANCE, DISCARD, "%s: not available", __func__);
}
