/* Cost of a native FMU from a C loop, beside the bare kernel of the same build: nanoseconds a call, least of several
 * rounds, all in one run. Compiled together with the sources of an FMI 2.0 FMU. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"
#include "model.h"

enum { CALLS = 200000, ROUNDS = 9 };

static void logger(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)n, (void)s, (void)c;
    fprintf(stderr, "%s\n", m);
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

int main(int argc, char **argv) {
    const fmi2CallbackFunctions functions = {logger, calloc, free, NULL, NULL};
    fmi2Component c = fmi2Instantiate("unit", fmi2CoSimulation, model.guid, NULL, &functions, 0, 1);
    if (!c || fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) || fmi2EnterInitializationMode(c) || fmi2ExitInitializationMode(c))
        return 1;
    /* the first inputs (phi, w, a) move; value references by argument */
    enum { MOST = 256 };
    fmi2ValueReference in[3], all[MOST], port[8];
    const size_t n_all = (size_t)model.n_y, n_port = (size_t)argc - 4;
    if (argc < 5 || n_all > MOST || n_port > 8) return 1;
    for (int i = 0; i < 3; ++i) in[i] = (fmi2ValueReference)atoi(argv[1 + i]);
    for (size_t i = 0; i < n_port; ++i) port[i] = (fmi2ValueReference)atoi(argv[4 + i]);
    for (size_t i = 0; i < n_all; ++i) all[i] = (fmi2ValueReference)(model.n_p + model.n_u + model.n_x) + (unsigned)i;
    double *p = malloc((size_t)(model.n_p + model.n_u) * sizeof(double)), *u = p + model.n_p, out[MOST];
    double *w = malloc((size_t)(model.n_w + 1) * sizeof(double));
    for (int i = 0; i < model.n_p + model.n_u; ++i) p[i] = model.start[i];
    const double *arg[4] = {p, u, NULL, NULL};
    double best[4] = {1e30, 1e30, 1e30, 1e30}, sink = 0.0, t = 0.0;
    for (int r = 0; r < ROUNDS; ++r)
        for (int what = 0; what < 4; ++what) {
            const double from = now();
            for (int k = 0; k < CALLS; ++k) {
                const double value[3] = {1e-3 * k, 6.0, 1.0};
                if (what == 0) {
                    for (int i = 0; i < 3; ++i) u[(int)in[i] - model.n_p] = value[i];
                    kernels.values(arg, out, w, ~0u);
                } else if (fmi2SetReal(c, in, 3, value) || fmi2DoStep(c, t, 1e-3, 1) ||
                           (what > 1 && fmi2GetReal(c, what == 2 ? port : all, what == 2 ? n_port : n_all, out)))
                    return 1;
                t += what ? 1e-3 : 0.0;
                sink += out[0];
            }
            const double spent = (now() - from) / CALLS;
            if (spent < best[what]) best[what] = spent;
        }
    printf("%g %g %g %g\n", best[0], best[1], best[2], best[3]);
    fmi2FreeInstance(c);
    free(p);
    free(w);
    return sink == 0.12345;
}
