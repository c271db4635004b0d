/* The cost of a model's kernels with the package's own functions, beside the same kernels with those of the C library:
 * nanoseconds for all outputs, and for the derivatives of the states, least of several rounds, by turns in one run.
 * The arguments are the places of the angles among the inputs (from 0) and the states (from the number of inputs). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "model.h"

enum { CALLS = 2000, ROUNDS = 100, MOST = 16 };

extern const Kernels own_fmi2_kernels, libm_fmi2_kernels;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static double *room(int n) { return calloc((size_t)n + 1, sizeof(double)); }

int main(int argc, char **argv) {
    const Kernels *const both[2] = {&own_fmi2_kernels, &libm_fmi2_kernels};
    double *p = room(model.n_p + model.n_u + model.n_x), *u = p + model.n_p, *x = u + model.n_u;
    double *k = room(model.n_k), *w = room(model.n_w), *z = room(model.n_z), *next = room(model.n_z);
    double *y = room(model.n_y + model.n_x), best[2][2] = {{1e30, 1e30}, {1e30, 1e30}}, begin[MOST];
    const double *arg[4] = {p, u, x, k}, *start[3] = {p, u, z};
    memcpy(p, model.start, (size_t)(model.n_p + model.n_u) * sizeof(double));
    if (model.n_k) own_fmi2_kernels.derive(arg, k, w, 1u);
    if (model.n_z) own_fmi2_kernels.guess(start, z, w, 1u);
    for (int round = 0; round < model.start_rounds; ++round) {
        own_fmi2_kernels.improved(start, next, w, 1u);
        memcpy(z, next, (size_t)model.n_z * sizeof(double));
    }
    if (model.n_x) own_fmi2_kernels.initial(start, x, w, 1u);
    for (int i = 1; i < argc && i < MOST; ++i) begin[i] = u[atoi(argv[i])];
    for (int round = 0; round < ROUNDS; ++round)
        for (int what = 0; what < (model.n_x ? 2 : 1); ++what)
            for (int side = 0; side < 2; ++side) {
                const Kernel kernel = what ? both[side]->derivatives : both[side]->values;
                const double from = now();
                for (int call = 0; call < CALLS; ++call) {
                    for (int i = 1; i < argc && i < MOST; ++i) u[atoi(argv[i])] = begin[i] + 1e-2 * call;
                    kernel(arg, y, w, ~0u);
                }
                const double spent = (now() - from) / CALLS;
                if (spent < best[what][side]) best[what][side] = spent;
            }
    printf("%g %g %g %g\n", best[0][0], best[0][1], best[1][0], best[1][1]);
    return 0;
}
