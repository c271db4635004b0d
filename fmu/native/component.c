/* FMI 3.0 as a WebAssembly component of the draft FMI-LS-WASM, on top of fmi3.c: the core functions behind its
 * interfaces, in the canonical ABI. This file names no model.
 *
 * A list is its address and its length. A result of more than one value lies in memory, at the returned address. All
 * functions serve Co-Simulation and Model Exchange alike, as far as both have them. */
#include "fmi3.c"

#define CALL(name) __attribute__((export_name(name)))

/* -- memory of a call: its arguments, and the lists in its result */

typedef union Block {
    union Block *next;
    double aligned[2];
} Block;
static Block *blocks;

static void *room(size_t size) {
    Block *block = malloc(sizeof *block + size);
    if (!block) __builtin_trap();
    block->next = blocks;
    blocks = block;
    return block + 1;
}

CALL("realloc") void *component_realloc(void *old, size_t old_size, size_t alignment, size_t size) {
    (void)alignment; /* at most 8 */
    void *now = room(size);
    if (old_size) memcpy(now, old, old_size < size ? old_size : size);
    return now;
}

/* The host has read the result. */
CALL("done") void component_done(int result) {
    (void)result;
    while (blocks) {
        Block *next = blocks->next;
        free(blocks);
        blocks = next;
    }
}

/* -- results */

typedef struct {
    const void *at;
    size_t n;
} List;
typedef struct {
    unsigned vr, order;
} Request;

static const void *list_or(fmi3Status status, const void *at, size_t n) {
    static struct {
        unsigned failed;
        union {
            List list;
            unsigned status;
        } of;
    } result;
    result.failed = status != fmi3OK;
    if (result.failed)
        result.of.status = status;
    else
        result.of.list = (List){at, n};
    return &result;
}

static const void *number_or(fmi3Status status, uint64_t number) {
    static struct {
        uint64_t failed, of;
    } result;
    result.failed = status != fmi3OK;
    result.of = result.failed ? (uint64_t)status : number;
    return &result;
}

/* -- instances */

__attribute__((import_module("fmi:fmi3/callbacks@3.0.0"), import_name("log-message"))) void host_log(
    const char *name, size_t n_name, int status, const char *category, size_t n_category, const char *text, size_t n_text);

/* The length of a text without the begin of a character at its end: messages are cut after so many bytes. */
static size_t whole(const char *text) {
    const size_t n = strlen(text);
    size_t at = n;
    while (at && ((unsigned char)text[at - 1] & 0xC0) == 0x80) --at;
    if (!at) return n;
    const unsigned char lead = (unsigned char)text[at - 1];
    const size_t size = lead < 0x80 ? 1 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
    return at - 1 + size <= n ? n : at - 1;
}

static void tell(fmi3InstanceEnvironment name, fmi3Status status, fmi3String category, fmi3String text) {
    host_log(name, strlen(name), status, category, strlen(category), text, whole(text));
}

static char *ended(const char *text, size_t n) {
    char *copy = malloc(n + 1);
    if (!copy) __builtin_trap();
    memcpy(copy, text, n);
    copy[n] = 0;
    return copy;
}

/* The environment of an instance is its name, for its messages. */
static const void *made(fmi3Instance c, char *name, char *token) {
    static struct {
        unsigned there;
        void *instance;
    } result;
    free(token);
    if (!c) free(name);
    result.there = c != NULL;
    result.instance = c;
    return &result;
}

CALL("instantiate-co-simulation") const void *make_co_simulation(
    const char *name, size_t n_name, const char *token, size_t n_token, const char *path, size_t n_path, int visible,
    int logging, int events, int early, const unsigned required[], size_t n_required) {
    (void)path, (void)n_path;
    char *own_name = ended(name, n_name), *own_token = ended(token, n_token);
    return made(fmi3InstantiateCoSimulation(own_name, own_token, "", visible, logging, events, early, required, n_required,
                                            own_name, tell, NULL),
                own_name, own_token);
}

CALL("instantiate-model-exchange") const void *make_model_exchange(
    const char *name, size_t n_name, const char *token, size_t n_token, const char *path, size_t n_path, int visible,
    int logging) {
    (void)path, (void)n_path;
    char *own_name = ended(name, n_name), *own_token = ended(token, n_token);
    return made(fmi3InstantiateModelExchange(own_name, own_token, "", visible, logging, own_name, tell), own_name,
                own_token);
}

CALL("drop") void component_drop(fmi3Instance c) {
    char *name = INSTANCE->environment;
    fmi3FreeInstance(c);
    free(name);
}

CALL("get-version") const void *component_version(void) {
    static List result;
    result = (List){fmi3GetVersion(), strlen(fmi3GetVersion())};
    return &result;
}

CALL("set-debug-logging") int component_logging(fmi3Instance c, int on, const List categories[], size_t n) {
    (void)categories, (void)n;
    return fmi3SetDebugLogging(c, on, 0, NULL);
}

CALL("enter-initialization-mode") int component_begin(fmi3Instance c, int has_tolerance, double tolerance, double time,
                                                      int has_stop, double stop) {
    return fmi3EnterInitializationMode(c, has_tolerance, tolerance, time, has_stop, stop);
}

#define PLAIN(name, function) \
    CALL(name) int component_##function(fmi3Instance c) { return fmi3##function(c); }
PLAIN("exit-initialization-mode", ExitInitializationMode)
PLAIN("enter-event-mode", EnterEventMode)
PLAIN("terminate", Terminate)
PLAIN("reset", Reset)
PLAIN("enter-configuration-mode", EnterConfigurationMode)
PLAIN("exit-configuration-mode", ExitConfigurationMode)
PLAIN("evaluate-discrete-states", EvaluateDiscreteStates)
PLAIN("enter-step-mode", EnterStepMode)
PLAIN("enter-continuous-time-mode", EnterContinuousTimeMode)

CALL("update-discrete-states") const void *component_update(fmi3Instance c) {
    static struct {
        uint64_t failed;
        bool again, terminate, nominals, values, has_next;
        double next;
    } result;
    const fmi3Status status = fmi3UpdateDiscreteStates(c, &result.again, &result.terminate, &result.nominals,
                                                       &result.values, &result.has_next, &result.next);
    return status ? number_or(status, 0) : &result;
}

/* -- values */

#define VALUES(name, type)                                                                                     \
    CALL("get-" name) const void *component_get_##type(fmi3Instance c, const unsigned vr[], size_t n) {        \
        fmi3##type *value = room(n * sizeof *value);                                                           \
        return list_or(fmi3Get##type(c, vr, n, value, n), value, n);                                           \
    }                                                                                                          \
    CALL("set-" name)                                                                                          \
    int component_set_##type(fmi3Instance c, const unsigned vr[], size_t n, const fmi3##type value[], size_t m) { \
        return fmi3Set##type(c, vr, n, value, m);                                                              \
    }
VALUES("float32", Float32)
VALUES("float64", Float64)
VALUES("int8", Int8)
VALUES("int16", Int16)
VALUES("int32", Int32)
VALUES("int64", Int64)
VALUES("uint8", UInt8)
VALUES("uint16", UInt16)
VALUES("uint32", UInt32)
VALUES("uint64", UInt64)
VALUES("boolean", Boolean)

/* There are no variables of the other types: a list of none is right, a longer one is refused. */
#define NONE_LIST(name, function, ...)                                                                  \
    CALL("get-" name) const void *component_get_##function(fmi3Instance c, const unsigned vr[], size_t n) { \
        return list_or(fmi3Get##function(c, vr, n, __VA_ARGS__), NULL, 0);                              \
    }
#define NONE_SET(name, function, ...)                                                                   \
    CALL("set-" name)                                                                                   \
    int component_set_##function(fmi3Instance c, const unsigned vr[], size_t n, const void *value, size_t m) { \
        (void)value, (void)m;                                                                           \
        return fmi3Set##function(c, vr, n, __VA_ARGS__);                                                \
    }
NONE_LIST("string", String, NULL, 0)
NONE_LIST("binary", Binary, NULL, NULL, 0)
NONE_LIST("clock", Clock, NULL)
NONE_LIST("interval-decimal", IntervalDecimal, NULL, NULL)
NONE_LIST("interval-fraction", IntervalFraction, NULL, NULL, NULL)
NONE_LIST("shift-decimal", ShiftDecimal, NULL)
NONE_LIST("shift-fraction", ShiftFraction, NULL, NULL)
NONE_SET("string", String, NULL, 0)
NONE_SET("binary", Binary, NULL, NULL, 0)
NONE_SET("clock", Clock, NULL)
NONE_SET("interval-decimal", IntervalDecimal, NULL)
NONE_SET("interval-fraction", IntervalFraction, NULL, NULL)
NONE_SET("shift-decimal", ShiftDecimal, NULL)
NONE_SET("shift-fraction", ShiftFraction, NULL, NULL)

CALL("get-number-of-variable-dependencies") const void *component_dependencies(fmi3Instance c, unsigned vr) {
    return number_or(fmi3GetNumberOfVariableDependencies(c, vr, NULL), 0);
}

CALL("get-variable-dependencies") const void *component_dependency_list(fmi3Instance c, unsigned vr) {
    return list_or(fmi3GetVariableDependencies(c, vr, NULL, NULL, NULL, NULL, 0), NULL, 0);
}

CALL("get-fmu-state") const void *component_state(fmi3Instance c) {
    fmi3FMUState state = NULL;
    const fmi3Status status = fmi3GetFMUState(c, &state);
    if (status) return list_or(status, NULL, 0);
    const size_t n = state_size(INSTANCE);
    void *bytes = room(n);
    memcpy(bytes, state, n);
    fmi3FreeFMUState(c, &state);
    return list_or(fmi3OK, bytes, n);
}

CALL("set-fmu-state") int component_set_state(fmi3Instance c, const fmi3Byte bytes[], size_t n) {
    fmi3FMUState state = NULL;
    fmi3Status status = fmi3DeserializeFMUState(c, bytes, n, &state);
    if (!status) status = fmi3SetFMUState(c, state);
    fmi3FreeFMUState(c, &state);
    return status;
}

#define DERIVATIVE(name, function)                                                                              \
    CALL(name)                                                                                                  \
    const void *component_##function(fmi3Instance c, const unsigned unknown[], size_t n, const unsigned known[], \
                                     size_t n_known, const double seed[], size_t n_seed) {                      \
        double *value = room(n * sizeof *value);                                                                \
        return list_or(fmi3Get##function(c, unknown, n, known, n_known, seed, n_seed, value, n), value, n);     \
    }
DERIVATIVE("get-directional-derivative", DirectionalDerivative)
DERIVATIVE("get-adjoint-derivative", AdjointDerivative)

CALL("set-input-derivatives")
int component_input_derivatives(fmi3Instance c, const Request request[], size_t n, const double value[], size_t m) {
    (void)request, (void)n, (void)value, (void)m;
    NEED(ANY);
    CHECK(0, "FMI 3.0 has no derivatives of inputs");
}

CALL("get-output-derivatives")
const void *component_output_derivatives(fmi3Instance c, const Request request[], size_t n) {
    unsigned *vr = room(n * sizeof *vr);
    fmi3Int32 *order = room(n * sizeof *order);
    double *value = room(n * sizeof *value);
    for (size_t k = 0; k < n; ++k) vr[k] = request[k].vr, order[k] = (fmi3Int32)request[k].order;
    return list_or(fmi3GetOutputDerivatives(c, vr, n, order, value, n), value, n);
}

/* -- co-simulation */

CALL("do-step") const void *component_step(fmi3Instance c, double time, double size, int no_set) {
    static struct {
        uint64_t failed;
        double last;
        bool event, terminate, early;
    } result;
    const fmi3Status status =
        fmi3DoStep(c, time, size, no_set, &result.event, &result.terminate, &result.early, &result.last);
    return status ? number_or(status, 0) : &result;
}

/* -- model exchange */

CALL("set-time") int component_time(fmi3Instance c, double time) { return fmi3SetTime(c, time); }

CALL("set-continuous-states") int component_set_states(fmi3Instance c, const double x[], size_t n) {
    return fmi3SetContinuousStates(c, x, n);
}

#define STATES(name, function, size)                                         \
    CALL(name) const void *component_##function(fmi3Instance c) {            \
        const size_t n = (size);                                             \
        double *value = room(n * sizeof *value);                             \
        return list_or(fmi3Get##function(c, value, n), value, n);            \
    }
STATES("get-continuous-state-derivatives", ContinuousStateDerivatives, (size_t)model.n_x)
STATES("get-continuous-states", ContinuousStates, (size_t)model.n_x)
STATES("get-nominals-of-continuous-states", NominalsOfContinuousStates, (size_t)model.n_x)
STATES("get-event-indicators", EventIndicators, 0)

#define SIZE_OF(name, function)                                              \
    CALL(name) const void *component_##function(fmi3Instance c) {            \
        size_t n = 0;                                                        \
        const fmi3Status status = fmi3Get##function(c, &n);                  \
        return number_or(status, n);                                         \
    }
SIZE_OF("get-number-of-event-indicators", NumberOfEventIndicators)
SIZE_OF("get-number-of-continuous-states", NumberOfContinuousStates)

CALL("completed-integrator-step") const void *component_completed(fmi3Instance c, int no_set) {
    static struct {
        uint8_t failed, status;
        bool terminate;
    } result;
    bool event = false;
    const fmi3Status status = fmi3CompletedIntegratorStep(c, no_set, &event, &result.terminate);
    result.failed = status != fmi3OK;
    result.status = result.failed ? (uint8_t)status : event;
    return &result;
}
