/* The seam between the generated model and the FMI layers.
 *
 * A model fills one `Model`; it names no FMI function. The FMI files include only this header and runtime.c; they name
 * no model. All values are stored as doubles, in the order parameters, inputs, states, outputs, derivatives of the
 * states, time; a value reference is the place in that order. To the host some are whole numbers or switches.
 */
#ifndef CHAINUNIT_MODEL_H
#define CHAINUNIT_MODEL_H

/* The names that several files of an FMU share. The FMI functions may have a prefix, so that one program can hold
 * several FMUs. Then these names have the prefix, too, and the version of FMI, as a program may hold a model in both
 * versions. All other names are static. */
#define CHAINUNIT_PASTE(a, b) a##b
#define CHAINUNIT_JOIN(a, b) CHAINUNIT_PASTE(a, b)
#if defined FMI2_FUNCTION_PREFIX && defined FMI3_FUNCTION_PREFIX
#error "FMI2_FUNCTION_PREFIX and FMI3_FUNCTION_PREFIX are both defined: define the one of this FMU's version of FMI"
#elif defined FMI3_FUNCTION_PREFIX
#define CHAINUNIT_NAME(name) CHAINUNIT_JOIN(FMI3_FUNCTION_PREFIX, CHAINUNIT_PASTE(fmi3_, name))
#elif defined FMI2_FUNCTION_PREFIX
#define CHAINUNIT_NAME(name) CHAINUNIT_JOIN(FMI2_FUNCTION_PREFIX, CHAINUNIT_PASTE(fmi2_, name))
#else
#define CHAINUNIT_NAME(name) CHAINUNIT_PASTE(chainunit_, name)
#endif
#define model CHAINUNIT_NAME(model)
#define kernels CHAINUNIT_NAME(kernels)

/* For a library that runs with glibc 2.17: a newer glibc would link newer versions of these functions. */
#if defined CHAINUNIT_OLD_GLIBC && defined __GNUC__ && defined __linux__
#include <math.h>
#if defined __GLIBC__ && defined __x86_64__
#define CHAINUNIT_OLD(name) __asm__(".symver " #name "," #name "@GLIBC_2.2.5")
#elif defined __GLIBC__ && defined __aarch64__
#define CHAINUNIT_OLD(name) __asm__(".symver " #name "," #name "@GLIBC_2.17")
#endif
#endif
#ifdef CHAINUNIT_OLD
CHAINUNIT_OLD(exp);
CHAINUNIT_OLD(exp2);
CHAINUNIT_OLD(fmod);
CHAINUNIT_OLD(hypot);
CHAINUNIT_OLD(log);
CHAINUNIT_OLD(log2);
CHAINUNIT_OLD(pow);
#endif

/* In a host that compiles the sources every name is visible by default; these names must not meet those of libc or of
 * another FMU. */
#if defined __GNUC__ && !defined _WIN32
#pragma GCC visibility push(hidden)
#endif

/* A function of (p, u, x, k) or other arguments; k are the results of `derive`. It has memory `w` for `n_w` numbers,
 * and computes and writes only the groups of results whose bits are set in `wanted`. */
typedef void (*Kernel)(const double *const *arg, double *res, double *w, unsigned wanted);

/* The types of variables. An output that is no REAL is discrete: in Model Exchange it changes at events only. */
typedef enum { REAL, INTEGER, BOOLEAN } Type;

typedef struct {
    const char *name;
    const char *unit;
    const char *allowed; /* the bounds in words */
    double low, high;
    double slack; /* a value that exceeds a bound by no more than this counts as the bound */
    int open_low; /* low itself is forbidden */
    int tunable;  /* may change in a run */
    Type type;
} Quantity;

/* Outputs that are evaluated together, once per state, when one of them is read. */
typedef struct {
    int first, count; /* places among the outputs as they are stored */
} Group;

/* A condition on the parameters beyond their own bounds: a value between two limits. */
typedef struct {
    const char *subject, *unit, *why, *remedy;
    int n_given;
    const int *given; /* parameters named beside the reason */
} Requirement;

/* The equations. */
typedef struct {
    Kernel values;              /* (p, u, x, k) -> outputs, by groups */
    Kernel forward;             /* (p, u, x, du, dx, k) -> directional derivatives of outputs, by groups, and of `derivatives` */
    Kernel requirements;        /* (p, k) -> value, low, high of each */
    Kernel start_limits;        /* (p, u, x, k) -> value, low, high of each, at the start */
    Kernel derive;              /* (p) -> values that follow from fixed parameters, computed once */
    Kernel guess;               /* (p, u) -> first guess z of the unknowns of the start */
    Kernel improved;            /* (p, u, z) -> z after one more round */
    Kernel initial;             /* (p, u, z) -> states at the start */
    Kernel derivatives;         /* (p, u, x, k) */
    Kernel internal_step;       /* (p) -> longest step of the internal integrator [s] */
    Kernel tolerance;           /* (p) -> relative tolerance of an integrator with error control */
    Kernel closed;              /* (p, u, x, k) -> states that meet the constraints; called after each step of it */
} Kernels;

typedef struct {
    const char *name;
    const char *guid; /* of the description; FMI 3.0 calls it instantiation token */
    int n_p, n_u, n_x, n_y, n_k, n_z, n_w, n_groups, n_required, n_start_required;
    unsigned differenced;        /* groups whose directional derivatives are taken by central differences */
    const double *start;         /* parameters, inputs */
    const Quantity *declared;    /* parameters, inputs */
    const double *nominal;       /* of the states */
    const int *rate_of;          /* of each input: the input that is its time derivative, or -1 */
    const int *place;            /* of each output, by value reference, as they are stored */
    const int *group_of;         /* of each output, by value reference */
    const Group *groups;
    int discrete;                /* the group of all discrete outputs, or -1 */
    const Type *discrete_type;   /* of each of these, as they are stored */
    const Requirement *required; /* of the parameters, then of the states at the start */
    int start_rounds;
    int max_steps; /* the parameter that says how many steps of its own a step may take; of models with states */
} Model;

extern const Model model;
extern const Kernels kernels;

#if defined __GNUC__ && !defined _WIN32
#pragma GCC visibility pop
#endif

#endif
