/* Random calls of the FMI 3.0 functions, good and bad, as fuzz2.c does it for FMI 2.0. */
#include "fuzz.h"

#include "fmi3Functions.h"
#include "model.h"

static void logger(fmi3InstanceEnvironment e, fmi3Status s, fmi3String c, fmi3String m) {
    (void)e, (void)s, (void)c;
    messages += m && strlen(m) > 0;
}

int main(int argc, char **argv) {
    const long calls = argc > 1 ? atol(argv[1]) : 1000000;
    enum { N = 4, MOST = 128 };
    fmi3Instance instance[N] = {0};
    fmi3FMUState state[N] = {0};
    const unsigned references = (unsigned)(model.n_p + model.n_u + 2 * model.n_x + model.n_y + 3);
    fmi3ValueReference vr[MOST], known[MOST];
    double value[MOST], x[MOST];
    fmi3Byte *bytes = NULL;
    size_t size = 0;
    for (long k = 0; k < calls; ++k) {
        const unsigned i = random_below(N);
        fmi3Instance c = instance[i];
        size_t n = random_below(random_below(10) ? 5 : MOST);
        const size_t m = random_below(20) ? n : random_below(MOST); /* a wrong number of values now and then */
        fmi3Int32 order[MOST];
        for (size_t j = 0; j < n; ++j) {
            vr[j] = random_below(50) ? random_below(references) : 4000000000u + random_below(1000);
            known[j] = random_below(20) ? (unsigned)model.n_p + random_below((unsigned)(model.n_u + model.n_x)) : vr[j];
            value[j] = random_value();
            order[j] = random_below(20) ? 1 : 2;
        }
        const size_t n_x = random_below(20) ? (size_t)model.n_x : n;
        fmi3Status s = fmi3OK;
        fmi3Boolean a, b, d, e, f;
        double last;
        switch (random_below(c ? 36 : 1)) {
        case 0:
            if (!c) {
                const int wrong = !random_below(20);
                const char *token = wrong ? random_below(2) ? "no" : NULL : model.token;
                const char *name = random_below(20) ? "unit" : random_below(2) ? "" : NULL;
                instance[i] = random_below(2) ? fmi3InstantiateModelExchange(name, token, NULL, 0, 1, NULL, logger)
                                              : fmi3InstantiateCoSimulation(name, token, NULL, 0, 1, 0, 0, NULL, 0, NULL,
                                                                            logger, NULL);
                if (wrong && instance[i]) return puts("a wrong token was taken"), 1;
            } else if (!random_below(20)) {
                fmi3FreeFMUState(c, &state[i]);
                fmi3FreeInstance(c);
                instance[i] = NULL;
            }
            break;
        case 1: case 2: case 3: s = fmi3EnterInitializationMode(c, 0, 0.0, random_value(), 0, 0.0); break;
        case 4: case 5: s = fmi3ExitInitializationMode(c); break;
        case 6: if (!random_below(10)) s = fmi3Terminate(c); break;
        case 7: if (!random_below(5)) s = fmi3Reset(c); break;
        case 8: case 9: case 10: s = fmi3SetFloat64(c, vr, n, value, m); break;
        case 11: case 12: case 13:
            memset(x, 0, sizeof x);
            s = fmi3GetFloat64(c, vr, n, x, m);
            if (s == fmi3OK)
                for (size_t j = 0; j < n; ++j)
                    if (!isfinite(x[j])) return printf("reference %u: %g with status OK\n", vr[j], x[j]), 1;
            break;
        case 14: case 15: case 16:
            s = fmi3DoStep(c, 0.0, random_below(20) ? 1e-3 : random_value(), 1, &a, &b, random_below(20) ? &d : NULL, &last);
            break;
        case 17: s = fmi3GetFMUState(c, &state[i]); break;
        case 18: s = fmi3SetFMUState(c, state[random_below(N)]); break;
        case 19:
            if (state[i] && fmi3SerializedFMUStateSize(c, state[i], &size) == fmi3OK) {
                bytes = realloc(bytes, size);
                s = fmi3SerializeFMUState(c, state[i], bytes, size);
            }
            break;
        case 20:
            if (bytes) {
                if (!random_below(50)) bytes[random_below((unsigned)size)] ^= (fmi3Byte)(1 << random_below(8));
                s = fmi3DeserializeFMUState(c, bytes, random_below(20) ? size : random_below((unsigned)size), &state[i]);
            }
            break;
        case 21: s = fmi3FreeFMUState(c, &state[i]); break;
        case 22: case 23: s = fmi3GetDirectionalDerivative(c, vr, n, known, n, value, m, x, random_below(20) ? n : m); break;
        case 24: s = fmi3EnterEventMode(c); break;
        case 25: s = fmi3UpdateDiscreteStates(c, &a, &b, &d, &e, random_below(20) ? &f : NULL, &last); break;
        case 26: s = fmi3EnterContinuousTimeMode(c); break;
        case 27: s = fmi3CompletedIntegratorStep(c, 1, &a, random_below(20) ? &b : NULL); break;
        case 28: s = fmi3SetTime(c, random_value()); break;
        case 29:
            for (int j = 0; j < MOST; ++j) x[j] = random_below(50) ? 1.0 : random_value();
            s = fmi3SetContinuousStates(c, x, n_x);
            break;
        case 30: s = fmi3GetContinuousStateDerivatives(c, x, n_x); break;
        case 31: s = fmi3GetContinuousStates(c, x, n_x); break;
        case 32: s = fmi3GetOutputDerivatives(c, vr, n, order, x, m); break;
        case 33: s = random_below(2) ? fmi3EnterStepMode(c) : fmi3EvaluateDiscreteStates(c); break;
        case 34:
            s = random_below(2) ? fmi3GetNominalsOfContinuousStates(c, x, n_x) : fmi3GetEventIndicators(c, x, n);
            break;
        default:
            s = random_below(2) ? fmi3GetFloat64(c, NULL, n, NULL, n) : fmi3SetFloat64(c, NULL, n, NULL, n);
            fmi3GetInt32(c, vr, n, order, n);
            fmi3GetAdjointDerivative(c, vr, n, known, n, value, n, x, n);
            fmi3GetNumberOfContinuousStates(c, random_below(2) ? &size : NULL);
            if (bytes) size = 0, free(bytes), bytes = NULL;
        }
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
