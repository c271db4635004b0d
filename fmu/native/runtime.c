#include "runtime.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* bits of `needs` and `fresh` beside those of the groups */
enum { STARTED_BIT = 30, DERIVATIVES_BIT = 31 };

typedef struct {
    int mode, model_exchange, closed;
    double time, pace;
    unsigned guard; /* of the model: a state of another one is refused */
} Saved;

static unsigned guard(void) {
    unsigned h = 2166136261u;
    for (const char *s = model.guid; *s; ++s) h = (h ^ (unsigned char)*s) * 16777619u;
    return h;
}

Instance *instance_new(const char *name, Report report) {
    const int n_in = model.n_u + model.n_x;
    int work = 4 * model.n_x + 3 * n_in + 2 * model.n_y + model.n_x + 3 * (model.n_required + model.n_start_required) + 2 * model.n_z;
    if (model.closed && work < 3 * model.n_u + 10 * model.n_x) work = 3 * model.n_u + 10 * model.n_x;
    const int saved = model.n_p + n_in + model.n_u + model.n_k;
    if (work < saved) work = saved;
    const size_t n = (size_t)(model.n_p + 2 * model.n_u + 2 * model.n_x + model.n_k + model.n_y + work + 1);
    Instance *c = calloc(1, sizeof *c);
    if (!c) return NULL;
    c->block_size = (n - 1 - (size_t)work) * sizeof(double);
    c->block = calloc(n, sizeof(double));
    c->name = malloc(strlen(name) + 1);
    c->n_references = (unsigned)(model.n_p + model.n_u + 2 * model.n_x + model.n_y);
    c->slot = malloc(2 * (c->n_references + 1) * sizeof *c->slot);
    if (!c->block || !c->name || !c->slot) {
        instance_free(c);
        return NULL;
    }
    strcpy(c->name, name);
    c->p = c->block;
    c->u = c->p + model.n_p;
    c->du = c->u + model.n_u;
    c->x = c->du + model.n_u;
    c->k = c->x + model.n_x;
    c->dx = c->k + model.n_k;
    c->y = c->dx + model.n_x;
    c->work = c->y + model.n_y;
    c->needs = c->slot + c->n_references + 1;
    unsigned r = 0;
    for (int k = 0; k < model.n_p + model.n_u; ++k, ++r) c->slot[r] = r, c->needs[r] = 0;
    for (int k = 0; k < model.n_x; ++k, ++r)
        c->slot[r] = (unsigned)(c->x - c->block + k), c->needs[r] = 1u << STARTED_BIT;
    for (int k = 0; k < model.n_y; ++k, ++r)
        c->slot[r] = (unsigned)(c->y - c->block + model.place[k]),
        c->needs[r] = 1u << STARTED_BIT | 1u << model.group_of[k];
    for (int k = 0; k < model.n_x; ++k, ++r)
        c->slot[r] = (unsigned)(c->dx - c->block + k), c->needs[r] = 1u << STARTED_BIT | 1u << DERIVATIVES_BIT;
    c->slot[r] = (unsigned)(n - 1), c->needs[r] = 0; /* the time */
    c->report = report;
    instance_reset(c);
    return c;
}

void instance_free(Instance *c) {
    if (!c) return;
    free(c->block);
    free(c->slot);
    free(c->name);
    free(c);
}

void instance_reset(Instance *c) {
    memset(c->block, 0, c->block_size);
    memcpy(c->p, model.start, (size_t)(model.n_p + model.n_u) * sizeof(double));
    c->mode = INSTANTIATED;
    c->time = 0.0;
    c->fresh = 0;
    c->changed = 1;
    c->closed = 0;
    c->pace = 0.0;
}

Status complain(Instance *c, Status status, const char *format, ...) {
    char message[640];
    va_list list;
    va_start(list, format);
    vsnprintf(message, sizeof message, format, list);
    va_end(list);
    c->report(c, status, message);
    return status;
}

Status expect(Instance *c, int modes, const char *call) {
    if (c->mode & modes) return OK;
    return complain(c, ERROR, "%s is not allowed now (%s)", call,
                    c->mode == INSTANTIATED     ? "before initialization"
                    : c->mode == INITIALIZATION ? "in initialization"
                    : c->mode == TERMINATED     ? "after termination"
                                                : "in this mode");
}

Status set_time(Instance *c, double time) {
    if (!isfinite(time)) return complain(c, ERROR, "time = %g s: must be a finite number", time);
    c->time = time;
    return OK;
}

static int all_finite(const double *v, int n) {
    /* an infinite or undefined value makes its sum undefined; four sums, so that none waits for another */
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    int i = 0;
    for (; i + 4 <= n; i += 4)
        for (int k = 0; k < 4; ++k) sum[k] += v[i + k] * 0.0;
    for (; i < n; ++i) sum[0] += v[i] * 0.0;
    return sum[0] + sum[1] + sum[2] + sum[3] == 0.0;
}

/* -- start */

/* Whether each value lies between its limits; refuses the first that does not, in one line. */
static Status meets(Instance *c, const Requirement *required, int n, const double *limits) {
    for (int i = 0; i < n; ++i) {
        const Requirement *r = &required[i];
        const double value = limits[3 * i], low = limits[3 * i + 1], high = limits[3 * i + 2];
        if (value > low && value < high) continue;
        const char *gap = r->unit[0] ? " " : "";
        char given[256] = "", range[160] = "";
        size_t at = 0;
        for (int k = 0; k < r->n_given && at < sizeof given; ++k)
            at += (size_t)snprintf(given + at, sizeof given - at, "%s%s = %g", k ? ", " : " with ",
                                   model.declared[r->given[k]].name, c->p[r->given[k]]);
        if (!(low < high))
            snprintf(range, sizeof range, "no value fits; %s", r->remedy);
        else if (isfinite(low) && isfinite(high))
            snprintf(range, sizeof range, "must be > %g and < %g%s%s", low, high, gap, r->unit);
        else
            snprintf(range, sizeof range, "must be %s %g%s%s", isfinite(low) ? ">" : "<", isfinite(low) ? low : high,
                     gap, r->unit);
        return complain(c, ERROR, "%s = %g%s%s: %s%s; %s", r->subject, value, gap, r->unit, r->why, given, range);
    }
    return OK;
}

static Status check(Instance *c) {
    for (int i = 0; i < model.n_p + model.n_u; ++i) {
        const Quantity *q = &model.declared[i];
        const double v = c->p[i];
        const int above = q->open_low ? v > q->low : v >= q->low;
        if (!isfinite(v) || (i < model.n_p && !(above && v <= q->high)))
            return complain(c, ERROR, "%s = %g %s: must be %s%s", q->name, v, q->unit, isfinite(v) ? "" : "finite, ",
                            q->allowed);
    }
    const double *arg[2] = {c->p, c->k};
    if (model.n_k) {
        double *into[1] = {c->k};
        model.derive(arg, into, NULL, NULL, 0);
    }
    if (!model.n_required) return OK;
    double *res[1] = {c->work};
    model.requirements(arg, res, NULL, NULL, 0);
    Status status = meets(c, model.required, model.n_required, c->work);
    if (status) memset(c->k, 0, (size_t)model.n_k * sizeof(double)); /* nothing that is not finite stays behind */
    return status;
}

Status start(Instance *c) {
    if (!c->changed) return OK;
    Status status = check(c);
    if (status) return status;
    if (model.n_x) {
        double *z = c->work, *next = z + model.n_z;
        const double *arg[3] = {c->p, c->u, z};
        double *res[1] = {z};
        if (model.n_z) model.guess(arg, res, NULL, NULL, 0);
        for (int round = 0; round < model.start_rounds; ++round) {
            res[0] = next;
            model.improved(arg, res, NULL, NULL, 0);
            memcpy(z, next, (size_t)model.n_z * sizeof(double));
        }
        res[0] = c->x;
        model.initial(arg, res, NULL, NULL, 0);
        if (!all_finite(c->x, model.n_x)) {
            memset(c->x, 0, (size_t)model.n_x * sizeof(double));
            return complain(c, ERROR, "a state at the start is not a finite number");
        }
        if (model.n_start_required) {
            const double *of[4] = {c->p, c->u, c->x, c->k};
            res[0] = c->work;
            model.start_limits(of, res, NULL, NULL, 0);
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
    return complain(c, ERROR, "value reference %u does not exist", reference);
}

/* Evaluate the groups in the set `wanted`, a bit each, where they are not fresh. */
static Status evaluate(Instance *c, unsigned wanted) {
    wanted &= ~c->fresh;
    if (!wanted) return OK;
    const double *arg[4] = {c->p, c->u, c->x, c->k};
    double *res[1] = {c->y};
    if (wanted & (wanted - 1)) { /* more than one */
        model.all(arg, res, NULL, NULL, 0);
        wanted = (1u << model.n_groups) - 1u;
    } else {
        for (int g = 0; g < model.n_groups; ++g)
            if (wanted >> g & 1u) {
                res[0] = c->y + model.groups[g].first;
                model.groups[g].values(arg, res, NULL, NULL, 0);
            }
    }
    for (int g = 0; g < model.n_groups; ++g)
        if ((wanted >> g & 1u) && !all_finite(c->y + model.groups[g].first, model.groups[g].count))
            return complain(c, ERROR, "an output of %s is not a finite number at t = %g s", model.name, c->time);
    c->fresh |= wanted;
    return OK;
}

Status derivatives(Instance *c) {
    /* what was set since decides where the states start */
    Status status = c->mode == INITIALIZATION ? start(c) : OK;
    if (status || !model.n_x || (c->fresh >> DERIVATIVES_BIT)) return status;
    const double *arg[4] = {c->p, c->u, c->x, c->k};
    double *res[1] = {c->dx};
    model.derivatives(arg, res, NULL, NULL, 0);
    if (!all_finite(c->dx, model.n_x)) return complain(c, ERROR, "a derivative is not a finite number at t = %g s", c->time);
    c->fresh |= 1u << DERIVATIVES_BIT;
    return OK;
}

Status get(Instance *c, const unsigned *reference, size_t n, double *value) {
    unsigned needs = 0;
    for (size_t k = 0; k < n; ++k) {
        if (reference[k] > c->n_references) return unknown_reference(c, reference[k]);
        needs |= c->needs[reference[k]];
    }
    if (needs) {
        /* before the states are started there is nothing to show but parameters and inputs */
        if (c->mode == INSTANTIATED) return complain(c, ERROR, "outputs cannot be read before initialization");
        Status status = c->mode == INITIALIZATION ? start(c) : OK;
        if (!status) status = evaluate(c, needs & ((1u << STARTED_BIT) - 1u));
        if (!status && (needs >> DERIVATIVES_BIT)) status = derivatives(c);
        if (status) return status;
    }
    c->block[c->slot[c->n_references]] = c->time;
    for (size_t k = 0; k < n; ++k) value[k] = c->block[c->slot[reference[k]]];
    return OK;
}

Status set(Instance *c, unsigned reference, double value) {
    const int i = (int)reference;
    if (reference >= c->n_references) return unknown_reference(c, reference);
    if (i >= model.n_p + model.n_u)
        return complain(c, ERROR, "value reference %u is an output and cannot be set", reference);
    const Quantity *q = &model.declared[i];
    if (!isfinite(value)) return complain(c, ERROR, "%s = %g %s: must be a finite number", q->name, value, q->unit);
    if (i < model.n_p && !(c->mode & (INSTANTIATED | INITIALIZATION))) {
        if (!q->tunable)
            return complain(c, ERROR, "%s is fixed: set it before initialization or after reset", q->name);
        if (!((q->open_low ? value > q->low : value >= q->low) && value <= q->high))
            return complain(c, ERROR, "%s = %g %s: must be %s", q->name, value, q->unit, q->allowed);
    }
    if (c->p[i] != value) {
        c->p[i] = value;
        c->fresh = 0;
        c->closed = 0;
        if (c->mode & (INSTANTIATED | INITIALIZATION)) c->changed = 1;
    }
    if (i >= model.n_p) c->du[i - model.n_p] = 0.0;
    return OK;
}

Status set_input_derivative(Instance *c, unsigned reference, double value) {
    const int i = (int)reference - model.n_p;
    if (i < 0 || i >= model.n_u) return complain(c, ERROR, "value reference %u is not an input", reference);
    if (!isfinite(value))
        return complain(c, ERROR, "derivative of %s: must be a finite number", model.declared[reference].name);
    c->du[i] = value;
    return OK;
}

static Status count_states(Instance *c, size_t n, const void *pointer, const char *call) {
    if (n != (size_t)model.n_x) return complain(c, ERROR, "%s: there are %d states", call, model.n_x);
    if (n && !pointer) return complain(c, ERROR, "%s: null argument", call);
    return OK;
}

Status states_set(Instance *c, const double *x, size_t n, const char *call) {
    Status status = count_states(c, n, x, call);
    if (status) return status;
    if (n && !all_finite(x, (int)n)) return complain(c, ERROR, "%s: a state is not a finite number", call);
    if (n) memcpy(c->x, x, n * sizeof *x);
    c->fresh = 0;
    c->closed = 0;
    return OK;
}

Status states_get(Instance *c, const double *from, double *to, size_t n, const char *call) {
    Status status = count_states(c, n, to, call);
    if (!status && c->mode == INITIALIZATION) status = start(c);
    if (!status && n) memcpy(to, from, n * sizeof *to);
    return status;
}

/* -- derivatives of outputs */

/* The directional derivative of a group without a kernel for it, of relative error 1e-9 or so: outputs on both sides
 * at a distance that is small against inputs and states of the size of 1 and more. */
static void differences(Instance *c, const Group *g, const double *du, const double *dx, double *dy) {
    const int n_u = model.n_u, n_x = model.n_x;
    double *u = dy + model.n_y + n_x, *x = u + n_u, *other = x + n_x, steepest = 0.0;
    for (int i = 0; i < n_u + n_x; ++i) {
        const double at = i < n_u ? c->u[i] : c->x[i - n_u], seed = i < n_u ? du[i] : dx[i - n_u];
        const double share = fabs(seed) / (fabs(at) > 1.0 ? fabs(at) : 1.0);
        if (share > steepest) steepest = share;
    }
    const double distance = steepest > 0.0 ? 1e-5 / steepest : 1.0;
    const double *arg[4] = {c->p, u, x, c->k};
    double *res[1];
    for (int sense = 1; sense >= -1; sense -= 2) {
        for (int i = 0; i < n_u; ++i) u[i] = c->u[i] + sense * distance * du[i];
        for (int i = 0; i < n_x; ++i) x[i] = c->x[i] + sense * distance * dx[i];
        res[0] = sense > 0 ? dy + g->first : other;
        g->values(arg, res, NULL, NULL, 0);
    }
    for (int i = 0; i < g->count; ++i) dy[g->first + i] = (dy[g->first + i] - other[i]) / (2.0 * distance);
}

Status forward(Instance *c, const unsigned *unknown, size_t n_unknown, const unsigned *known, size_t n_known,
               const double *seed, double *sensitivity) {
    double *du = c->work, *dx = du + model.n_u, *dy = dx + model.n_x, *ddx = dy + model.n_y;
    memset(du, 0, (size_t)(model.n_u + model.n_x) * sizeof(double));
    for (size_t k = 0; k < n_known; ++k) {
        const int i = (int)known[k] - model.n_p;
        if (i < 0 || i >= model.n_u + model.n_x || known[k] > 1000000u)
            return complain(c, ERROR, "directional derivative: value reference %u is neither input nor state", known[k]);
        du[i] += seed[k]; /* inputs and states follow each other in both */
    }
    const double *arg[6] = {c->p, c->u, c->x, du, dx, c->k};
    unsigned done = 0;
    for (size_t k = 0; k < n_unknown; ++k) {
        int i = (int)unknown[k] - model.n_p - model.n_u;
        if (i < 0 || i >= 2 * model.n_x + model.n_y || unknown[k] > 1000000u)
            return complain(c, ERROR, "directional derivative: value reference %u is no output", unknown[k]);
        if (i < model.n_x) {
            sensitivity[k] = dx[i];
            continue;
        }
        i -= model.n_x;
        if (i < model.n_y) {
            const int g = model.group_of[i];
            if (!(done & (1u << g))) {
                double *res[1] = {dy + model.groups[g].first};
                if (model.groups[g].forward)
                    model.groups[g].forward(arg, res, NULL, NULL, 0);
                else
                    differences(c, &model.groups[g], du, dx, dy);
                done |= 1u << g;
            }
            sensitivity[k] = dy[model.place[i]];
        } else {
            if (!(done >> DERIVATIVES_BIT)) {
                double *res[1] = {ddx};
                model.derivatives_forward(arg, res, NULL, NULL, 0);
                done |= 1u << DERIVATIVES_BIT;
            }
            sensitivity[k] = ddx[i - model.n_y];
        }
        if (!isfinite(sensitivity[k]))
            return complain(c, ERROR, "directional derivative is not a finite number at t = %g s", c->time);
    }
    return OK;
}

/* The time derivative of an input: as the host gave it, else the input that the model declares to be it. */
static double input_rate(const Instance *c, int i) {
    if (c->du[i] != 0.0) return c->du[i];
    return model.rate_of[i] < 0 ? 0.0 : c->u[model.rate_of[i]];
}

static double input_curvature(const Instance *c, int i) {
    return c->du[i] != 0.0 || model.rate_of[i] < 0 ? 0.0 : input_rate(c, model.rate_of[i]);
}

Status output_derivative(Instance *c, unsigned reference, double *value) {
    Status status = derivatives(c);
    if (status) return status;
    const int n = model.n_u + model.n_x;
    unsigned *known = malloc((size_t)(n ? n : 1) * sizeof *known);
    double *seed = malloc((size_t)(n ? n : 1) * sizeof *seed);
    if (!known || !seed) {
        free(known);
        free(seed);
        return complain(c, ERROR, "out of memory");
    }
    for (int i = 0; i < n; ++i) {
        known[i] = (unsigned)(model.n_p + i);
        seed[i] = i < model.n_u ? input_rate(c, i) : c->dx[i - model.n_u];
    }
    status = forward(c, &reference, 1, known, (size_t)n, seed, value);
    free(known);
    free(seed);
    return status;
}

/* -- co-simulation; inputs run along their derivatives, to the end of the step */

/* Inputs on their way through a step: `at` are those of the moment. */
typedef struct {
    double *at;
    const double *rate, *half; /* first derivative, and half of the second */
} Course;

static void run_to(const Instance *c, const Course *u, double since) {
    for (int i = 0; i < model.n_u; ++i) u->at[i] = c->u[i] + since * (u->rate[i] + since * u->half[i]);
}

static int slope(Instance *c, const Course *u, double since, const double *x, double *dx) {
    run_to(c, u, since);
    const double *arg[4] = {c->p, u->at, x, c->k};
    double *res[1] = {dx};
    model.derivatives(arg, res, NULL, NULL, 0);
    return all_finite(dx, model.n_x);
}

static double number(Kernel kernel, const Instance *c) {
    double value = 0.0;
    const double *arg[1] = {c->p};
    double *res[1] = {&value};
    kernel(arg, res, NULL, NULL, 0);
    return value;
}

static Status astray(Instance *c, double time) {
    return complain(c, DISCARD, "the states left all bounds in the step from t = %g s", time);
}

#define MOST_STEPS 1e6 /* that a step may take of its own */

/* The classical Runge-Kutta method with equal steps, its cost known beforehand. */
static Status even_steps(Instance *c, double time, double size, const Course *u, double *work) {
    const int n_x = model.n_x;
    double *x = work, *k = x + n_x, *sum = k + n_x, *at = sum + n_x;
    const double longest = number(model.internal_step, c);
    const double wanted = ceil(size / longest - 1e-9);
    if (!(wanted < MOST_STEPS))
        return complain(c, DISCARD, "step of %g s: must be < %g s", size, MOST_STEPS * longest);
    const long n = wanted < 1.0 ? 1 : (long)wanted;
    const double h = size / (double)n;
    static const double node[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    memcpy(x, c->x, (size_t)n_x * sizeof(double));
    for (long s = 0; s < n; ++s) {
        for (int i = 0; i < n_x; ++i) sum[i] = 0.0;
        for (int stage = 0; stage < 4; ++stage) {
            for (int i = 0; i < n_x; ++i) at[i] = stage ? x[i] + node[stage] * h * k[i] : x[i];
            if (!slope(c, u, h * ((double)s + node[stage]), at, k)) return astray(c, time);
            for (int i = 0; i < n_x; ++i) sum[i] += weight[stage] * k[i];
        }
        for (int i = 0; i < n_x; ++i) x[i] += h / 6.0 * sum[i];
    }
    memcpy(c->x, x, (size_t)n_x * sizeof(double));
    return OK;
}

/* Put the states, in `x`, where the constraints are met at `since`. */
static int close_states(Instance *c, const Course *u, double since, double *x, double *spare) {
    run_to(c, u, since);
    const double *arg[4] = {c->p, u->at, x, c->k};
    double *res[1] = {spare};
    model.closed(arg, res, NULL, NULL, 0);
    if (!all_finite(spare, model.n_x)) return 0;
    memcpy(x, spare, (size_t)model.n_x * sizeof(double));
    return 1;
}

/* The pair of Dormand and Prince of orders 5 and 4, its error controlled to the model's tolerance, the constraints
 * closed after each step. A step that is as short as SHORTEST of the longest is taken as it is: a snatch must not
 * stop a run. Coefficients: J. Comp. Appl. Math. 6 (1980) 19. */
#define SHORTEST 1e-6

static Status controlled_steps(Instance *c, double time, double size, const Course *u, double *work) {
    static const double node[6] = {0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0};
    static const double a[6][6] = {
        {0.0},
        {1.0 / 5.0},
        {3.0 / 40.0, 9.0 / 40.0},
        {44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0},
        {19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0},
        {9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0},
    };
    static const double fifth[6] = {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0};
    static const double wrong[7] = {71.0 / 57600.0,      0.0,          -71.0 / 16695.0, 71.0 / 1920.0,
                                    -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0};
    const int n_x = model.n_x;
    double *x = work, *at = x + n_x, *k = at + n_x;
    const double longest = number(model.internal_step, c), tolerance = number(model.tolerance, c);
    memcpy(x, c->x, (size_t)n_x * sizeof(double));
    for (int round = 0; !c->closed && round < 2; ++round)
        if (!close_states(c, u, 0.0, x, at)) return astray(c, time);
    if (!(size < MOST_STEPS * longest))
        return complain(c, DISCARD, "step of %g s: must be < %g s", size, MOST_STEPS * longest);
    long taken = 0;
    double since = 0.0, pace = c->pace > 0.0 ? c->pace : 0.01 * longest;
    while (since < size) {
        if (++taken > MOST_STEPS)
            return complain(c, DISCARD, "step of %g s from t = %g s takes more than %g of its own; shorten it", size,
                            time, MOST_STEPS);
        const double left = size - since;
        /* no tiny rest: what is left is taken in one step or in two alike */
        const double h = pace >= left ? left : pace > 0.5 * left ? 0.5 * left : pace;
        int usable = 1;
        for (int s = 0; s < 7 && usable; ++s) {
            for (int i = 0; i < n_x; ++i) {
                double sum = 0.0;
                for (int j = 0; j < s && j < 6; ++j) sum += (s < 6 ? a[s][j] : fifth[j]) * k[j * n_x + i];
                at[i] = x[i] + h * sum;
            }
            usable = slope(c, u, since + h * (s < 6 ? node[s] : 1.0), at, k + s * n_x);
        }
        double error = 0.0;
        for (int i = 0; i < n_x && usable; ++i) {
            double sum = 0.0;
            for (int s = 0; s < 7; ++s) sum += wrong[s] * k[s * n_x + i];
            const double big = fabs(x[i]) > fabs(at[i]) ? fabs(x[i]) : fabs(at[i]);
            const double scale = tolerance * (big > model.nominal[i] ? big : model.nominal[i]);
            if (fabs(h * sum) > error * scale) error = fabs(h * sum) / scale;
        }
        const int last_resort = h <= SHORTEST * longest;
        if (!usable && last_resort) return astray(c, time);
        if (usable && (error <= 1.0 || last_resort)) {
            since = h >= left ? size : since + h;
            memcpy(x, at, (size_t)n_x * sizeof(double));
            if (!close_states(c, u, since, x, at)) return astray(c, time);
        }
        const double factor = !usable ? 0.1 : error < 1e-4 ? 5.0 : 0.9 * pow(error, -0.2);
        double next = h * (factor < 0.2 ? 0.2 : factor > 5.0 ? 5.0 : factor);
        /* a step that was cut short by the end says nothing against a longer one */
        if (usable && error <= 1.0 && h < pace && next < pace) next = pace;
        pace = next > longest ? longest : next < SHORTEST * longest ? SHORTEST * longest : next;
    }
    memcpy(c->x, x, (size_t)n_x * sizeof(double));
    c->pace = pace;
    c->closed = 1;
    return OK;
}

Status step(Instance *c, double time, double size) {
    if (!isfinite(time) || !isfinite(size) || size < 0.0)
        return complain(c, ERROR, "step of %g s from t = %g s: must be finite and not negative", size, time);
    const int n_x = model.n_x, n_u = model.n_u;
    double *u = c->work, *rate = u + n_u, *half = rate + n_u;
    for (int i = 0; i < n_u; ++i) {
        rate[i] = input_rate(c, i);
        half[i] = 0.5 * input_curvature(c, i);
        u[i] = c->u[i] + size * (rate[i] + size * half[i]);
        if (!isfinite(u[i]))
            return complain(c, DISCARD, "%s leaves all bounds in the step from t = %g s",
                            model.declared[model.n_p + i].name, time);
    }
    if (n_x && size > 0.0) {
        const Course course = {u, rate, half};
        Status status = (model.closed ? controlled_steps : even_steps)(c, time, size, &course, half + n_u);
        if (status) return status;
        c->fresh = 0;
    }
    for (int i = 0; i < n_u; ++i)
        if (rate[i] != 0.0 || half[i] != 0.0) {
            c->u[i] += size * (rate[i] + size * half[i]);
            c->fresh = 0;
        }
    c->time = time + size;
    return OK;
}

/* -- model exchange */

/* What a state may lie off the constraints, in parts of the integrator's tolerance, before an event corrects it: much,
 * as an importer's solver begins anew after each event, and errs more by that than by a small drift. */
#define OFF_MOST 1e3

/* The states that meet the constraints, in `work`; the largest correction in parts of `tolerance` and the size of the
 * state, or NaN where there are none. */
static double off(Instance *c) {
    const double tolerance = number(model.tolerance, c), *arg[4] = {c->p, c->u, c->x, c->k};
    double *res[1] = {c->work}, most = 0.0;
    model.closed(arg, res, NULL, NULL, 0);
    if (!all_finite(c->work, model.n_x)) return NAN;
    for (int i = 0; i < model.n_x; ++i) {
        const double size = fabs(c->x[i]) > model.nominal[i] ? fabs(c->x[i]) : model.nominal[i];
        const double share = fabs(c->work[i] - c->x[i]) / (tolerance * size);
        if (share > most) most = share;
    }
    return most;
}

int drifted(Instance *c) { return model.closed && off(c) > OFF_MOST; }

Status project(Instance *c, int *moved) {
    *moved = 0;
    if (!model.closed || !c->model_exchange) return OK;
    for (int round = 0; round < 4; ++round) {
        const double share = off(c);
        if (isnan(share)) return complain(c, ERROR, "no states near these meet the constraints at t = %g s", c->time);
        /* below it the correction would cost the importer a new start and gain nothing */
        if (share <= 1.0) break;
        memcpy(c->x, c->work, (size_t)model.n_x * sizeof(double));
        c->fresh = 0;
        *moved = 1;
    }
    return OK;
}

/* -- saved states */

size_t state_size(const Instance *c) { return sizeof(Saved) + c->block_size; }

void state_write(const Instance *c, void *memory) {
    Saved saved;
    memset(&saved, 0, sizeof saved);
    saved.mode = (int)c->mode;
    saved.model_exchange = c->model_exchange;
    saved.closed = c->closed;
    saved.time = c->time;
    saved.pace = c->pace;
    saved.guard = guard();
    memcpy(memory, &saved, sizeof saved);
    memcpy((char *)memory + sizeof saved, c->block, c->block_size);
}

Status state_read(Instance *c, const void *memory, size_t size) {
    Saved saved;
    if (size != state_size(c)) return complain(c, ERROR, "saved state: its size is not this model's");
    memcpy(&saved, memory, sizeof saved);
    if (saved.guard != guard() || saved.model_exchange != c->model_exchange)
        return complain(c, ERROR, "saved state: it belongs to another model or kind of simulation");
    const int mode = saved.mode, known = INSTANTIATED | INITIALIZATION | EVENT | CONTINUOUS | STEP | TERMINATED;
    /* parameters, inputs and states come first; what follows from them is evaluated anew */
    const size_t first = (size_t)(c->dx - c->block) * sizeof(double);
    double *values = c->work;
    memcpy(values, (const char *)memory + sizeof saved, first);
    if (!(mode & known) || (mode & (mode - 1)) || !isfinite(saved.time) || !(saved.pace >= 0.0) || !all_finite(values, (int)(c->dx - c->block)))
        return complain(c, ERROR, "saved state: it is damaged");
    memcpy(c->block, values, first);
    c->mode = (Mode)saved.mode;
    c->time = saved.time;
    c->pace = saved.pace;
    c->closed = saved.closed;
    c->fresh = 0;
    c->changed = c->mode == INSTANTIATED || c->mode == INITIALIZATION;
    return OK;
}
