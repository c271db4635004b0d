/* An instance of the model, for any FMI version. */
#ifndef CHAINUNIT_RUNTIME_H
#define CHAINUNIT_RUNTIME_H

#include <stddef.h>

#include "model.h"

#if defined __GNUC__ && !defined _WIN32
#pragma GCC visibility push(hidden) /* see model.h */
#endif

typedef enum { OK = 0, DISCARD = 2, ERROR = 3 } Status;

typedef enum {
    INSTANTIATED = 1,
    INITIALIZATION = 2,
    EVENT = 4,      /* Model Exchange */
    CONTINUOUS = 8, /* Model Exchange */
    STEP = 16,      /* Co-Simulation */
    TERMINATED = 32
} Mode;

typedef struct Instance Instance;
typedef void (*Report)(const Instance *instance, Status status, const char *message);

struct Instance {
    Mode mode;
    int model_exchange;
    double time;
    /* one block: parameters, inputs, their derivatives, states, derived from parameters, derivatives, outputs, work */
    double *block, *p, *u, *du, *x, *k, *dx, *y, *work;
    size_t block_size;
    unsigned n_references;
    unsigned *slot, *needs; /* of each value reference: place in the block, and what must be evaluated for it */
    unsigned fresh;         /* a bit per group of outputs; the highest for the derivatives */
    int changed;    /* parameters or inputs set since the states were started */
    int closed;     /* the states meet the constraints at the present inputs, as the last step left them */
    double pace;    /* what the integrator that controls its error would step next [s]; 0 not known */
    char *name;
    Report report;
    void *host[3]; /* the FMI layer's own */
};

Instance *instance_new(const char *name, Report report);
void instance_free(Instance *c);
void instance_reset(Instance *c);

/* Say what is wrong, in one line, and hand the status on. */
Status complain(Instance *c, Status status, const char *format, ...);
/* Whether the instance is in one of the modes; else ERROR, with the name of the call. */
Status expect(Instance *c, int modes, const char *call);

Status set_time(Instance *c, double time);
Status start(Instance *c); /* checks the parameters, starts the states */
Status get(Instance *c, const unsigned *reference, size_t n, double *value);
Status set(Instance *c, unsigned reference, double value);
Status set_input_derivative(Instance *c, unsigned reference, double value);
Status derivatives(Instance *c);
Status forward(Instance *c, const unsigned *unknown, size_t n_unknown, const unsigned *known, size_t n_known,
               const double *seed, double *sensitivity);
Status output_derivative(Instance *c, unsigned reference, double *value);
Status step(Instance *c, double time, double size);
/* Model Exchange: whether the states have drifted off the constraints, and an event is to correct them; and that
 * correction, with whether it has moved a state. */
int drifted(Instance *c);
Status project(Instance *c, int *moved);
Status states_set(Instance *c, const double *x, size_t n, const char *call);
/* `from` is the states, their derivatives or their nominal sizes */
Status states_get(Instance *c, const double *from, double *to, size_t n, const char *call);

/* What a saved state holds. */
size_t state_size(const Instance *c);
void state_write(const Instance *c, void *memory);
Status state_read(Instance *c, const void *memory, size_t size);

#if defined __GNUC__ && !defined _WIN32
#pragma GCC visibility pop
#endif

#endif
