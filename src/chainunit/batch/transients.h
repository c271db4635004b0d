/* The loop of transients: W runs side by side, each with its own time. The generated code before it defines the sizes,
 * the functions `uniform`, `rates`, `results` and `closed`, and
 *
 * METHOD   EVEN: equal steps; TO_ROWS: error control with steps that end at rows, for models with constraints;
 *          INTERPOLATED: error control with steps of any length
 * PUT      statements that set a[], the arguments that differ between runs, from b->given[], signals at t, and x[]
 * GUARDED  statements that set `ends` where a result y[][l] of run r + l is beyond its limit
 *
 * step.h has the steps and their error control. */

#define EVEN 0
#define TO_ROWS 1
#define INTERPOLATED 2

/* a value with quintic steps: the value before, then for each step begin, duration and value after */
static v signal_at(const double *s, long runs, v t) {
  v before = LOAD(s), y = before;
  for (int k = 0; k < CHANGES; ++k) {
    const v begin = LOAD(s + (1 + 3 * k) * runs), duration = LOAD(s + (2 + 3 * k) * runs);
    const v after = LOAD(s + (3 + 3 * k) * runs);
    const v z = fmin_v(fmax_v((t - begin) / duration, V(0.0)), V(1.0));
    y += (after - before) * (z * z * z * (10.0 + z * (6.0 * z - 15.0)));
    before = after;
  }
  return y;
}

/* the arguments of the equations that differ between runs, and the time from which a step counts */
typedef struct { const double *U, *signal; long runs; double step; v origin, given[PARAMS + 1], a[COLUMNS + 1]; } Block;

static void put(Block *b, const v *x, v t) {
  v *const a = b->a;
  (void)a, (void)x, (void)t;
  PUT
}

static bits finite_all(const v *x, int n) {
  v sum = V(0.0);
  for (int i = 0; i < n; ++i) sum += x[i] * 0.0;
  return sum == sum;
}

typedef v Number;
typedef bits Truth;
typedef Block Course;
#define ALL_TRUE (~(bits){0})
#define GOES_ON(truth) 1
#define OF_DOUBLE V
#define CHOOSE choose_v
#define SMALLER fmin_v
#define LARGER fmax_v
#define SIZE fabs_v
#define POWER(x, exponent) pow_v(x, V(exponent))
static inline bits slope_at(Block *b, v since, const v *x, v *k) {
  put(b, x, b->origin + since);
  rates(b->U, b->a, k);
  return ALL_TRUE; /* what is not finite shows in the states at last */
}
#include "step.h"

typedef struct {
  v t, h, pace;
  v x[STATES];
#if METHOD == INTERPOLATED
  v from[STATES], slope[STATES], k[7 * STATES];
  int begun;
#endif
} Path;

#if METHOD == INTERPOLATED
/* the first time after a time at which a signal bends */
static v next_bend(const Block *b, v t) {
  v bend = V(INFINITY);
  for (int i = 0; i < SIGNALS; ++i)
    for (int k = 0; k < CHANGES; ++k) {
      const double *change = b->signal + (i * (1 + 3 * CHANGES) + 1 + 3 * k) * b->runs;
      const v begin = LOAD(change), last = begin + LOAD(change + b->runs);
      bend = fmin_v(bend, choose_v(begin > t, begin, choose_v(last > t, last, V(INFINITY))));
    }
  return bend;
}
#endif

#if METHOD != EVEN
/* Error control, in each lane for itself. Steps end at rows, and the constraints are closed after each; or they end where
 * a signal bends, and not at every row. Then the state at a row is that of the interpolation of fourth order, and the
 * last stage of a step is the first one of the next. */
static bits advance(Block *b, Path *q, v next, v end, bits going, double longest, double tolerance, double most) {
  bits sound = ALL_TRUE;
  const int between = METHOD == INTERPOLATED;
  b->origin = between ? V(0.0) : q->t;
  const v until = next - b->origin;
  v since = q->t - b->origin;
  going &= since < until;
  for (double taken = 0.0; any(going); taken += 1.0) {
    if (taken >= most) return sound & ~going;
    v at[STATES], k[7 * STATES], limit = until;
#if METHOD == INTERPOLATED
    if (!q->begun) slope_at(b, since, q->x, q->slope);
    q->begun = 1;
    limit = fmin_v(end, next_bend(b, since));
    for (int i = 0; i < STATES; ++i) k[i] = q->slope[i];
#endif
    const v left = limit - since, h = choose_v(going, step_size(q->pace, left), V(0.0));
    const bits usable = dormand_prince(b, STATES, between, since, h, q->x, k, at);
    const v error = error_of(STATES, q->x, at, k, h, tolerance, NOMINAL);
    const bits last = h <= SHORTEST * longest, accepted = going & usable & ((error <= 1.0) | last);
    q->pace = choose_v(going, next_pace(q->pace, h, error, usable, longest), q->pace);
    since = choose_v(accepted, choose_v(h >= left, limit, since + h), since);
#if METHOD == INTERPOLATED
    q->t = since;
    q->h = choose_v(accepted, h, q->h);
    for (int i = 0; i < STATES; ++i) {
      q->from[i] = choose_v(accepted, q->x[i], q->from[i]);
      q->slope[i] = choose_v(accepted, k[6 * STATES + i], q->slope[i]);
      q->x[i] = choose_v(accepted, at[i], q->x[i]);
    }
    for (int i = 0; i < 7 * STATES; ++i) q->k[i] = choose_v(accepted, k[i], q->k[i]);
#else
    if (any(accepted)) {
      put(b, at, b->origin + since);
      closed(b->U, b->a, k);
      for (int i = 0; i < STATES; ++i) q->x[i] = choose_v(accepted, k[i], q->x[i]);
    }
#endif
    sound &= ~(going & last & ~usable);
    going &= sound & (since < until);
  }
  (void)end;
  if (!between) q->t = next;
  return sound;
}
#else
/* equal steps */
static bits advance(Block *b, Path *q, v next, v end, bits going, double longest, double tolerance, double most) {
  (void)tolerance, (void)end;
  /* as many as in a whole step: a shorter last step of one run must not depend on the others */
  double count = ceil(b->step / longest - 1e-9);
  if (count < 1.0) count = 1.0;
  if (count > most) return ~going;
  b->origin = q->t;
  const v h = (next - q->t) / count;
  for (double s = 0.0; s < count; s += 1.0) {
    v later[STATES], at[STATES], k[STATES];
    rk4(b, STATES, s, h, q->x, k, at, later);
    for (int i = 0; i < STATES; ++i) q->x[i] = choose_v(going, later[i], q->x[i]);
  }
  q->t = next;
  return ALL_TRUE;
}
#endif

/* the states at the time of a row */
static void state_at(const Path *q, v t, v *x) {
#if METHOD == INTERPOLATED
  const v z = choose_v(q->h > 0.0, (t - q->t) / q->h + 1.0, V(1.0));
  v weight[7];
  for (int s = 0; s < 7; ++s)
    weight[s] = q->h * z * (DENSE[s][0] + z * (DENSE[s][1] + z * (DENSE[s][2] + z * DENSE[s][3])));
  for (int i = 0; i < STATES; ++i) {
    v sum = V(0.0);
    for (int s = 0; s < 7; ++s) sum += weight[s] * q->k[s * STATES + i];
    x[i] = choose_v(t < q->t, q->from[i] + sum, q->x[i]);
  }
#else
  (void)t;
  for (int i = 0; i < STATES; ++i) x[i] = q->x[i];
#endif
}

void transients(long r0, long r1, long runs, long rows, double step, double longest, double tolerance,
                double most, const double *in, const double *param, const double *signal, const double *begin,
                const double *stop, const double *limit, double *x_of, double *out, long *count) {
  double U[ROOM];
  uniform(in, U);
  for (long r = r0; r < r1; r += W) {
    Block b = {U, signal + r, runs, step};
    v x[STATES], y[ROWS + 1], t0 = LOAD(begin + r), end = LOAD(stop + r), t = t0;
    Path q = {.t = t0, .pace = V(FIRST * longest)};
    for (int i = 0; i < PARAMS; ++i) b.given[i] = LOAD(param + i * runs + r);
    for (int i = 0; i < STATES; ++i) x[i] = q.x[i] = LOAD(x_of + i * runs + r);
    bits going = ~(bits){0};
    for (int l = 0; l < W; ++l) count[r + l] = 0;
    for (long n = 0; n < rows; ++n) {
      bits sound = ~(bits){0};
      if (n) {
        const v next = fmin_v(t0 + (double)n * step, end);
        going = next > t;
        if (!any(going)) break;
        sound = advance(&b, &q, next, end, going, longest, tolerance, most);
        v now[STATES];
        state_at(&q, next, now);
        for (int i = 0; i < STATES; ++i) x[i] = choose_v(going, now[i], x[i]);
        t = next;
      }
      put(&b, x, t);
      results(U, b.a, y);
      sound &= finite_all(x, STATES) & finite_all(y, ROWS);
      for (int l = 0; l < W; ++l) if (going[l]) {
        for (int i = 0; i < ROWS; ++i) out[(i * runs + r + l) * rows + n] = y[i][l];
        count[r + l] = sound[l] ? n + 1 : -(n + 1);
        int ends = !sound[l];
        GUARDED
        if (ends) end[l] = t[l];
      }
    }
    for (int i = 0; i < STATES; ++i) STORE(x_of + i * runs + r, x[i]);
  }
}
