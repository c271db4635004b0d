/* A plain C host that prints digests of a run of an FMU (FMI 3.0): of all values that the job names, after each step.
 *
 * Arguments: library, token, file of the job. The job is in numbers of 4 bytes: how many inputs and results there are,
 * how many steps a piece has, how many pieces there are, how many pieces a digest has; then the value references of
 * inputs and results; and in numbers of 8 bytes: the step [s], and the values of the inputs for each piece. A digest is
 * of all values so far, by their bits. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3FunctionTypes.h"

#if defined _WIN32
#include <windows.h>
#define OPEN(file) (void *)LoadLibraryA(file)
#define SYMBOL(library, name) GetProcAddress((HMODULE)library, name)
#else
#include <dlfcn.h>
#define OPEN(file) dlopen(file, RTLD_NOW)
#define SYMBOL(library, name) dlsym(library, name)
#endif
#define LOAD(name) name##TYPE *name = (name##TYPE *)SYMBOL(library, #name)

static void logger(fmi3InstanceEnvironment e, fmi3Status s, fmi3String c, fmi3String m) {
    (void)e, (void)s, (void)c;
    fprintf(stderr, "%s\n", m);
}

static void *taken(FILE *file, size_t size, size_t count) {
    void *memory = malloc(size * count + 1);
    if (!memory || fread(memory, size, count, file) != count) exit(4);
    return memory;
}

int main(int argc, char **argv) {
    void *library = argc == 4 ? OPEN(argv[1]) : NULL;
    FILE *file = library ? fopen(argv[3], "rb") : NULL;
    if (!file) return 1;
    LOAD(fmi3InstantiateCoSimulation);
    LOAD(fmi3EnterInitializationMode);
    LOAD(fmi3ExitInitializationMode);
    LOAD(fmi3SetFloat64);
    LOAD(fmi3GetFloat64);
    LOAD(fmi3DoStep);
    LOAD(fmi3FreeInstance);
    if (!fmi3InstantiateCoSimulation) return 1;
    const uint32_t *head = taken(file, 4, 5);
    const uint32_t n_in = head[0], n_out = head[1], steps = head[2], pieces = head[3], every = head[4];
    const fmi3ValueReference *in = taken(file, 4, n_in), *out = taken(file, 4, n_out);
    const double *step = taken(file, 8, 1), *given = taken(file, 8, (size_t)n_in * pieces);
    double *value = malloc(8 * (size_t)n_out);
    fmi3Instance c = fmi3InstantiateCoSimulation("unit", argv[2], "", fmi3False, fmi3True, fmi3False, fmi3False, NULL,
                                                 0, NULL, logger, NULL);
    if (!c || !value || fmi3SetFloat64(c, in, n_in, given, n_in)) return 2;
    if (fmi3EnterInitializationMode(c, fmi3False, 0.0, 0.0, fmi3False, 0.0) || fmi3ExitInitializationMode(c)) return 2;
    uint32_t a = 0x811c9dc5u, b = 0x9747b28cu;
    double time = 0.0, last;
    fmi3Boolean event, end, early;
    for (uint32_t piece = 0; piece < pieces; ++piece) {
        if (fmi3SetFloat64(c, in, n_in, given + (size_t)piece * n_in, n_in)) return 3;
        for (uint32_t k = 0; k < steps; ++k, time += *step) {
            if (fmi3DoStep(c, time, *step, fmi3True, &event, &end, &early, &last)) return 3;
            if (fmi3GetFloat64(c, out, n_out, value, n_out)) return 3;
            for (uint32_t i = 0; i < 2 * n_out; ++i) {
                uint32_t word;
                memcpy(&word, (const char *)value + 4 * (size_t)i, 4);
                a = (a ^ word) * 0x01000193u;
                b = (b ^ word) * 0x85ebca6bu;
                b ^= b >> 13;
            }
        }
        if ((piece + 1) % every == 0) printf("%08x%08x\n", (unsigned)a, (unsigned)b);
    }
    fmi3FreeInstance(c);
    return 0;
}
