/* Random calls of every FMI 2.0 function, good and bad, against the sources of an FMU; built with AddressSanitizer and
 * UndefinedBehaviorSanitizer. Ends with 0 where nothing was touched that must not be. */
#include "fuzz.h"

#include "fmi2Functions.h"
#include "model.h"

static void logger(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)s, (void)c;
    messages += n && m && strlen(m) > 0;
}

int main(int argc, char **argv) {
    const long calls = argc > 1 ? atol(argv[1]) : 1000000;
    const fmi2CallbackFunctions functions = {logger, calloc, free, NULL, NULL};
    enum { N = 4, MOST = 128 };
    fmi2Component instance[N] = {0};
    fmi2FMUstate state[N] = {0};
    const int references = model.n_p + model.n_u + 2 * model.n_x + model.n_y + 3;
    fmi2ValueReference vr[MOST], known[MOST];
    double value[MOST], sense[MOST];
    char *bytes = NULL;
    size_t size = 0;
    for (long k = 0; k < calls; ++k) {
        const unsigned i = random_below(N);
        fmi2Component c = instance[i];
        size_t n = random_below(random_below(10) ? 5 : MOST);
        for (size_t j = 0; j < n; ++j) {
            vr[j] = random_below(50) ? random_below((unsigned)references) : 4000000000u + random_below(1000);
            known[j] = random_below(20) ? (unsigned)model.n_p + random_below((unsigned)(model.n_u + model.n_x)) : vr[j];
            value[j] = random_value();
        }
        fmi2Status s = fmi2OK;
        fmi2EventInfo info;
        fmi2Boolean a, b;
        double x[MOST];
        fmi2Integer order[MOST];
        for (size_t j = 0; j < n; ++j) order[j] = random_below(20) ? 1 : 2;
        switch (random_below(c ? 34 : 1)) {
        case 0:
            if (!c) {
                const int wrong = !random_below(20);
                instance[i] = fmi2Instantiate(random_below(20) ? "unit" : random_below(2) ? "" : NULL,
                                              random_below(2) ? fmi2CoSimulation : fmi2ModelExchange,
                                              wrong ? random_below(2) ? "no" : NULL : model.guid, NULL, &functions, 0, 1);
                if (wrong && instance[i]) return puts("a wrong GUID was taken"), 1;
            } else if (!random_below(20)) {
                fmi2FreeFMUstate(c, &state[i]);
                fmi2FreeInstance(c);
                instance[i] = NULL;
            }
            break;
        case 1: s = fmi2SetupExperiment(c, 0, 0.0, random_value(), 0, 0.0); break;
        case 2: case 3: s = fmi2EnterInitializationMode(c); break;
        case 4: case 5: s = fmi2ExitInitializationMode(c); break;
        case 6: if (!random_below(10)) s = fmi2Terminate(c); break;
        case 7: if (!random_below(5)) s = fmi2Reset(c); break;
        case 8: case 9: case 10: s = fmi2SetReal(c, vr, n, value); break;
        case 11: case 12: case 13:
            memset(x, 0, sizeof x);
            s = fmi2GetReal(c, vr, n, x);
            if (s == fmi2OK)
                for (size_t j = 0; j < n; ++j)
                    if (!isfinite(x[j])) return printf("reference %u: %g with status OK\n", vr[j], x[j]), 1;
            break;
        case 14: case 15: s = fmi2DoStep(c, 0.0, random_below(20) ? 1e-3 : random_value(), 1); break;
        case 16: s = fmi2GetFMUstate(c, &state[i]); break;
        case 17: s = fmi2SetFMUstate(c, state[random_below(N)]); break;
        case 18:
            if (state[i] && fmi2SerializedFMUstateSize(c, state[i], &size) == fmi2OK) {
                bytes = realloc(bytes, size);
                s = fmi2SerializeFMUstate(c, state[i], bytes, size);
            }
            break;
        case 19:
            if (bytes) {
                if (!random_below(50)) bytes[random_below((unsigned)size)] ^= 1 << random_below(8);
                s = fmi2DeSerializeFMUstate(c, bytes, random_below(20) ? size : random_below((unsigned)size), &state[i]);
            }
            break;
        case 20: s = fmi2FreeFMUstate(c, &state[i]); break;
        case 21: case 22: s = fmi2GetDirectionalDerivative(c, vr, n, known, n, value, sense); break;
        case 23: s = fmi2EnterEventMode(c); break;
        case 24: s = fmi2NewDiscreteStates(c, random_below(20) ? &info : NULL); break;
        case 25: s = fmi2EnterContinuousTimeMode(c); break;
        case 26: s = fmi2CompletedIntegratorStep(c, 1, &a, random_below(20) ? &b : NULL); break;
        case 27: s = fmi2SetTime(c, random_value()); break;
        case 28:
            for (int j = 0; j < MOST; ++j) x[j] = random_below(50) ? 1.0 : random_value();
            s = fmi2SetContinuousStates(c, x, random_below(20) ? (size_t)model.n_x : n);
            break;
        case 29: s = fmi2GetDerivatives(c, x, random_below(20) ? (size_t)model.n_x : n); break;
        case 30: s = fmi2GetContinuousStates(c, x, random_below(20) ? (size_t)model.n_x : n); break;
        case 31: s = fmi2SetRealInputDerivatives(c, known, n, order, value); break;
        case 32: s = fmi2GetRealOutputDerivatives(c, vr, n, order, x); break;
        default:
            s = random_below(2) ? fmi2GetReal(c, NULL, n, NULL) : fmi2SetReal(c, NULL, n, NULL);
            fmi2GetInteger(c, vr, n, order);
            fmi2GetRealStatus(c, fmi2LastSuccessfulTime, random_below(2) ? x : NULL);
        }
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
