/* Random calls of the FMI 3.0 functions, good and bad, as fuzz2.c does it for FMI 2.0. */
#define FAILED fmi3Error
#include "fuzz.h"

#include "fmi3Functions.h"

static void logger(fmi3InstanceEnvironment e, fmi3Status s, fmi3String c, fmi3String m) {
    (void)e, (void)s, (void)c;
    messages += m && strlen(m) > 0;
}

int main(int argc, char **argv) {
    const long calls = argc > 1 ? atol(argv[1]) : 1000000;
    enum { N = 4, MOST = 128 };
    int hears[N] = {0}; /* has a logger */
    fmi3Instance instance[N] = {0};
    fmi3FMUState state[N] = {0};
    const unsigned references = (unsigned)(model.n_p + model.n_u + 2 * model.n_x + model.n_y + 3);
    fmi3ValueReference vr[MOST], known[MOST];
    double value[MOST], x[MOST];
    fmi3Byte *bytes = NULL;
    size_t size = 0;
    for (long k = 0; k < calls; ++k) {
        const unsigned i = random_below(N);
        fmi3Instance c = instance[i], alive = c;
        if (!random_below(100)) c = NULL; /* a host that lost it */
        size_t n = random_below(random_below(10) ? 5 : MOST);
        const size_t m = random_below(20) ? n : random_below(MOST); /* a wrong number of values now and then */
        fmi3Int32 order[MOST];
        for (size_t j = 0; j < n; ++j) {
            vr[j] = random_below(50) ? random_below(references) : 0x7fffff00u + random_below(512);
            known[j] = random_below(20) ? (unsigned)model.n_p + random_below((unsigned)(model.n_u + model.n_x)) : vr[j];
            value[j] = random_value();
            order[j] = random_below(20) ? 1 : 2;
        }
        const size_t n_x = random_below(20) ? (size_t)model.n_x : n;
        fmi3Status s = fmi3OK;
        fmi3Boolean a, b, d, e, f;
        double last;
        const fmi3ValueReference clock = references - 3; /* the time, which stands behind all others */
        double time = 0.0;
        fmi3IntervalQualifier qualifier[MOST];
        fmi3UInt64 counter[MOST] = {0}, resolution[MOST] = {0};
        fmi3Clock ticks[MOST] = {0};
        fmi3Binary binary[MOST] = {0};
        fmi3String text[MOST] = {0}, category[1] = {"logAll"};
        fmi3DependencyKind dependency[MOST];
        size_t sizes[MOST] = {0};
        double room[MOST] = {0}; /* of the size of any other type, too */
        scarce = !random_below(20);
        switch (random_below(alive ? 45 : 1)) {
        case 0:
            if (!alive) {
                const int wrong = !random_below(20);
                const char *token = wrong ? random_below(2) ? "no" : NULL : model.guid;
                const char *name = random_below(20) ? "unit" : random_below(2) ? "" : NULL;
                hears[i] = random_below(10) > 0;
                const fmi3LogMessageCallback log = hears[i] ? logger : NULL;
                instance[i] = random_below(2) ? fmi3InstantiateModelExchange(name, token, NULL, 0, 1, NULL, log)
                                              : fmi3InstantiateCoSimulation(name, token, NULL, 0, 1, 0, 0, NULL, 0, NULL,
                                                                            log, NULL);
                if (fmi3InstantiateScheduledExecution(name, token, NULL, 0, 1, NULL, log, NULL, NULL, NULL)) return 1;
                if (wrong && instance[i]) return puts("a wrong token was taken"), 1;
            } else if (!random_below(20)) {
                fmi3FreeFMUState(alive, &state[i]);
                fmi3FreeInstance(alive);
                fmi3FreeInstance(NULL);
                instance[i] = NULL;
            }
            break;
        case 1: case 2: case 3:
            TRY(fmi3EnterInitializationMode(c, 0, 0.0, random_below(4) ? 0.0 : random_value(), random_below(2), random_value()));
            break;
        case 4: case 5: TRY(fmi3ExitInitializationMode(c)); break;
        case 6: if (!random_below(10)) TRY(fmi3Terminate(c)); break;
        case 7: if (!random_below(5)) TRY(fmi3Reset(c)); break;
        case 8: case 9: case 10: TRY(fmi3SetFloat64(c, MAYBE(vr), n, MAYBE(value), m)); break;
        case 11: case 12: case 13:
            memset(x, 0, sizeof x);
            TRY(fmi3GetFloat64(c, MAYBE(vr), n, MAYBE(x), m));
            if (s == fmi3OK)
                for (size_t j = 0; j < n; ++j)
                    if (!isfinite(x[j])) return printf("reference %u: %g with status OK\n", vr[j], x[j]), 1;
            break;
        case 14: case 15: case 16:
            fmi3GetFloat64(alive, &clock, 1, &time, 1);
            TRY(fmi3DoStep(c, random_below(20) ? time : random_value(), random_below(10) ? 1e-3 : random_value(), 1, MAYBE(&a), MAYBE(&b),
                           MAYBE(&d), MAYBE(&last)));
            break;
        case 17:
            TRY(fmi3GetFMUState(c, MAYBE(&state[i])));
            if (c && s == fmi3OK && fmi3SetFMUState(c, state[i]) != fmi3OK) return puts("its own state was refused"), 1;
            break;
        case 18: TRY(fmi3SetFMUState(c, state[random_below(N)])); break;
        case 19:
            if (state[i] && fmi3SerializedFMUStateSize(alive, state[i], &size) == fmi3OK) {
                bytes = realloc(bytes, size);
                memset(bytes, 0, size);
                TRY(fmi3SerializeFMUState(c, MAYBE(state[i]), MAYBE(bytes), random_below(50) ? size : size - 1));
            }
            break;
        case 20:
            if (bytes) {
                const int damaged = !random_below(10) && flipped(bytes, size);
                TRY(fmi3DeserializeFMUState(c, MAYBE(bytes), random_below(20) ? size : random_below((unsigned)size),
                                            MAYBE(&state[i])));
                if (damaged && s == fmi3OK) return puts("a damaged state was taken"), 1;
                if (damaged) free(bytes), bytes = NULL;
            }
            break;
        case 21: TRY(fmi3FreeFMUState(c, MAYBE(&state[i]))); break;
        case 22: case 23: TRY(fmi3GetDirectionalDerivative(c, MAYBE(vr), n, MAYBE(known), n, MAYBE(value), m, MAYBE(x), random_below(20) ? n : m)); break;
        case 24: TRY(fmi3EnterEventMode(c)); break;
        case 25: TRY(fmi3UpdateDiscreteStates(c, MAYBE(&a), MAYBE(&b), MAYBE(&d), MAYBE(&e), MAYBE(&f), MAYBE(&last))); break;
        case 26: TRY(fmi3EnterContinuousTimeMode(c)); break;
        case 27: TRY(fmi3CompletedIntegratorStep(c, 1, MAYBE(&a), MAYBE(&b))); break;
        case 28: TRY(fmi3SetTime(c, random_value())); break;
        case 29:
            for (int j = 0; j < MOST; ++j) x[j] = random_below(50) ? 1.0 : random_value();
            TRY(fmi3SetContinuousStates(c, MAYBE(x), n_x));
            break;
        case 30: TRY(fmi3GetContinuousStateDerivatives(c, MAYBE(x), n_x)); break;
        case 31: TRY(fmi3GetContinuousStates(c, MAYBE(x), n_x)); break;
        case 32: TRY(fmi3GetOutputDerivatives(c, MAYBE(vr), n, MAYBE(order), MAYBE(x), m)); break;
        case 33: TRY(random_below(2) ? fmi3EnterStepMode(c) : fmi3EvaluateDiscreteStates(c)); break;
        case 34:
            TRY(random_below(2) ? fmi3GetNominalsOfContinuousStates(c, x, n_x) : fmi3GetEventIndicators(c, x, n));
            break;
#define TYPE(number, type) \
    case number: TRY(random_below(2) ? fmi3Get##type(c, vr, n, (void *)room, n) : fmi3Set##type(c, vr, n, (void *)room, n)); break
        TYPE(35, Float32);
        TYPE(36, Int8);
        TYPE(37, UInt8);
        TYPE(38, Int16);
        TYPE(39, UInt16);
        case 40: {
            fmi3Boolean truth[MOST] = {0};
            fmi3Int32 number[MOST];
            for (size_t j = 0; j < n; ++j) {
                vr[j] = random_of(random_below(2) ? INTEGER : BOOLEAN, vr[j]);
                number[j] = random_integer(), truth[j] = random_below(2);
            }
            TRY(random_below(2) ? fmi3GetInt32(c, MAYBE(vr), n, MAYBE(number), m) : fmi3SetInt32(c, MAYBE(vr), n, MAYBE(number), m));
            TRY(random_below(2) ? fmi3GetBoolean(c, MAYBE(vr), n, MAYBE(truth), m) : fmi3SetBoolean(c, MAYBE(vr), n, MAYBE(truth), m));
            if (n) {
                vr[0] = random_of(INTEGER, vr[0]);
                TRY(random_below(2) ? fmi3GetInt32(c, vr, 1, number, 1) : fmi3SetInt32(c, vr, 1, number, 1));
                vr[0] = random_of(BOOLEAN, vr[0]);
                TRY(random_below(2) ? fmi3GetBoolean(c, vr, 1, truth, 1) : fmi3SetBoolean(c, vr, 1, truth, 1));
            }
            break;
        }
        TYPE(41, UInt32);
        case 42:
            TRY(random_below(2) ? fmi3GetInt64(c, vr, n, (void *)room, n) : fmi3SetInt64(c, vr, n, (void *)room, n));
            fmi3GetUInt64(c, vr, n, counter, n), fmi3SetUInt64(c, vr, n, counter, n);
            fmi3GetString(c, vr, n, text, n), fmi3SetString(c, vr, n, text, n);
            fmi3GetBinary(c, vr, n, sizes, binary, n), fmi3SetBinary(c, vr, n, sizes, binary, n);
            break;
        case 43:
            TRY(random_below(2) ? fmi3GetClock(c, vr, n, ticks) : fmi3SetClock(c, vr, n, ticks));
            fmi3GetIntervalDecimal(c, vr, n, x, qualifier), fmi3SetIntervalDecimal(c, vr, n, x);
            fmi3GetIntervalFraction(c, vr, n, counter, resolution, qualifier);
            fmi3SetIntervalFraction(c, vr, n, counter, resolution);
            fmi3GetShiftDecimal(c, vr, n, x), fmi3SetShiftDecimal(c, vr, n, x);
            fmi3GetShiftFraction(c, vr, n, counter, resolution), fmi3SetShiftFraction(c, vr, n, counter, resolution);
            fmi3ActivateModelPartition(c, vr[0], 0.0);
            break;
        case 44:
            TRY(fmi3SetDebugLogging(c, random_below(2), random_below(2), category));
            fmi3GetAdjointDerivative(c, vr, n, known, n, value, n, x, n);
            fmi3GetNumberOfVariableDependencies(c, 0, sizes);
            fmi3GetVariableDependencies(c, 0, sizes, vr, sizes, dependency, n);
            fmi3EnterConfigurationMode(c), fmi3ExitConfigurationMode(c);
            break;
        default:
            TRY(random_below(2) ? fmi3GetFloat64(c, NULL, n, NULL, n) : fmi3SetFloat64(c, NULL, n, NULL, n));
            fmi3GetNumberOfContinuousStates(c, MAYBE(sizes));
            fmi3SerializedFMUStateSize(c, MAYBE(state[i]), MAYBE(&size));
            fmi3GetNumberOfEventIndicators(c, MAYBE(sizes));
            if (strcmp(fmi3GetVersion(), "3.0")) return 1;
        }
        scarce = 0;
        ++count[s == fmi3OK ? 0 : s == fmi3Discard ? 1 : s == fmi3Error ? 2 : 3];
    }
    for (int i = 0; i < N; ++i) {
        if (instance[i]) fmi3FreeFMUState(instance[i], &state[i]);
        else free(state[i]);
        fmi3FreeInstance(instance[i]);
    }
    free(bytes);
    return counted(calls);
}
