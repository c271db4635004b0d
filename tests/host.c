/* A plain C host, linked to nothing but what loads a library: turns the crank of an FMU (FMI 2.0, or 3.0 with -DFMI=3),
 * prints the torque. */
#include <stdio.h>
#include <stdlib.h>

#ifdef LINKED /* the FMU is a part of the program, its functions have this prefix, as ours will */
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define OPEN(file) (void *)file
#define REASON() ""
#define LOAD(name)                \
    name##TYPE JOIN(LINKED, name); \
    name##TYPE *name = JOIN(LINKED, name)
#if FMI == 3
#define main JOIN(LINKED, host3)
#else
#define main JOIN(LINKED, host2)
#endif
#elif defined _WIN32
#include <windows.h>
#define OPEN(file) (void *)LoadLibraryA(file)
#define SYMBOL(library, name) GetProcAddress((HMODULE)library, name)
#define REASON() "cannot load the library"
#else
#include <dlfcn.h>
#define OPEN(file) dlopen(file, RTLD_NOW)
#define SYMBOL(library, name) dlsym(library, name)
#define REASON() dlerror()
#endif
#ifndef LOAD
#define LOAD(name) name##TYPE *name = (name##TYPE *)SYMBOL(library, #name)
#endif

#if FMI == 3
#include "fmi3FunctionTypes.h"
typedef fmi3Instance Unit;
typedef fmi3ValueReference Reference;
static void logger(fmi3InstanceEnvironment e, fmi3Status s, fmi3String c, fmi3String m) {
    (void)e, (void)s, (void)c;
    fprintf(stderr, "%s\n", m);
}
static fmi3InstantiateCoSimulationTYPE *instantiate;
static fmi3EnterInitializationModeTYPE *enter;
static fmi3ExitInitializationModeTYPE *leave;
static fmi3SetFloat64TYPE *set;
static fmi3GetFloat64TYPE *get;
static fmi3DoStepTYPE *step;
static fmi3TerminateTYPE *end;
static fmi3FreeInstanceTYPE *release;
static int load(void *library) {
    (void)library;
    LOAD(fmi3InstantiateCoSimulation);
    LOAD(fmi3EnterInitializationMode);
    LOAD(fmi3ExitInitializationMode);
    LOAD(fmi3SetFloat64);
    LOAD(fmi3GetFloat64);
    LOAD(fmi3DoStep);
    LOAD(fmi3Terminate);
    LOAD(fmi3FreeInstance);
    instantiate = fmi3InstantiateCoSimulation, enter = fmi3EnterInitializationMode, leave = fmi3ExitInitializationMode;
    set = fmi3SetFloat64, get = fmi3GetFloat64, step = fmi3DoStep, end = fmi3Terminate, release = fmi3FreeInstance;
    return instantiate && enter && leave && set && get && step && end && release;
}
static Unit started(const char *token) {
    Unit c = instantiate("unit", token, "", fmi3False, fmi3True, fmi3False, fmi3False, NULL, 0, NULL, logger, NULL);
    return c && !enter(c, fmi3False, 0.0, 0.0, fmi3False, 0.0) && !leave(c) ? c : NULL;
}
static int put(Unit c, Reference r, double v) { return set(c, &r, 1, &v, 1); }
static int take(Unit c, Reference r, double *v) { return get(c, &r, 1, v, 1); }
static int advance(Unit c, double t, double h) {
    fmi3Boolean event, terminate, early;
    double last;
    return step(c, t, h, fmi3True, &event, &terminate, &early, &last);
}
#else
#include "fmi2FunctionTypes.h"
typedef fmi2Component Unit;
typedef fmi2ValueReference Reference;
static void logger(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)n, (void)s, (void)c;
    fprintf(stderr, "%s\n", m);
}
static fmi2InstantiateTYPE *instantiate;
static fmi2SetupExperimentTYPE *setup;
static fmi2EnterInitializationModeTYPE *enter;
static fmi2ExitInitializationModeTYPE *leave;
static fmi2SetRealTYPE *set;
static fmi2GetRealTYPE *get;
static fmi2DoStepTYPE *step;
static fmi2TerminateTYPE *end;
static fmi2FreeInstanceTYPE *release;
static int load(void *library) {
    (void)library;
    LOAD(fmi2Instantiate);
    LOAD(fmi2SetupExperiment);
    LOAD(fmi2EnterInitializationMode);
    LOAD(fmi2ExitInitializationMode);
    LOAD(fmi2SetReal);
    LOAD(fmi2GetReal);
    LOAD(fmi2DoStep);
    LOAD(fmi2Terminate);
    LOAD(fmi2FreeInstance);
    instantiate = fmi2Instantiate, setup = fmi2SetupExperiment, enter = fmi2EnterInitializationMode;
    leave = fmi2ExitInitializationMode, set = fmi2SetReal, get = fmi2GetReal, step = fmi2DoStep;
    end = fmi2Terminate, release = fmi2FreeInstance;
    return instantiate && setup && enter && leave && set && get && step && end && release;
}
static Unit started(const char *guid) {
    static const fmi2CallbackFunctions functions = {logger, calloc, free, NULL, NULL};
    Unit c = instantiate("unit", fmi2CoSimulation, guid, NULL, &functions, fmi2False, fmi2True);
    return c && !setup(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) && !enter(c) && !leave(c) ? c : NULL;
}
static int put(Unit c, Reference r, double v) { return set(c, &r, 1, &v); }
static int take(Unit c, Reference r, double *v) { return get(c, &r, 1, v); }
static int advance(Unit c, double t, double h) { return step(c, t, h, fmi2True); }
#endif

int main(int argc, char **argv) {
    void *library = argc == 6 ? OPEN(argv[1]) : NULL;
    if (!library) return fprintf(stderr, "%s\n", REASON()), 1;
    if (!load(library)) return fprintf(stderr, "a function is missing\n"), 1;
    const Reference phi = (Reference)atoi(argv[3]), w = (Reference)atoi(argv[4]), tau = (Reference)atoi(argv[5]);
    Unit c = started(argv[2]);
    if (!c) return 2;
    for (int k = 0; k < 10; ++k) {
        double torque;
        if (put(c, phi, 0.5 * k) || put(c, w, 6.0) || advance(c, 0.1 * k, 0.1) || take(c, tau, &torque)) return 3;
        printf("%.17g\n", torque);
    }
    end(c);
    release(c);
    return 0;
}
