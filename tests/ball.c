/* A ball that falls and bounces, as an FMU 2.0 for Model Exchange: a state event where it meets the ground, and a time
 * event at 1.05 s, when it is kicked upwards by 2 m/s. */
#include <stdlib.h>

#include "fmi2Functions.h"

#define KICK 1.05
#define BOUNCE 0.8

enum { H, V, DER_H, DER_V, G };

typedef struct {
    double time, x[2], g;
    int kicked;
} Ball;

#define BALL ((Ball *)c)

static double value(const Ball *b, fmi2ValueReference r) {
    return r == H ? b->x[0] : r == V || r == DER_H ? b->x[1] : r == DER_V ? -b->g : b->g;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)functions, (void)visible, (void)logging;
    Ball *b = calloc(1, sizeof *b);
    b->x[0] = 1.0;
    b->g = 9.81;
    return b;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real y[]) {
    for (size_t i = 0; i < n; ++i) y[i] = value(BALL, r[i]);
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real y[]) {
    for (size_t i = 0; i < n; ++i) {
        if (r[i] != G) return fmi2Error;
        BALL->g = y[i];
    }
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) {
    BALL->time = t;
    return fmi2OK;
}
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    for (size_t i = 0; i < n; ++i) BALL->x[i] = x[i];
    return fmi2OK;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    for (size_t i = 0; i < n; ++i) x[i] = BALL->x[i];
    return fmi2OK;
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; ++i) x[i] = 1.0;
    return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    (void)n;
    dx[0] = BALL->x[1];
    dx[1] = -BALL->g;
    return fmi2OK;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    (void)n;
    z[0] = BALL->x[0];
    return fmi2OK;
}
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *event, fmi2Boolean *ends) {
    (void)c, (void)no_set;
    *event = *ends = fmi2False;
    return fmi2OK;
}
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    Ball *b = c;
    *info = (fmi2EventInfo){0};
    if (b->x[0] <= 0.0 && b->x[1] < 0.0) {
        b->x[0] = 0.0;
        b->x[1] *= -BOUNCE;
        info->valuesOfContinuousStatesChanged = fmi2True;
    }
    if (!b->kicked && b->time >= KICK) {
        b->kicked = 1;
        b->x[1] += 2.0;
        info->valuesOfContinuousStatesChanged = fmi2True;
    }
    info->nextEventTimeDefined = !b->kicked;
    info->nextEventTime = KICK;
    return fmi2OK;
}

/* what needs nothing to be done */
#define NOTHING(name) \
    fmi2Status name(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
NOTHING(fmi2EnterInitializationMode)
NOTHING(fmi2ExitInitializationMode)
NOTHING(fmi2Terminate)
NOTHING(fmi2Reset)
NOTHING(fmi2EnterEventMode)
NOTHING(fmi2EnterContinuousTimeMode)

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real t, fmi2Boolean d, fmi2Real e) {
    (void)a, (void)b, (void)d, (void)e;
    BALL->time = t;
    return fmi2OK;
}

/* what it has not */
#define NO_SUCH(name, ...) \
    fmi2Status name(__VA_ARGS__) { return fmi2Error; }
#define VALUES fmi2Component c, const fmi2ValueReference r[], size_t n
NO_SUCH(fmi2SetDebugLogging, fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
NO_SUCH(fmi2GetInteger, VALUES, fmi2Integer y[])
NO_SUCH(fmi2GetBoolean, VALUES, fmi2Boolean y[])
NO_SUCH(fmi2GetString, VALUES, fmi2String y[])
NO_SUCH(fmi2SetInteger, VALUES, const fmi2Integer y[])
NO_SUCH(fmi2SetBoolean, VALUES, const fmi2Boolean y[])
NO_SUCH(fmi2SetString, VALUES, const fmi2String y[])
NO_SUCH(fmi2GetFMUstate, fmi2Component c, fmi2FMUstate *s)
NO_SUCH(fmi2SetFMUstate, fmi2Component c, fmi2FMUstate s)
NO_SUCH(fmi2FreeFMUstate, fmi2Component c, fmi2FMUstate *s)
NO_SUCH(fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate s, size_t *n)
NO_SUCH(fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n)
NO_SUCH(fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
NO_SUCH(fmi2GetDirectionalDerivative, VALUES, const fmi2ValueReference k[], size_t m, const fmi2Real d[], fmi2Real y[])
