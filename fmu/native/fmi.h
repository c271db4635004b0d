/* The common functions of FMI 2.0 and 3.0, on top of runtime.c. The including file defines FMI(), the name of a
 * function by its name in FMI 3.0, `report`, `type_names` in the order of Type, and the types Result, Handle, Boolean,
 * Memory, Byte and Text of its version. This file names no model. */

#define INSTANCE ((Instance *)c)
#define NEED(modes) \
    if (expect(INSTANCE, (modes), __func__)) return (Result)ERROR
#define CHECK(condition, what) \
    if (!(condition)) return (Result)complain(INSTANCE, ERROR, "%s: %s", __func__, what)
#define NOT_NULL(pointer) CHECK(pointer, "null argument")
/* for the functions of one kind of simulation */
#define NEED_EXCHANGE(modes) \
    NEED(modes);             \
    CHECK(INSTANCE->model_exchange, "is for model exchange")
#define NEED_STEPS(modes) \
    NEED(modes);          \
    CHECK(!INSTANCE->model_exchange, "is for co-simulation")

/* A new instance, or NULL where the host means another FMU: `identifier` is the host's identifier, `own` that of this
 * FMU, and `word` the name of this identifier in messages. */
static Instance *instantiate(const char *name, const char *word, const char *identifier, const char *own,
                             int model_exchange, void *environment, void (*log)(void)) {
    Instance *c = instance_new(name && *name ? name : model.name, type_names, report);
    if (!c) return NULL;
    c->log = log;
    c->environment = environment;
    c->model_exchange = model_exchange;
    if (!name || !*name)
        complain(c, ERROR, "the instance has no name");
    else if (!identifier || strcmp(identifier, own))
        complain(c, ERROR, "the %s %s is not that of this FMU, %s", word, identifier ? identifier : "(null)", own);
    else
        return c;
    instance_free(c);
    return NULL;
}

void FMI(FreeInstance)(Handle c) { instance_free(INSTANCE); }

Result FMI(SetDebugLogging)(Handle c, Boolean on, size_t n, const Text categories[]) {
    (void)on, (void)n, (void)categories;
    NEED(ANY);
    return (Result)OK;
}

Result FMI(ExitInitializationMode)(Handle c) {
    NEED(INITIALIZATION);
    const Status status = start(INSTANCE);
    if (status) return (Result)status;
    INSTANCE->mode = INSTANCE->model_exchange ? EVENT : STEP;
    return (Result)OK;
}

Result FMI(EnterEventMode)(Handle c) {
    NEED(EVENT | CONTINUOUS);
    if (step_taken(INSTANCE)) return (Result)ERROR;
    INSTANCE->mode = EVENT;
    INSTANCE->held = 0;
    return (Result)OK;
}

Result FMI(Terminate)(Handle c) {
    NEED(RUNNING);
    INSTANCE->mode = TERMINATED;
    return (Result)OK;
}

Result FMI(Reset)(Handle c) {
    NEED(ANY);
    instance_reset(INSTANCE);
    return (Result)OK;
}

/* -- saved states */

Result FMI(GetFMUState)(Handle c, Memory *state) {
    NEED(ANY);
    NOT_NULL(state);
    return (Result)state_get(INSTANCE, state);
}

Result FMI(SetFMUState)(Handle c, Memory state) {
    NEED(ANY);
    NOT_NULL(state);
    return (Result)state_set(INSTANCE, state);
}

Result FMI(FreeFMUState)(Handle c, Memory *state) {
    NEED(ANY);
    if (!state) return (Result)OK;
    free(*state);
    *state = NULL;
    return (Result)OK;
}

Result FMI(SerializedFMUStateSize)(Handle c, Memory state, size_t *size) {
    NEED(ANY);
    NOT_NULL(state && size);
    *size = state_size(INSTANCE);
    return (Result)OK;
}

Result FMI(SerializeFMUState)(Handle c, Memory state, Byte bytes[], size_t size) {
    NEED(ANY);
    NOT_NULL(state && bytes);
    CHECK(size >= state_size(INSTANCE), "too little room");
    memcpy(bytes, state, state_size(INSTANCE));
    return (Result)OK;
}

Result FMI(DeserializeFMUState)(Handle c, const Byte bytes[], size_t size, Memory *state) {
    NEED(ANY);
    NOT_NULL(bytes && state);
    return (Result)state_from(INSTANCE, bytes, size, state);
}

/* -- model exchange */

Result FMI(EnterContinuousTimeMode)(Handle c) {
    NEED(EVENT);
    const Status status = settle(INSTANCE);
    if (status) return (Result)status;
    INSTANCE->mode = CONTINUOUS;
    INSTANCE->held = 1;
    return (Result)OK;
}

Result FMI(CompletedIntegratorStep)(Handle c, Boolean no_set, Boolean *enter_event, Boolean *terminate) {
    (void)no_set;
    NEED(CONTINUOUS);
    NOT_NULL(enter_event && terminate);
    int wanted;
    const Status status = completed(INSTANCE, &wanted);
    *enter_event = wanted;
    *terminate = 0;
    return (Result)status;
}

/* Importers set time and states in Event Mode, too, which the standard does not know. */
Result FMI(SetTime)(Handle c, double time) {
    NEED(EVENT | CONTINUOUS);
    return (Result)set_time(INSTANCE, "time", time);
}

Result FMI(SetContinuousStates)(Handle c, const double x[], size_t n) {
    NEED(CONTINUOUS | EVENT);
    return (Result)states_set(INSTANCE, x, n, __func__);
}

Result FMI(GetContinuousStateDerivatives)(Handle c, double dx[], size_t n) {
    NEED_EXCHANGE(STARTED);
    const Status status = derivatives(INSTANCE);
    return (Result)(status ? status : states_get(INSTANCE, INSTANCE->dx, dx, n, __func__));
}

Result FMI(GetEventIndicators)(Handle c, double z[], size_t n) {
    (void)z;
    NEED_EXCHANGE(STARTED);
    CHECK(!n, "there are none");
    return (Result)OK;
}

Result FMI(GetContinuousStates)(Handle c, double x[], size_t n) {
    NEED_EXCHANGE(STARTED);
    return (Result)states_get(INSTANCE, INSTANCE->x, x, n, __func__);
}

Result FMI(GetNominalsOfContinuousStates)(Handle c, double x[], size_t n) {
    NEED_EXCHANGE(ANY);
    return (Result)states_get(INSTANCE, model.nominal, x, n, __func__);
}

/* -- values */

static Status set_all(Instance *c, const unsigned vr[], size_t n, const double value[]) {
    for (size_t i = 0; i < n; ++i)
        if (set(c, REAL, vr[i], value[i])) return ERROR;
    return OK;
}

/* The stored number as a whole one; a number that a host wrote into a saved state may be any. */
static int32_t integer(double v) {
    return v <= INT32_MIN ? INT32_MIN : v >= INT32_MAX ? INT32_MAX : (int32_t)v;
}
static int boolean(double v) { return v != 0.0; }

/* The bodies of the functions that get and set values of other types. Only a number may change between events. */
#define GET_EACH(type, as)                                              \
    {                                                                   \
        NEED(ANY);                                                      \
        NOT_NULL(!n || (vr && value));                                  \
        for (size_t i = 0; i < n; ++i) {                                \
            double one;                                                 \
            const Status status = get(INSTANCE, type, &vr[i], 1, &one); \
            if (status) return (Result)status;                          \
            value[i] = as(one);                                         \
        }                                                               \
        return (Result)OK;                                              \
    }
#define SET_EACH(type, as)                                                                  \
    {                                                                                       \
        NEED(n ? INSTANTIATED | INITIALIZATION | EVENT | STEP : ANY);                       \
        NOT_NULL(!n || (vr && value));                                                      \
        for (size_t i = 0; i < n; ++i)                                                      \
            if (set(INSTANCE, type, vr[i], (double)as(value[i]))) return (Result)ERROR;     \
        return (Result)OK;                                                                  \
    }
/* The body of those of a type that no variable has: a call for none of them is right. */
#define NONE_OF_TYPE(name)                                                                  \
    {                                                                                       \
        (void)value;                                                                        \
        NEED(ANY);                                                                          \
        if (!n) return (Result)OK;                                                          \
        NOT_NULL(vr);                                                                       \
        return (Result)complain(INSTANCE, ERROR, OTHER_TYPE, vr[0], name);                  \
    }

static Status first_derivatives(Instance *c, const unsigned vr[], size_t n, const int order[], double value[]) {
    for (size_t i = 0; i < n; ++i)
        if (order[i] != 1) return complain(c, ERROR, "derivatives of outputs: only the first derivative");
    return output_derivatives(c, vr, n, value);
}
