/* The loop of a batch over states. The generated code before it defines the sizes, the functions `uniform` and `states`,
 * and, for results that are reduced over the inner dimension, the statements BEGIN, TAKE (of each vector) and END: see
 * `chainunit.batch.reductions.loop_text`. */
#define BINS(h, row, bins) long h[bins] = {0};
#define COUNT(h, y, low, per, bins) for (int l = 0; l < m; ++l) ++h[bin_of((y)[l], low, per, bins)];
#define SUM(a, row) lane_sum(a)
#define LEAST(a, row) lane_least(a)
#define LARGEST(a, row) lane_largest(a)
#define RESULT(row, x) out[row][o] = worst ? NAN : (x);
#define COUNTS(row, h, bins) for (int b = 0; b < bins; ++b) RESULT(row + b, (double)h[b])

void batch(long o0, long o1, long i0, long i1, long n, const double *const *in, const long *in_step,
           const double *const *column, const long *column_step, double *const *out, short *reason, const double *L) {
  for (long o = o0; o < o1; ++o) {
    double given[INPUTS + 1], U[ROOM];
    for (int k = 0; k < INPUTS; ++k) given[k] = in[k][o * in_step[k]];
    uniform(given, U);
    BEGIN
    short worst = 0;
    /* rows of a batch may lie a power of two apart, where stores of one state push one another out of the cache */
    double block[RESULTS + 1][BLOCK + W];
    long begin = i0;
    for (long i = i0; i < i1; i += W) {
      const long m = i1 - i < W ? i1 - i : W;
      v a[COLUMNS + 1], y[RESULTS + 1], one = V(1.0);
      for (int k = 0; k < COLUMNS; ++k) {
        const double *c = column[k] + o * column_step[k] + i;
        if (m == W) a[k] = LOAD(c);
        else for (int l = 0; l < W; ++l) a[k][l] = c[l < m ? l : m - 1];
      }
      if (m < W) for (int l = 0; l < W; ++l) one[l] = l < m;
      states(U, a, y);
      v finite = V(0.0);
      for (int r = 0; r < RESULTS; ++r) finite += y[r] * 0.0;
      const bits bad = (finite != finite) | (y[RESULTS] != 0.0);
      if (any(bad)) for (int l = 0; l < m; ++l) if (bad[l]) {
        const short code = y[RESULTS][l] != 0.0 ? (short)y[RESULTS][l] : NOT_FINITE;
        if (code > worst) worst = code;
        if (!REDUCED) reason[o * n + i + l] = code;
        for (int r = 0; r < RESULTS; ++r) y[r][l] = NAN;
      }
#if REDUCED
      TAKE
#else
      for (int r = 0; r < RESULTS; ++r) STORE(&block[r][i - begin], y[r]);
      if (i + W >= i1 || i + W - begin >= BLOCK) {
        const long length = (i + W < i1 ? i + W : i1) - begin;
        for (int r = 0; r < RESULTS; ++r) copy(out[r] + o * n + begin, block[r], length);
        begin = i + W;
      }
#endif
    }
#if REDUCED
    END
    reason[o] = worst;
#endif
  }
}
