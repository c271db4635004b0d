/* The loop of transients: W runs side by side, each with its own time. The generated code before it defines the sizes,
 * the functions `uniform`, `rates`, `results` and `closed`, and
 *
 * METHOD   EVEN: equal steps; TO_ROWS: error control with steps that end at rows, for models with constraints;
 *          INTERPOLATED: error control with steps of any length
 * PUT      statements that set a[], the arguments that differ between runs, from b->given[], signals at t, and x[]
 * GUARDED  statements that set `ends` where a result y[][l] of run r + l is beyond its limit
 *
 * Steps and error control are those of chainunit.integrate. */

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

/* the arguments of the equations that differ between runs */
typedef struct { const double *U, *signal; long runs; double step; v given[PARAMS + 1], a[COLUMNS + 1]; } Block;

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

typedef struct {
  v t, h, pace;
  v x[STATES];
#if METHOD == INTERPOLATED
  v from[STATES], slope[STATES], k[7][STATES];
  int begun;
#endif
} Path;

#if METHOD != EVEN
/* error of a step over the permitted one, see chainunit.integrate.controlled */
static v error_of(const v *x, const v *at, const v *k, v h, double tolerance) {
  v error = V(0.0);
  for (int i = 0; i < STATES; ++i) {
    v sum = V(0.0);
    for (int s = 0; s < 7; ++s) sum += ERRORS[s] * k[s * STATES + i];
    const v big = fmax_v(fmax_v(fabs_v(x[i]), fabs_v(at[i])), V(NOMINAL[i]));
    error = fmax_v(error, fabs_v(h * sum) / (tolerance * big));
  }
  return error;
}

/* the next step */
static v paced(v pace, v h, v error, bits usable, double longest) {
  v growth = choose_v(error < NO_ERROR, V(MOST_GROWTH), SAFETY * pow_v(error, V(ERROR_POWER)));
  growth = choose_v(usable, growth, V(LEAST_GROWTH));
  v following = h * fmin_v(fmax_v(growth, V(LEAST_GROWTH)), V(MOST_GROWTH));
  /* a step that the end of the interval shortened does not shorten the next one */
  following = choose_v(usable & (error <= 1.0) & (h < pace), fmax_v(following, pace), following);
  return fmin_v(fmax_v(following, V(SHORTEST * longest)), V(longest));
}
#endif

#if METHOD == INTERPOLATED
/* error control, in each lane for itself, with steps that end where a signal bends, and not at every row; the state at
 * a row is that of the interpolation of fourth order. The last stage of a step is the first of the next one. */
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

static bits advance(Block *b, Path *q, v next, v end, bits going, double longest, double tolerance, double most) {
  bits sound = ~(bits){0};
  going &= q->t < next;
  for (double taken = 0.0; any(going); taken += 1.0) {
    if (taken >= most) return sound & ~going;
    if (!q->begun) {
      put(b, q->x, q->t);
      rates(b->U, b->a, q->slope);
      q->begun = 1;
    }
    const v to = fmin_v(end, next_bend(b, q->t)), left = to - q->t;
    const v piece = choose_v(q->pace >= left, left, choose_v(q->pace > 0.5 * left, 0.5 * left, q->pace));
    const v h = choose_v(going, piece, V(0.0));
    v at[STATES], k[7][STATES];
    for (int i = 0; i < STATES; ++i) k[0][i] = q->slope[i];
    for (int s = 1; s < 7; ++s) {
      for (int i = 0; i < STATES; ++i) {
        v sum = V(0.0);
        for (int j = 0; j < s; ++j) sum += STAGES[s][j] * k[j][i];
        at[i] = q->x[i] + h * sum;
      }
      put(b, at, q->t + NODES[s] * h);
      rates(b->U, b->a, k[s]);
    }
    const v error = error_of(q->x, at, (const v *)k, h, tolerance);
    const bits usable = finite_all(at, STATES) & finite_all(k[6], STATES), last = h <= SHORTEST * longest;
    const bits accepted = going & usable & ((error <= 1.0) | last);
    q->pace = choose_v(going, paced(q->pace, h, error, usable, longest), q->pace);
    q->t = choose_v(accepted, choose_v(h >= left, to, q->t + h), q->t);
    q->h = choose_v(accepted, h, q->h);
    for (int i = 0; i < STATES; ++i) {
      q->from[i] = choose_v(accepted, q->x[i], q->from[i]);
      q->x[i] = choose_v(accepted, at[i], q->x[i]);
      q->slope[i] = choose_v(accepted, k[6][i], q->slope[i]);
      for (int s = 0; s < 7; ++s) q->k[s][i] = choose_v(accepted, k[s][i], q->k[s][i]);
    }
    sound &= ~(going & last & ~usable);
    going &= sound & (q->t < next);
  }
  return sound;
}

static void state_at(const Path *q, v t, v *x) {
  const v z = choose_v(q->h > 0.0, (t - q->t) / q->h + 1.0, V(1.0));
  v weight[7];
  for (int s = 0; s < 7; ++s)
    weight[s] = q->h * z * (DENSE[s][0] + z * (DENSE[s][1] + z * (DENSE[s][2] + z * DENSE[s][3])));
  for (int i = 0; i < STATES; ++i) {
    v sum = V(0.0);
    for (int s = 0; s < 7; ++s) sum += weight[s] * q->k[s][i];
    x[i] = choose_v(t < q->t, q->from[i] + sum, q->x[i]);
  }
}
#else
#if METHOD == TO_ROWS
/* error control, in each lane for itself, see chainunit.integrate.controlled */
static bits advance(Block *b, Path *q, v next, v end, bits going, double longest, double tolerance, double most) {
  (void)end;
  const v t = q->t, size = next - t;
  v since = V(0.0), *const x = q->x, *const pace = &q->pace;
  bits sound = ~(bits){0};
  for (double taken = 0.0; any(going); taken += 1.0) {
    if (taken >= most) return sound & ~going;
    const v left = size - since;
    const v piece = choose_v(*pace >= left, left, choose_v(*pace > 0.5 * left, 0.5 * left, *pace));
    const v h = choose_v(going, piece, V(0.0));
    v at[STATES], k[7][STATES];
    for (int s = 0; s < 7; ++s) {
      for (int i = 0; i < STATES; ++i) {
        v sum = V(0.0);
        for (int j = 0; j < s; ++j) sum += STAGES[s][j] * k[j][i];
        at[i] = x[i] + h * sum;
      }
      put(b, at, t + since + NODES[s] * h);
      rates(b->U, b->a, k[s]);
    }
    const v error = error_of(x, at, (const v *)k, h, tolerance);
    const bits usable = finite_all(at, STATES) & finite_all(k[6], STATES), last = h <= SHORTEST * longest;
    const bits accepted = going & usable & ((error <= 1.0) | last);
    *pace = choose_v(going, paced(*pace, h, error, usable, longest), *pace);
    since = choose_v(accepted, choose_v(h >= left, size, since + h), since);
    if (any(accepted)) {
      v met[STATES];
      put(b, at, t + since);
      closed(b->U, b->a, met);
      for (int i = 0; i < STATES; ++i) x[i] = choose_v(accepted, met[i], x[i]);
    }
    sound &= ~(going & last & ~usable);
    going &= sound & (since < size);
  }
  q->t = next;
  return sound;
}
#else
/* equal steps, see chainunit.integrate.rk4 */
static bits advance(Block *b, Path *q, v next, v end, bits going, double longest, double tolerance, double most) {
  (void)tolerance, (void)end;
  const v t = q->t;
  v *const x = q->x;
  /* as many as in a whole step: a shorter last step of one run must not depend on the others */
  double count = ceil(b->step / longest - 1e-9);
  if (count < 1.0) count = 1.0;
  if (count > most) return ~going;
  const v h = (next - t) / count;
  for (double s = 0.0; s < count; s += 1.0) {
    v later[STATES], stage[STATES], k[STATES];
    for (int i = 0; i < STATES; ++i) later[i] = x[i], k[i] = V(0.0);
    for (int j = 0; j < (int)(sizeof(RK4_NODES) / sizeof(double)); ++j) {
      for (int i = 0; i < STATES; ++i) stage[i] = x[i] + RK4_NODES[j] * h * k[i];
      put(b, stage, t + (s + RK4_NODES[j]) * h);
      rates(b->U, b->a, k);
      for (int i = 0; i < STATES; ++i) later[i] += RK4_WEIGHTS[j] * h * k[i];
    }
    for (int i = 0; i < STATES; ++i) x[i] = choose_v(going, later[i], x[i]);
  }
  q->t = next;
  return ~(bits){0};
}
#endif

static void state_at(const Path *q, v t, v *x) {
  (void)t;
  for (int i = 0; i < STATES; ++i) x[i] = q->x[i];
}
#endif

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
