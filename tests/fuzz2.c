/* Random calls of every FMI 2.0 function, good and bad, against the sources of an FMU; built with AddressSanitizer and
 * UndefinedBehaviorSanitizer. Ends with 0 where nothing was touched that must not be. */
#define FAILED fmi2Error
#include "fuzz.h"

#include "fmi2Functions.h"

static void logger(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)s, (void)c;
    messages += n && m && strlen(m) > 0;
}

int main(int argc, char **argv) {
    const long calls = argc > 1 ? atol(argv[1]) : 1000000;
    enum { N = 4, MOST = 128 };
    int hears[N] = {0}; /* has a logger */
    fmi2Component instance[N] = {0};
    fmi2FMUstate state[N] = {0};
    const int references = model.n_p + model.n_u + 2 * model.n_x + model.n_y + 3;
    fmi2ValueReference vr[MOST], known[MOST];
    double value[MOST], sense[MOST];
    char *bytes = NULL;
    size_t size = 0;
    for (long k = 0; k < calls; ++k) {
        const unsigned i = random_below(N);
        fmi2Component c = instance[i], alive = c;
        if (!random_below(100)) c = NULL; /* a host that lost it */
        size_t n = random_below(random_below(10) ? 5 : MOST);
        for (size_t j = 0; j < n; ++j) {
            vr[j] = random_below(50) ? random_below((unsigned)references) : 0x7fffff00u + random_below(512);
            known[j] = random_below(20) ? (unsigned)model.n_p + random_below((unsigned)(model.n_u + model.n_x)) : vr[j];
            value[j] = random_value();
        }
        fmi2Status s = fmi2OK;
        fmi2EventInfo info;
        fmi2Boolean a, b;
        double x[MOST];
        fmi2Integer order[MOST], number[MOST] = {0};
        fmi2String text[MOST] = {0}, category[1] = {"logAll"}, said;
        fmi2Status kind;
        const fmi2StatusKind asked = (fmi2StatusKind)random_below(4);
        double time = 0.0;
        for (size_t j = 0; j < n; ++j) order[j] = random_below(20) ? 1 : 2;
        scarce = !random_below(20);
        switch (random_below(alive ? 44 : 1)) {
        case 0:
            if (!alive) {
                const int wrong = !random_below(20);
                /* gone after the call: the FMU must not keep its address */
                hears[i] = random_below(10) > 0;
                fmi2CallbackFunctions lent = {hears[i] ? logger : NULL, calloc, free, NULL, NULL};
                instance[i] = fmi2Instantiate(random_below(20) ? "unit" : random_below(2) ? "" : NULL,
                                              random_below(2) ? fmi2CoSimulation : fmi2ModelExchange,
                                              wrong ? random_below(2) ? "no" : NULL : model.guid, NULL,
                                              random_below(20) ? &lent : NULL, 0, 1);
                memset(&lent, 0, sizeof lent);
                if (wrong && instance[i]) return puts("a wrong GUID was taken"), 1;
            } else if (!random_below(20)) {
                fmi2FreeFMUstate(alive, &state[i]);
                fmi2FreeInstance(alive);
                fmi2FreeInstance(NULL);
                instance[i] = NULL;
            }
            break;
        case 1: TRY(fmi2SetupExperiment(c, 0, 0.0, random_below(4) ? 0.0 : random_value(), random_below(2), random_value())); break;
        case 2: case 3: TRY(fmi2EnterInitializationMode(c)); break;
        case 4: case 5: TRY(fmi2ExitInitializationMode(c)); break;
        case 6: if (!random_below(10)) TRY(fmi2Terminate(c)); break;
        case 7: if (!random_below(5)) TRY(fmi2Reset(c)); break;
        case 8: case 9: case 10: TRY(fmi2SetReal(c, MAYBE(vr), n, MAYBE(value))); break;
        case 11: case 12: case 13:
            memset(x, 0, sizeof x);
            TRY(fmi2GetReal(c, MAYBE(vr), n, MAYBE(x)));
            if (s == fmi2OK)
                for (size_t j = 0; j < n; ++j)
                    if (!isfinite(x[j])) return printf("reference %u: %g with status OK\n", vr[j], x[j]), 1;
            break;
        case 14: case 15:
            fmi2GetRealStatus(alive, fmi2LastSuccessfulTime, &time);
            TRY(fmi2DoStep(c, random_below(20) ? time : random_value(), random_below(10) ? 1e-3 : random_value(), 1));
            break;
        case 16:
            TRY(fmi2GetFMUstate(c, MAYBE(&state[i])));
            if (c && s == fmi2OK && fmi2SetFMUstate(c, state[i]) != fmi2OK) return puts("its own state was refused"), 1;
            break;
        case 17: TRY(fmi2SetFMUstate(c, state[random_below(N)])); break;
        case 18:
            if (state[i] && fmi2SerializedFMUstateSize(alive, state[i], &size) == fmi2OK) {
                bytes = realloc(bytes, size);
                memset(bytes, 0, size);
                TRY(fmi2SerializeFMUstate(c, MAYBE(state[i]), MAYBE(bytes), random_below(50) ? size : size - 1));
            }
            break;
        case 19:
            if (bytes) {
                const int damaged = !random_below(10) && flipped((unsigned char *)bytes, size);
                TRY(fmi2DeSerializeFMUstate(c, MAYBE(bytes), random_below(20) ? size : random_below((unsigned)size),
                                            MAYBE(&state[i])));
                if (damaged && s == fmi2OK) return puts("a damaged state was taken"), 1;
                if (damaged) free(bytes), bytes = NULL;
            }
            break;
        case 20: TRY(fmi2FreeFMUstate(c, MAYBE(&state[i]))); break;
        case 21: case 22: TRY(fmi2GetDirectionalDerivative(c, MAYBE(vr), n, MAYBE(known), n, MAYBE(value), MAYBE(sense))); break;
        case 23: TRY(fmi2EnterEventMode(c)); break;
        case 24: TRY(fmi2NewDiscreteStates(c, MAYBE(&info))); break;
        case 25: TRY(fmi2EnterContinuousTimeMode(c)); break;
        case 26: TRY(fmi2CompletedIntegratorStep(c, 1, MAYBE(&a), MAYBE(&b))); break;
        case 27: TRY(fmi2SetTime(c, random_value())); break;
        case 28:
            for (int j = 0; j < MOST; ++j) x[j] = random_below(50) ? 1.0 : random_value();
            TRY(fmi2SetContinuousStates(c, MAYBE(x), random_below(20) ? (size_t)model.n_x : n));
            break;
        case 29: TRY(fmi2GetDerivatives(c, MAYBE(x), random_below(20) ? (size_t)model.n_x : n)); break;
        case 30: TRY(fmi2GetContinuousStates(c, MAYBE(x), random_below(20) ? (size_t)model.n_x : n)); break;
        case 31: TRY(fmi2SetRealInputDerivatives(c, MAYBE(known), n, MAYBE(order), MAYBE(value))); break;
        case 32: TRY(fmi2GetRealOutputDerivatives(c, MAYBE(vr), n, MAYBE(order), MAYBE(x))); break;
        case 33: TRY(fmi2CancelStep(c)); break;
        case 34: TRY(fmi2GetStatus(c, asked, &kind)); break;
        case 35: TRY(fmi2GetRealStatus(c, asked, MAYBE(x))); break;
        case 36: TRY(fmi2GetIntegerStatus(c, asked, number)); break;
        case 37: TRY(fmi2GetBooleanStatus(c, asked, MAYBE(&a))); break;
        case 38: TRY(fmi2GetStringStatus(c, asked, &said)); break;
        case 39: TRY(fmi2SetDebugLogging(c, random_below(2), random_below(2), category)); break;
        case 40: case 41:
            for (size_t j = 0; j < n; ++j) vr[j] = random_of(random_below(2) ? INTEGER : BOOLEAN, vr[j]), number[j] = random_integer();
            TRY(random_below(2) ? fmi2GetInteger(c, MAYBE(vr), n, MAYBE(number)) : fmi2SetInteger(c, MAYBE(vr), n, MAYBE(number)));
            TRY(random_below(2) ? fmi2GetBoolean(c, MAYBE(vr), n, MAYBE(number)) : fmi2SetBoolean(c, MAYBE(vr), n, MAYBE(number)));
            if (n) {
                vr[0] = random_of(INTEGER, vr[0]);
                TRY(random_below(2) ? fmi2GetInteger(c, vr, 1, number) : fmi2SetInteger(c, vr, 1, number));
                vr[0] = random_of(BOOLEAN, vr[0]);
                TRY(random_below(2) ? fmi2GetBoolean(c, vr, 1, number) : fmi2SetBoolean(c, vr, 1, number));
            }
            break;
        case 42: TRY(random_below(2) ? fmi2GetString(c, vr, n, text) : fmi2SetString(c, vr, n, text)); break;
        default:
            TRY(random_below(2) ? fmi2GetReal(c, NULL, n, NULL) : fmi2SetReal(c, NULL, n, NULL));
            fmi2GetNominalsOfContinuousStates(c, x, (size_t)model.n_x);
            fmi2GetEventIndicators(c, x, random_below(2));
            fmi2SerializedFMUstateSize(c, MAYBE(state[i]), MAYBE(&size));
            if (strcmp(fmi2GetVersion(), "2.0") || strcmp(fmi2GetTypesPlatform(), "default")) return 1;
        }
        scarce = 0;
        ++count[s == fmi2OK ? 0 : s == fmi2Discard ? 1 : s == fmi2Error ? 2 : 3];
    }
    for (int i = 0; i < N; ++i) {
        if (instance[i]) fmi2FreeFMUstate(instance[i], &state[i]);
        else free(state[i]);
        fmi2FreeInstance(instance[i]);
    }
    free(bytes);
    return counted(calls);
}
