/* An instance of the model. The file of an FMI version includes this file, which names no model and no FMI version. */
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"
#include "elementary.h"
#include "rules.h"

typedef enum { OK = 0, DISCARD = 2, ERROR = 3 } Status;

typedef enum {
    INSTANTIATED = 1,
    INITIALIZATION = 2,
    EVENT = 4,      /* Model Exchange */
    CONTINUOUS = 8, /* Model Exchange */
    STEP = 16,      /* Co-Simulation */
    TERMINATED = 32
} Mode;
#define RUNNING (EVENT | CONTINUOUS | STEP)
#define STARTED (INITIALIZATION | RUNNING | TERMINATED) /* the states have values */
#define ANY (INSTANTIATED | STARTED)

typedef struct Instance Instance;
typedef void (*Report)(const Instance *instance, Status status, const char *message);

struct Instance {
    Mode mode;
    int model_exchange;
    double time, stop; /* stop: the last admissible time, with an allowance for rounding */
    /* one block: parameters, inputs, their derivatives and whether the host has set these (1 or 0), states, derived
     * values, discrete outputs, derivatives, outputs, work */
    double *block, *p, *u, *du, *is_set, *x, *k, *d, *dx, *y, *work, *w; /* w: memory of the kernels */
    size_t block_size;
    unsigned n_references;
    unsigned *slot, *needs; /* by value reference: place in the block, and the groups to evaluate for it */
    unsigned *type;         /* by value reference: one of Type */
    const char *const *type_names;
    unsigned fresh;         /* a bit per group of outputs; the highest bit for the derivatives */
    int changed;    /* parameters or inputs were set after the start of the states */
    int doubtful;   /* an input was set to a value out of its bounds */
    int closed;     /* the states meet the constraints at the present inputs: the last step closed them */
    int held;       /* discrete outputs keep their values until the next event */
    int spent;      /* the derivatives of the inputs belong to the last step, and the next step needs new ones */
    double pace;    /* next step of the integrator with error control [s]; 0: unknown */
    char *name;
    Report report;
    void (*log)(void); /* the logger of the host, and the argument that it gets */
    void *environment;
};

/* bits of `needs` and `fresh` in addition to those of the groups */
enum { STARTED_BIT = 30, DERIVATIVES_BIT = 31 };

static unsigned discrete_bit(void) { return model.discrete < 0 ? 0u : 1u << model.discrete; }
static int count_discrete(void) { return model.discrete < 0 ? 0 : model.groups[model.discrete].count; }

static void instance_free(Instance *c) {
    if (!c) return;
    free(c->block);
    free(c->slot);
    free(c->name);
    free(c);
}

static void instance_reset(Instance *c) {
    memset(c->block, 0, c->block_size);
    memcpy(c->p, model.start, (size_t)(model.n_p + model.n_u) * sizeof(double));
    c->mode = INSTANTIATED;
    c->time = 0.0;
    c->stop = INFINITY;
    c->fresh = 0;
    c->changed = 1;
    c->doubtful = 0;
    c->closed = 0;
    c->held = 0;
    c->spent = 0;
    c->pace = 0.0;
}

/* Tables by value reference: place in the block, groups that are needed, type. */
static void fill_tables(Instance *c) {
    const unsigned first = (unsigned)(model.n_p + model.n_u), started = 1u << STARTED_BIT;
    unsigned r = 0;
    for (; r < first; ++r) c->slot[r] = r, c->type[r] = model.declared[r].type;
    for (int k = 0; k < model.n_x; ++k, ++r) c->slot[r] = (unsigned)(c->x - c->block + k), c->needs[r] = started;
    for (int k = 0; k < model.n_y; ++k, ++r) {
        const int g = model.group_of[k], at = model.place[k] - model.groups[g].first;
        const double *value = g == model.discrete ? c->d + at : c->y + model.place[k];
        c->slot[r] = (unsigned)(value - c->block);
        c->needs[r] = started | 1u << g;
        if (g == model.discrete) c->type[r] = model.discrete_type[at];
    }
    for (int k = 0; k < model.n_x; ++k, ++r)
        c->slot[r] = (unsigned)(c->dx - c->block + k), c->needs[r] = started | 1u << DERIVATIVES_BIT;
    c->slot[r] = (unsigned)(c->w - 1 - c->block); /* the time */
}

static Instance *instance_new(const char *name, const char *const *type_names, Report report) {
    const int n_in = model.n_u + model.n_x;
    int work = 4 * model.n_x + 3 * n_in + 2 * model.n_y + model.n_x + 3 * (model.n_required + model.n_start_required) + 2 * model.n_z;
    if (kernels.closed && work < 3 * model.n_u + 10 * model.n_x) work = 3 * model.n_u + 10 * model.n_x;
    const int n_d = count_discrete(), saved = model.n_p + n_in + 2 * model.n_u + model.n_k + n_d;
    if (work < saved) work = saved;
    const int moved = 2 * model.n_p + model.n_u + n_in + model.n_k + 2 * (2 * model.n_x + model.n_y) + 2 * model.n_z;
    if (work < moved) work = moved;
    const int values = model.n_p + 3 * model.n_u + 2 * model.n_x + model.n_k + n_d + model.n_y;
    const size_t n = (size_t)(values + work + 1 + model.n_w);
    Instance *c = calloc(1, sizeof *c);
    if (!c) return NULL;
    c->block_size = (size_t)values * sizeof(double);
    c->block = calloc(n, sizeof(double));
    c->name = malloc(strlen(name) + 1);
    c->n_references = (unsigned)(model.n_p + model.n_u + 2 * model.n_x + model.n_y);
    c->slot = calloc(3 * ((size_t)c->n_references + 1), sizeof *c->slot);
    if (!c->block || !c->name || !c->slot) {
        instance_free(c);
        return NULL;
    }
    strcpy(c->name, name);
    c->p = c->block;
    c->u = c->p + model.n_p;
    c->du = c->u + model.n_u;
    c->is_set = c->du + model.n_u;
    c->x = c->is_set + model.n_u;
    c->k = c->x + model.n_x;
    c->d = c->k + model.n_k;
    c->dx = c->d + n_d;
    c->y = c->dx + model.n_x;
    c->work = c->y + model.n_y;
    c->w = c->work + work + 1;
    c->needs = c->slot + c->n_references + 1;
    c->type = c->needs + c->n_references + 1;
    fill_tables(c);
    c->type_names = type_names;
    c->report = report;
    instance_reset(c);
    return c;
}

/* -- messages */

/* Append to a text like printf with %s, %d, %u and %g, but with a decimal point in any locale of the host. */
static void append_list(char *text, size_t room, const char *format, va_list list) {
    size_t at = strlen(text);
    for (; *format && at + 1 < room; ++format) {
        char digits[32] = {*format, 0};
        const char *piece = digits;
        if (*format == '%') {
            ++format;
            if (*format == 's')
                piece = va_arg(list, const char *);
            else if (*format == 'd')
                snprintf(digits, sizeof digits, "%d", va_arg(list, int));
            else if (*format == 'u')
                snprintf(digits, sizeof digits, "%u", va_arg(list, unsigned));
            else {
                snprintf(digits, sizeof digits, "%g", va_arg(list, double));
                /* a locale's decimal sign may take several bytes */
                char *sign = digits + strspn(digits, "+-0123456789einfa");
                const size_t length = strcspn(sign, "+-0123456789einfa");
                if (length) {
                    *sign = '.';
                    memmove(sign + 1, sign + length, strlen(sign + length) + 1);
                }
            }
        }
        for (; *piece && at + 1 < room; ++piece) text[at++] = *piece;
    }
    text[at] = 0;
}

static void append(char *text, size_t room, const char *format, ...) {
    va_list list;
    va_start(list, format);
    append_list(text, room, format, list);
    va_end(list);
}

/* Report a fault in one line, and return the status. */
static Status complain(Instance *c, Status status, const char *format, ...) {
    char message[640] = "";
    va_list list;
    va_start(list, format);
    append_list(message, sizeof message, format, list);
    va_end(list);
    c->report(c, status, message);
    return status;
}

/* OK for an instance in one of the modes; else ERROR, reported with the name of the call. */
static Status expect(Instance *c, int modes, const char *call) {
    if (!c) return ERROR;
    if (c->mode & modes) return OK;
    return complain(c, ERROR, "%s is not allowed now (%s)", call,
                    c->mode == INSTANTIATED     ? "before initialization"
                    : c->mode == INITIALIZATION ? "in initialization"
                    : c->mode == TERMINATED     ? "after termination"
                                                : "in this mode");
}

/* -- time */

static double larger(double a, double b) { return fabs(a) > fabs(b) ? fabs(a) : fabs(b); }

static Status set_time(Instance *c, const char *which, double time) {
    if (!isfinite(time)) return complain(c, ERROR, TIME, which, time);
    c->time = time;
    return OK;
}

/* Integrators evaluate beyond the stop time before they interpolate, but a complete step must not end there. */
static Status step_taken(Instance *c) {
    if (c->time <= c->stop) return OK;
    return complain(c, ERROR, "time = %g s: must be <= %g s, the stop time", c->time, c->stop);
}

static Status set_experiment(Instance *c, double time, int has_stop, double stop) {
    if (isfinite(time) && has_stop && !(stop >= time)) return complain(c, ERROR, STOP, stop, time);
    const Status status = set_time(c, "start time", time);
    if (status) return status;
    /* the allowance for an endless experiment would be no number */
    const int ends = has_stop && isfinite(stop);
    c->stop = ends ? stop + SAME_TIME * (stop - time) + ADDED_UP * fabs(larger(stop, time)) : INFINITY;
    return OK;
}

static int all_finite(const double *v, int n) {
    /* an infinite or undefined value makes its sum undefined; four sums run in parallel */
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    int i = 0;
    for (; i + 4 <= n; i += 4)
        for (int k = 0; k < 4; ++k) sum[k] += v[i + k] * 0.0;
    for (; i < n; ++i) sum[0] += v[i] * 0.0;
    return sum[0] + sum[1] + sum[2] + sum[3] == 0.0;
}

/* -- bounds, by the same rule as in quantities.py */

static int admitted(const Quantity *q, double v) {
    return isfinite(v) && (q->open_low ? v > q->low : v >= q->low - q->slack) && v <= q->high + q->slack &&
           (q->type == REAL || v == floor(v));
}

static double bounded(const Quantity *q, double v) { return v < q->low ? q->low : v > q->high ? q->high : v; }

static Status refuse(Instance *c, Status status, const char *where, int i, double v) {
    const Quantity *q = &model.declared[i];
    char finite[160] = "";
    append(finite, sizeof finite, isinf(q->low) && isinf(q->high) ? NUMBER : FINITE, q->allowed);
    return complain(c, status, "%s" VALUE, where, q->name, v, q->unit, isfinite(v) ? q->allowed : finite);
}

/* Inputs may be set one by one: the first call that computes with them checks them. */
static Status judge_inputs(Instance *c) {
    if (!c->doubtful) return OK;
    for (int i = model.n_p; i < model.n_p + model.n_u; ++i)
        if (!admitted(&model.declared[i], c->p[i])) return refuse(c, ERROR, "", i, c->p[i]);
    c->doubtful = 0;
    return OK;
}

/* -- start */

/* Check that each value lies between its limits; the first that does not is refused, in one line. */
static Status meets(Instance *c, const Requirement *required, int n, const double *found) {
    for (int i = 0; i < n; ++i) {
        const Requirement *r = &required[i];
        const double value = found[3 * i], low = found[3 * i + 1], high = found[3 * i + 2];
        if (value > low && value < high) continue;
        char given[256] = "", limits[160] = "";
        for (int k = 0; k < r->n_given; ++k)
            append(given, sizeof given, k ? NEXT_PARAMETER : FIRST_PARAMETER, model.declared[r->given[k]].name,
                   c->p[r->given[k]]);
        if (!(low < high))
            append(limits, sizeof limits, NO_VALUE, r->remedy);
        else if (isfinite(low) && isfinite(high))
            append(limits, sizeof limits, BETWEEN, low, high, r->unit);
        else
            append(limits, sizeof limits, isfinite(low) ? ABOVE : BELOW, isfinite(low) ? low : high, r->unit);
        return complain(c, ERROR, REQUIREMENT, r->subject, value, r->unit, r->why, given, limits);
    }
    return OK;
}

static Status check(Instance *c) {
    for (int i = 0; i < model.n_p + model.n_u; ++i)
        if (!admitted(&model.declared[i], c->p[i])) return refuse(c, ERROR, "", i, c->p[i]);
    c->doubtful = 0;
    const double *arg[2] = {c->p, c->k};
    if (model.n_k) kernels.derive(arg, c->k, c->w, 1u);
    if (!model.n_required) return OK;
    kernels.requirements(arg, c->work, c->w, 1u);
    Status status = meets(c, model.required, model.n_required, c->work);
    if (status) memset(c->k, 0, (size_t)model.n_k * sizeof(double)); /* so that no infinite value remains */
    return status;
}

/* The states at the start with the parameters `p` and inputs `u`; `work` has room for twice the unknowns of the start. */
static void solve_start(const Instance *c, const double *p, const double *u, double *work, double *x) {
    double *z = work, *next = z + model.n_z;
    const double *arg[3] = {p, u, z};
    if (model.n_z) kernels.guess(arg, z, c->w, 1u);
    for (int round = 0; round < model.start_rounds; ++round) {
        kernels.improved(arg, next, c->w, 1u);
        memcpy(z, next, (size_t)model.n_z * sizeof(double));
    }
    kernels.initial(arg, x, c->w, 1u);
}

static Status start(Instance *c) {
    if (!c->changed) return OK;
    Status status = check(c);
    if (status) return status;
    if (model.n_x) {
        solve_start(c, c->p, c->u, c->work, c->x);
        if (!all_finite(c->x, model.n_x)) {
            memset(c->x, 0, (size_t)model.n_x * sizeof(double));
            return complain(c, ERROR, "a state at the start is not a finite number");
        }
        if (model.n_start_required) {
            const double *of[4] = {c->p, c->u, c->x, c->k};
            kernels.start_limits(of, c->work, c->w, 1u);
            status = meets(c, model.required + model.n_required, model.n_start_required, c->work);
            if (status) return status;
        }
    }
    c->fresh = 0;
    c->changed = 0;
    c->closed = 0;
    c->pace = 0.0;
    return OK;
}

/* -- values */

static Status unknown_reference(Instance *c, unsigned reference) {
    return complain(c, ERROR, NO_REFERENCE, reference);
}

static Status other_type(Instance *c, unsigned reference, Type type) {
    return complain(c, ERROR, OTHER_TYPE, reference, c->type_names[type]);
}

/* OK where all references that exist are those of numbers with derivatives. */
static Status all_real(Instance *c, const unsigned *reference, size_t n) {
    for (size_t k = 0; k < n; ++k)
        if (reference[k] <= c->n_references && c->type[reference[k]] != REAL) return other_type(c, reference[k], REAL);
    return OK;
}

/* Evaluate the groups of the bits in `wanted` that are not fresh. */
static Status evaluate(Instance *c, unsigned wanted) {
    wanted &= ~c->fresh;
    if (!wanted) return OK;
    if (judge_inputs(c)) return ERROR;
    const double *arg[4] = {c->p, c->u, c->x, c->k};
    kernels.values(arg, c->y, c->w, wanted);
    for (int g = 0; g < model.n_groups; ++g)
        if ((wanted >> g & 1u) && !all_finite(c->y + model.groups[g].first, model.groups[g].count))
            return complain(c, DISCARD, NO_OUTPUT, model.name, c->time);
    c->fresh |= wanted;
    return OK;
}

/* Compute the discrete outputs, and keep them. */
static Status settle(Instance *c) {
    const Status status = evaluate(c, discrete_bit());
    if (status || model.discrete < 0) return status;
    memcpy(c->d, c->y + model.groups[model.discrete].first, (size_t)count_discrete() * sizeof(double));
    return OK;
}

/* Whether a discrete output has another value now than the one that it keeps. */
static Status unsettled(Instance *c, int *answer) {
    const Status status = evaluate(c, discrete_bit());
    *answer = 0;
    for (int i = 0; !status && i < count_discrete(); ++i)
        *answer |= c->d[i] != c->y[model.groups[model.discrete].first + i];
    return status;
}

static Status derivatives(Instance *c) {
    /* values that were set in the meantime change the start of the states */
    Status status = c->mode == INITIALIZATION ? start(c) : OK;
    if (!status) status = judge_inputs(c);
    if (status || !model.n_x || (c->fresh >> DERIVATIVES_BIT)) return status;
    const double *arg[4] = {c->p, c->u, c->x, c->k};
    kernels.derivatives(arg, c->dx, c->w, 1u);
    if (!all_finite(c->dx, model.n_x))
        return complain(c, DISCARD, "a derivative is not a finite number at t = %g s", c->time);
    c->fresh |= 1u << DERIVATIVES_BIT;
    return OK;
}

static Status get(Instance *c, Type type, const unsigned *reference, size_t n, double *value) {
    unsigned needs = 0;
    for (size_t k = 0; k < n; ++k) {
        if (reference[k] > c->n_references) return unknown_reference(c, reference[k]);
        if (c->type[reference[k]] != type) return other_type(c, reference[k], type);
        needs |= c->needs[reference[k]];
    }
    if (c->held) needs &= ~discrete_bit();
    if (needs) {
        /* before the start of the states only parameters and inputs have values */
        if (c->mode == INSTANTIATED) return complain(c, ERROR, "outputs cannot be read before initialization");
        Status status = c->mode == INITIALIZATION ? start(c) : OK;
        if (!status) status = evaluate(c, needs & ((1u << STARTED_BIT) - 1u));
        if (!status && (needs & discrete_bit())) status = settle(c);
        if (!status && (needs >> DERIVATIVES_BIT)) status = derivatives(c);
        if (status) return status;
    }
    c->block[c->slot[c->n_references]] = c->time;
    for (size_t k = 0; k < n; ++k) value[k] = c->block[c->slot[reference[k]]];
    return OK;
}

/* After a step the outputs continue along its inputs. The first input that is set after it begins the next step. */
static void begin_inputs(Instance *c) {
    if (c->spent) memset(c->du, 0, 2 * (size_t)model.n_u * sizeof(double)); /* and `is_set`, behind them */
    c->spent = 0;
}

static Status set(Instance *c, Type type, unsigned reference, double value) {
    if (reference >= c->n_references) return unknown_reference(c, reference);
    if (c->type[reference] != type) return other_type(c, reference, type);
    const int i = (int)reference, state = i - model.n_p - model.n_u;
    if (c->mode == CONTINUOUS && state >= 0 && state < model.n_x) {
        if (!isfinite(value))
            return complain(c, ERROR, "value reference %u, a state, = %g: must be " NUMBER, reference, value);
        c->x[state] = value;
        c->fresh = 0;
        c->closed = 0;
        return OK;
    }
    if (state >= 0) return complain(c, ERROR, OUTPUT_SET, reference);
    const Quantity *q = &model.declared[i];
    if (!isfinite(value)) return refuse(c, ERROR, "", i, value);
    const int before = c->mode & (INSTANTIATED | INITIALIZATION), good = admitted(q, value);
    if (i < model.n_p && !before) {
        if (!q->tunable)
            return complain(c, ERROR, FIXED, q->name);
        if (!good) return refuse(c, ERROR, "", i, value);
    }
    if (good)
        value = bounded(q, value);
    else
        c->doubtful = 1;
    if (c->p[i] != value) {
        c->p[i] = value;
        c->fresh = 0;
        c->closed = 0;
        if (before) c->changed = 1;
    }
    if (i >= model.n_p) begin_inputs(c);
    return OK;
}

static Status count_states(Instance *c, size_t n, const void *pointer, const char *call) {
    if (n != (size_t)model.n_x) return complain(c, ERROR, "%s: there are %d states", call, model.n_x);
    if (n && !pointer) return complain(c, ERROR, "%s: null argument", call);
    return OK;
}

static Status states_set(Instance *c, const double *x, size_t n, const char *call) {
    Status status = count_states(c, n, x, call);
    if (status) return status;
    if (n && !all_finite(x, (int)n)) return complain(c, ERROR, "%s: a state is not a finite number", call);
    if (n) memcpy(c->x, x, n * sizeof *x);
    c->fresh = 0;
    c->closed = 0;
    return OK;
}

static Status states_get(Instance *c, const double *from, double *to, size_t n, const char *call) {
    Status status = count_states(c, n, to, call);
    if (!status && c->mode == INITIALIZATION) status = start(c);
    if (!status && n) memcpy(to, from, n * sizeof *to);
    return status;
}

/* -- derivatives of outputs */

/* The distance along a direction for a difference: small against inputs and states of the size of 1 and more. */
static double reach(const Instance *c, const double *du, const double *dx) {
    double steepest = 0.0;
    for (int i = 0; i < model.n_u + model.n_x; ++i) {
        const double at = i < model.n_u ? c->u[i] : c->x[i - model.n_u];
        const double share = fabs(i < model.n_u ? du[i] : dx[i - model.n_u]) / (fabs(at) > 1.0 ? fabs(at) : 1.0);
        if (share > steepest) steepest = share;
    }
    return steepest > 0.0 ? 1e-5 / steepest : 1.0;
}

/* The directional derivative of a group without a kernel for it, by central differences, relative error about 1e-9. */
static void differences(Instance *c, int group, const double *du, const double *dx, double *dy) {
    const int n_u = model.n_u, n_x = model.n_x;
    const Group *g = &model.groups[group];
    double *u = dy + model.n_y + n_x, *x = u + n_u, *other = x + n_x;
    const double distance = reach(c, du, dx);
    const double *arg[4] = {c->p, u, x, c->k};
    for (int sense = 1; sense >= -1; sense -= 2) {
        for (int i = 0; i < n_u; ++i) u[i] = c->u[i] + sense * distance * du[i];
        for (int i = 0; i < n_x; ++i) x[i] = c->x[i] + sense * distance * dx[i];
        kernels.values(arg, sense > 0 ? dy : other, c->w, 1u << group);
    }
    for (int i = g->first; i < g->first + g->count; ++i) dy[i] = (dy[i] - other[i]) / (2.0 * distance);
}

/* In initialization the states depend on the inputs: add their derivatives along `du` to their own seeds `dx`. */
static void start_moves(const Instance *c, const double *du, double *dx, double *work) {
    const int n_u = model.n_u, n_x = model.n_x;
    double *u = work, *far = u + n_u, *near = far + n_x, *more = near + n_x, distance;
    memset(far, 0, (size_t)n_x * sizeof(double));
    distance = reach(c, du, far);
    for (int sense = 1; sense >= -1; sense -= 2) {
        for (int i = 0; i < n_u; ++i) u[i] = c->u[i] + sense * distance * du[i];
        solve_start(c, c->p, u, more, sense > 0 ? far : near);
    }
    for (int i = 0; i < n_x; ++i) dx[i] += (far[i] - near[i]) / (2.0 * distance);
}

static Status no_output(Instance *c, unsigned reference) {
    return complain(c, ERROR, "directional derivative: value reference %u is no output", reference);
}

static Status no_derivative(Instance *c) {
    return complain(c, ERROR, "directional derivative is not a finite number at t = %g s", c->time);
}

/* In initialization all unknowns depend on the parameters, too: their derivatives along the directions of parameters,
 * inputs and states at the begin of `work`, by differences of the whole model. */
static Status along_start(Instance *c, const unsigned *unknown, size_t n_unknown, double *sensitivity) {
    const int n_p = model.n_p, n = n_p + model.n_u, n_x = model.n_x, n_y = model.n_y;
    const double *dp = c->work, *du = dp + n_p, *dx = du + model.n_u;
    double *p = c->work + n + n_x, *u = p + n_p, *k = p + n, *far = k + model.n_k, *near = far + 2 * n_x + n_y;
    double *more = near + 2 * n_x + n_y, distance = reach(c, du, dx);
    /* parameters may have any size */
    for (int i = 0; i < n_p; ++i) {
        const double most = 1e-5 * (c->p[i] == 0.0 ? 1.0 : fabs(c->p[i]));
        if (fabs(dp[i]) * distance > most) distance = most / fabs(dp[i]);
    }
    for (int sense = 1; sense >= -1; sense -= 2) {
        double *x = sense > 0 ? far : near, *y = x + n_x, *rates = y + n_y;
        const double *arg[4] = {p, u, x, k};
        for (int i = 0; i < n; ++i) p[i] = c->p[i] + sense * distance * dp[i];
        if (model.n_k) kernels.derive(arg, k, c->w, 1u);
        if (n_x) {
            solve_start(c, p, u, more, x);
            for (int i = 0; i < n_x; ++i) x[i] += sense * distance * dx[i];
            kernels.derivatives(arg, rates, c->w, 1u);
        }
        kernels.values(arg, y, c->w, ~0u);
    }
    for (size_t j = 0; j < n_unknown; ++j) {
        const unsigned place = unknown[j] - (unsigned)n;
        if (place >= (unsigned)(2 * n_x + n_y)) return no_output(c, unknown[j]);
        const int i = (int)place - n_x, at = i >= 0 && i < n_y ? n_x + model.place[i] : (int)place;
        sensitivity[j] = (far[at] - near[at]) / (2.0 * distance);
        if (!isfinite(sensitivity[j])) return no_derivative(c);
    }
    return OK;
}

/* The derivatives of unknowns along the directions of inputs and states that lie at the begin of `work`. */
static Status along(Instance *c, const unsigned *unknown, size_t n_unknown, double *sensitivity) {
    double *du = c->work, *dx = du + model.n_u, *dy = dx + model.n_x;
    const double *arg[6] = {c->p, c->u, c->x, du, dx, c->k};
    unsigned wanted = 0;
    for (size_t k = 0; k < n_unknown; ++k) {
        /* for a reference below the first one the unsigned difference is a large number */
        const unsigned place = unknown[k] - (unsigned)(model.n_p + model.n_u);
        if (place >= (unsigned)(2 * model.n_x + model.n_y)) return no_output(c, unknown[k]);
        const int i = (int)place - model.n_x;
        if (i >= 0) wanted |= 1u << (i < model.n_y ? model.group_of[i] : model.n_groups);
    }
    if (wanted & ~model.differenced) kernels.forward(arg, dy, c->w, wanted & ~model.differenced);
    for (int g = 0; g < model.n_groups; ++g)
        if (wanted & model.differenced & 1u << g) differences(c, g, du, dx, dy);
    for (size_t k = 0; k < n_unknown; ++k) {
        const int place = (int)(unknown[k] - (unsigned)(model.n_p + model.n_u)), i = place - model.n_x;
        /* the derivatives of the states follow the outputs */
        sensitivity[k] = i < 0 ? dx[place] : dy[i < model.n_y ? model.place[i] : i];
        if (!isfinite(sensitivity[k])) return no_derivative(c);
    }
    return OK;
}

static Status forward(Instance *c, const unsigned *unknown, size_t n_unknown, const unsigned *known, size_t n_known,
               const double *seed, double *sensitivity) {
    if (all_real(c, unknown, n_unknown) || all_real(c, known, n_known)) return ERROR;
    Status status = c->mode == INITIALIZATION ? start(c) : judge_inputs(c);
    if (status) return status;
    const unsigned n_p = (unsigned)model.n_p, n = (unsigned)(model.n_u + model.n_x);
    int parameters = 0;
    memset(c->work, 0, (n_p + n) * sizeof(double));
    for (size_t k = 0; k < n_known; ++k) {
        const int parameter = known[k] < n_p;
        if (known[k] >= n_p + n || (parameter && c->mode != INITIALIZATION))
            return complain(c, ERROR, "directional derivative: value reference %u is neither input nor state%s", known[k],
                            parameter ? ", and parameters are known in initialization only" : "");
        parameters |= parameter;
        c->work[known[k]] += seed[k]; /* parameters, inputs and states follow each other in both */
    }
    if (parameters) return along_start(c, unknown, n_unknown, sensitivity);
    memmove(c->work, c->work + n_p, n * sizeof(double));
    if (c->mode == INITIALIZATION && model.n_x)
        start_moves(c, c->work, c->work + model.n_u, c->work + n);
    return along(c, unknown, n_unknown, sensitivity);
}

/* The time derivative of an input: the one of the host, or else the input that the model declares as its derivative. */
static double input_rate(const Instance *c, int i) {
    if (c->is_set[i] != 0.0) return c->du[i];
    return model.rate_of[i] < 0 ? 0.0 : c->u[model.rate_of[i]];
}

static double input_curvature(const Instance *c, int i) {
    return c->is_set[i] != 0.0 || model.rate_of[i] < 0 ? 0.0 : input_rate(c, model.rate_of[i]);
}

static Status output_derivatives(Instance *c, const unsigned *reference, size_t n, double *value) {
    Status status = all_real(c, reference, n);
    if (!status) status = derivatives(c);
    if (status) return status;
    for (int i = 0; i < model.n_u; ++i) c->work[i] = input_rate(c, i);
    memcpy(c->work + model.n_u, c->dx, (size_t)model.n_x * sizeof(double));
    return along(c, reference, n, value);
}

/* -- co-simulation; inputs follow their derivatives to the end of the step */

/* The course of the inputs of an instance in a step: `at` are their values at the present moment. */
typedef struct {
    Instance *c;
    double *at;
    const double *rate, *half; /* first derivative, and half of the second */
} Course;

static void run_to(const Course *u, double since) {
    for (int i = 0; i < model.n_u; ++i) u->at[i] = u->c->u[i] + since * (u->rate[i] + since * u->half[i]);
}

static int slope_at(const Course *u, double since, const double *x, double *dx) {
    run_to(u, since);
    const double *arg[4] = {u->c->p, u->at, x, u->c->k};
    kernels.derivatives(arg, dx, u->c->w, 1u);
    return all_finite(dx, model.n_x);
}

typedef double Number;
typedef int Truth;
#define ALL_TRUE 1
#define GOES_ON(truth) (truth)
#define finite_all all_finite
#define OF_DOUBLE(x) (x)
#define CHOOSE(truth, x, y) ((truth) ? (x) : (y))
#define SMALLER(x, y) ((x) < (y) ? (x) : (y))
#define LARGER(x, y) ((x) > (y) ? (x) : (y))
#define SIZE fabs
/* the same bits as in JavaScript */
#define POWER(x, exponent) exponential((exponent) * logarithm(x))
#include "step.h"

static double number(Kernel kernel, const Instance *c) {
    double value = 0.0;
    const double *arg[1] = {c->p};
    kernel(arg, &value, c->w, 1u);
    return value;
}

static Status astray(Instance *c, double time) {
    return complain(c, DISCARD, ASTRAY, time);
}

static double most_steps(const Instance *c) { return c->p[model.max_steps]; }

static Status over_budget(Instance *c, double time, double size) {
    const char *name = model.declared[model.max_steps].name;
    return complain(c, DISCARD, OVER_BUDGET, size, time, name, most_steps(c), name);
}

/* The classical Runge-Kutta method with equal steps, whose number is known in advance. */
static Status even_steps(Course *u, double time, double size, double *work) {
    Instance *const c = u->c;
    const int n_x = model.n_x;
    double *x = work, *k = x + n_x, *later = k + n_x, *at = later + n_x;
    const double longest = number(kernels.internal_step, c);
    const double wanted = size / longest - 1e-9;
    if (!(wanted <= most_steps(c))) return over_budget(c, time, size);
    const long n = wanted < 1.0 ? 1 : (long)ceil(wanted);
    const double h = size / (double)n;
    memcpy(x, c->x, (size_t)n_x * sizeof(double));
    for (long s = 0; s < n; ++s) {
        if (!rk4(u, n_x, (double)s, h, x, k, at, later)) return astray(c, time);
        memcpy(x, later, (size_t)n_x * sizeof(double));
    }
    memcpy(c->x, x, (size_t)n_x * sizeof(double));
    return OK;
}

/* Change the states `x` so that they meet the constraints at the time `since`. */
static int close_states(const Course *u, double since, double *x, double *spare) {
    run_to(u, since);
    const double *arg[4] = {u->c->p, u->at, x, u->c->k};
    kernels.closed(arg, spare, u->c->w, 1u);
    if (!all_finite(spare, model.n_x)) return 0;
    memcpy(x, spare, (size_t)model.n_x * sizeof(double));
    return 1;
}

/* Steps with error control to the model's tolerance; the constraints are closed after each step. */
static Status controlled_steps(Course *u, double time, double size, double *work) {
    Instance *const c = u->c;
    const int n_x = model.n_x;
    double *x = work, *at = x + n_x, *k = at + n_x;
    const double longest = number(kernels.internal_step, c), tolerance = number(kernels.tolerance, c);
    memcpy(x, c->x, (size_t)n_x * sizeof(double));
    for (int round = 0; !c->closed && round < 2; ++round)
        if (!close_states(u, 0.0, x, at)) return astray(c, time);
    long taken = 0;
    double since = 0.0, pace = c->pace > 0.0 ? c->pace : FIRST * longest;
    while (since < size) {
        if ((double)++taken > most_steps(c)) return over_budget(c, time, size);
        const double left = size - since, h = step_size(pace, left);
        const int usable = dormand_prince(u, n_x, 0, since, h, x, k, at);
        const double error = usable ? error_of(n_x, x, at, k, h, tolerance, model.nominal) : 0.0;
        const int last_resort = h <= SHORTEST * longest;
        if (!usable && last_resort) return astray(c, time);
        if (usable && (error <= 1.0 || last_resort)) {
            since = h >= left ? size : since + h;
            memcpy(x, at, (size_t)n_x * sizeof(double));
            if (!close_states(u, since, x, at)) return astray(c, time);
        }
        pace = next_pace(pace, h, error, usable, longest);
    }
    memcpy(c->x, x, (size_t)n_x * sizeof(double));
    c->pace = pace;
    c->closed = 1;
    return OK;
}

static Status step(Instance *c, double time, double size) {
    if (!isfinite(time) || !isfinite(size) || size < 0.0 || !isfinite(time + size))
        return complain(c, ERROR, STEP_SIZE, size, time);
    if (fabs(time - c->time) > SAME_TIME * size + ROUNDED * fabs(c->time))
        return complain(c, ERROR, STEP_BEGIN, time, c->time);
    if (time + size > c->stop)
        return complain(c, ERROR, STEP_END, size, time, c->stop);
    if (judge_inputs(c)) return ERROR;
    begin_inputs(c);
    const int n_x = model.n_x, n_u = model.n_u;
    double *u = c->work, *rate = u + n_u, *half = rate + n_u;
    for (int i = 0; i < n_u; ++i) {
        rate[i] = input_rate(c, i);
        half[i] = 0.5 * input_curvature(c, i);
        u[i] = c->u[i];
        if (rate[i] == 0.0 && half[i] == 0.0) continue;
        u[i] += size * (rate[i] + size * half[i]);
        /* an input that only the model extrapolates ends at its bound */
        if (c->is_set[i] == 0.0) u[i] = bounded(&model.declared[model.n_p + i], u[i]);
        if (!admitted(&model.declared[model.n_p + i], u[i])) {
            char where[96] = "";
            append(where, sizeof where, "at the end of the step from t = %g s, ", time);
            return refuse(c, DISCARD, where, model.n_p + i, u[i]);
        }
    }
    if (n_x && size > 0.0) {
        Course course = {c, u, rate, half};
        Status status = (kernels.closed ? controlled_steps : even_steps)(&course, time, size, half + n_u);
        if (status) return status;
        c->fresh = 0;
    }
    for (int i = 0; i < n_u; ++i)
        if (rate[i] != 0.0 || half[i] != 0.0) {
            c->u[i] = bounded(&model.declared[model.n_p + i], c->u[i] + size * (rate[i] + size * half[i]));
            c->fresh = 0;
        }
    c->time = time + size;
    c->spent = 1;
    return OK;
}

/* -- model exchange */

/* Largest distance of a state from the constraints, in parts of the integrator's tolerance, before an event corrects
 * it. It is large, since an importer's solver starts anew after each event, with a larger error than a small drift. */
#define OFF_MOST 1e3

/* Write the states that meet the constraints to `work`; returns the largest correction in parts of `tolerance` and the
 * size of the state, or NaN where there are no such states. */
static double off(Instance *c) {
    const double tolerance = number(kernels.tolerance, c), *arg[4] = {c->p, c->u, c->x, c->k};
    double most = 0.0;
    kernels.closed(arg, c->work, c->w, 1u);
    if (!all_finite(c->work, model.n_x)) return NAN;
    for (int i = 0; i < model.n_x; ++i) {
        const double size = fabs(c->x[i]) > model.nominal[i] ? fabs(c->x[i]) : model.nominal[i];
        const double share = fabs(c->work[i] - c->x[i]) / (tolerance * size);
        if (share > most) most = share;
    }
    return most;
}

/* Whether the states have drifted off the constraints so far that an event has to correct them. */
static int drifted(Instance *c) { return kernels.closed && off(c) > OFF_MOST; }

/* At the end of a step of the importer's integrator. */
static Status completed(Instance *c, int *enter_event) {
    *enter_event = 0;
    if (step_taken(c) || judge_inputs(c)) return ERROR;
    int changed;
    const Status status = unsettled(c, &changed);
    *enter_event = !status && (changed || drifted(c));
    return status;
}

/* Correct the states; `moved` tells whether a state changed. */
static Status project(Instance *c, int *moved) {
    *moved = 0;
    if (step_taken(c)) return ERROR;
    if (!kernels.closed) return OK;
    if (judge_inputs(c)) return ERROR;
    for (int round = 0; round < 4; ++round) {
        const double share = off(c);
        if (isnan(share)) return complain(c, ERROR, "no states near these meet the constraints at t = %g s", c->time);
        /* a correction below the tolerance would only cost the importer a new start */
        if (share <= 1.0) break;
        memcpy(c->x, c->work, (size_t)model.n_x * sizeof(double));
        c->fresh = 0;
        *moved = 1;
    }
    return OK;
}

/* -- saved states */

typedef struct {
    uint64_t sum;   /* checksum of all that follows */
    uint64_t guard; /* checksum of the model and its version: a state of another one is refused */
    int mode, model_exchange, closed, spent;
    double time, stop, pace;
    int held;
} Saved;

static uint64_t guard(void) {
    uint64_t h = 14695981039346656037u;
    for (const char *s = model.guid; *s; ++s) h = (h ^ (unsigned char)*s) * 1099511628211u;
    return h;
}

/* The CRC-32 of IEEE 802.3, four bits at a time: any two flipped bits change it. */
static uint64_t sum_of(const void *memory, size_t size) {
    static const uint32_t of_four_bits[16] = {
        0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu, 0x76dc4190u, 0x6b6b51f4u, 0x4db26158u, 0x5005713cu,
        0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu, 0x9b64c2b0u, 0x86d3d2d4u, 0xa00ae278u, 0xbdbdf21cu,
    };
    const unsigned char *bytes = memory;
    uint32_t crc = ~0u;
    for (size_t at = sizeof(uint64_t); at < size; ++at) {
        crc ^= bytes[at];
        crc = crc >> 4 ^ of_four_bits[crc & 15u];
        crc = crc >> 4 ^ of_four_bits[crc & 15u];
    }
    return ~crc;
}

/* size of the saved values, up to the discrete outputs; others are recomputed */
static size_t kept(const Instance *c) { return (size_t)(c->dx - c->block); }

static size_t state_size(const Instance *c) { return sizeof(Saved) + kept(c) * sizeof(double); }

static Status state_check(Instance *c, const void *memory) {
    Saved saved;
    memcpy(&saved, memory, sizeof saved);
    if (saved.guard != guard() || saved.model_exchange != c->model_exchange)
        return complain(c, ERROR, STATE, STATE_OF_ANOTHER);
    if (saved.sum != sum_of(memory, state_size(c))) return complain(c, ERROR, STATE, STATE_DAMAGED);
    /* a host may have written the state itself */
    double *values = c->work;
    memcpy(values, (const char *)memory + sizeof saved, kept(c) * sizeof(double));
    const int mode = saved.mode;
    if (mode < INSTANTIATED || mode > TERMINATED || (mode & (mode - 1)))
        return complain(c, ERROR, "saved state: the mode in it, %d, does not exist", mode);
    if (!isfinite(saved.time) || isnan(saved.stop) || !(saved.pace >= 0.0) || !all_finite(values, (int)kept(c)))
        return complain(c, ERROR, "saved state: a number in it is not finite, or its internal step is negative");
    /* before the run, `start` checks the parameters */
    for (int i = 0; i < model.n_p && mode > INITIALIZATION; ++i)
        if (!admitted(&model.declared[i], values[i])) return refuse(c, ERROR, "saved state: ", i, values[i]);
    return OK;
}

static Status state_new(Instance *c, void **state) {
    if (!*state) *state = malloc(state_size(c));
    return *state ? OK : complain(c, ERROR, "out of memory");
}

static Status state_get(Instance *c, void **state) {
    if (state_new(c, state)) return ERROR;
    Saved saved;
    memset(&saved, 0, sizeof saved);
    saved.guard = guard();
    saved.mode = (int)c->mode;
    saved.model_exchange = c->model_exchange;
    saved.closed = c->closed;
    saved.held = c->held;
    saved.spent = c->spent;
    saved.time = c->time;
    saved.stop = c->stop;
    saved.pace = c->pace;
    memcpy(*state, &saved, sizeof saved);
    memcpy((char *)*state + sizeof saved, c->block, kept(c) * sizeof(double));
    saved.sum = sum_of(*state, state_size(c));
    memcpy(*state, &saved.sum, sizeof saved.sum);
    return OK;
}

static Status state_set(Instance *c, const void *state) {
    Saved saved;
    if (state_check(c, state)) return ERROR;
    memcpy(&saved, state, sizeof saved);
    memcpy(c->block, (const char *)state + sizeof saved, kept(c) * sizeof(double));
    c->mode = (Mode)saved.mode;
    c->time = saved.time;
    c->stop = saved.stop;
    c->pace = saved.pace;
    c->closed = saved.closed;
    c->held = saved.held;
    c->spent = saved.spent;
    c->fresh = 0;
    c->doubtful = 1;
    c->changed = c->mode == INSTANTIATED || c->mode == INITIALIZATION;
    return OK;
}

static Status state_from(Instance *c, const void *bytes, size_t size, void **state) {
    if (size != state_size(c)) return complain(c, ERROR, "saved state: its size is not this model's");
    if (state_check(c, bytes) || state_new(c, state)) return ERROR;
    memcpy(*state, bytes, size);
    return OK;
}
