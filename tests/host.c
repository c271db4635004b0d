/* A plain C host, linked to nothing but libdl: loads an FMI 2.0 FMU, turns the crank, prints the torque. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"

static void logger(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)n, (void)s, (void)c;
    fprintf(stderr, "%s\n", m);
}
#define LOAD(name) name##TYPE *name = (name##TYPE *)dlsym(library, #name)

int main(int argc, char **argv) {
    void *library = argc == 6 ? dlopen(argv[1], RTLD_NOW) : NULL;
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 1;
    LOAD(fmi2Instantiate);
    LOAD(fmi2SetupExperiment);
    LOAD(fmi2EnterInitializationMode);
    LOAD(fmi2ExitInitializationMode);
    LOAD(fmi2SetReal);
    LOAD(fmi2DoStep);
    LOAD(fmi2GetReal);
    LOAD(fmi2Terminate);
    LOAD(fmi2FreeInstance);
    const fmi2CallbackFunctions functions = {logger, calloc, free, NULL, NULL};
    const fmi2ValueReference phi = (unsigned)atoi(argv[3]), w = (unsigned)atoi(argv[4]), tau = (unsigned)atoi(argv[5]);
    fmi2Component c = fmi2Instantiate("unit", fmi2CoSimulation, argv[2], NULL, &functions, fmi2False, fmi2True);
    if (!c || fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) || fmi2EnterInitializationMode(c) ||
        fmi2ExitInitializationMode(c))
        return 2;
    for (int k = 0; k < 10; ++k) {
        const double angle = 0.5 * k, speed = 6.0;
        double torque;
        if (fmi2SetReal(c, &phi, 1, &angle) || fmi2SetReal(c, &w, 1, &speed) || fmi2DoStep(c, 0.1 * k, 0.1, fmi2True) ||
            fmi2GetReal(c, &tau, 1, &torque))
            return 3;
        printf("%.17g\n", torque);
    }
    fmi2Terminate(c);
    fmi2FreeInstance(c);
    return 0;
}
