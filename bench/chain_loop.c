/* A chain unit with chains from a C loop: by communication step, simulated seconds for one second, least of several
 * rounds, and right-hand sides and projections of a simulated second; then the cost of one of each [ns]. Compiled
 * together with the sources of an FMI 2.0 FMU, whose runtime counts. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"
#include "model.h"

extern long evaluations, projections;

static void logger(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)n, (void)s, (void)c;
    fprintf(stderr, "%s\n", m);
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* arguments: references of phi and w, seconds to simulate, then communication steps */
int main(int argc, char **argv) {
    const fmi2CallbackFunctions functions = {logger, calloc, free, NULL, NULL};
    if (argc < 5) return 1;
    const fmi2ValueReference in[2] = {(fmi2ValueReference)atoi(argv[1]), (fmi2ValueReference)atoi(argv[2])};
    const double start[2] = {0.0, 10.0}, whole = atof(argv[3]);
    fmi2ValueReference states[128];
    double x[128];
    if (model.n_x > 128) return 1;
    for (int i = 0; i < model.n_x; ++i) states[i] = (fmi2ValueReference)(model.n_p + model.n_u + i);
    for (int k = 4; k < argc; ++k) {
        const double h = atof(argv[k]);
        const long n = (long)(whole / h);
        double best = 1e30;
        for (int round = 0; round < 5; ++round) {
            fmi2Component c = fmi2Instantiate("unit", fmi2CoSimulation, model.guid, NULL, &functions, 0, 1);
            if (!c || fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) || fmi2SetReal(c, in, 2, start) ||
                fmi2EnterInitializationMode(c) || fmi2ExitInitializationMode(c))
                return 1;
            evaluations = projections = 0;
            const double from = now();
            for (long i = 0; i < n; ++i)
                if (fmi2DoStep(c, h * (double)i, h, 1)) return 1;
            const double spent = now() - from;
            if (spent < best) best = spent;
            if (fmi2GetReal(c, states, (size_t)model.n_x, x)) return 1;
            fmi2FreeInstance(c);
        }
        const double simulated = h * (double)n;
        printf("%g %g %g\n", simulated / best, (double)evaluations / simulated, (double)projections / simulated);
    }
    double *p = malloc((size_t)(model.n_p + model.n_u) * sizeof(double)), dx[128], sink = 0.0;
    for (int i = 0; i < model.n_p + model.n_u; ++i) p[i] = model.start[i];
    const double *arg[4] = {p, p + model.n_p, x, p};
    double *w = malloc((size_t)(model.n_w + 1) * sizeof(double));
    for (int what = 0; what < 2; ++what) {
        double best = 1e30;
        for (int round = 0; round < 9; ++round) {
            const double from = now();
            for (int i = 0; i < 20000; ++i) {
                (what ? kernels.closed : kernels.derivatives)(arg, dx, w, 1u);
                sink += dx[0];
            }
            const double spent = (now() - from) / 20000;
            if (spent < best) best = spent;
        }
        printf("%g%s", 1e9 * best, what ? "\n" : " ");
    }
    free(p);
    free(w);
    return sink == 0.12345;
}
