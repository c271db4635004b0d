/* The kernels of a batch over states on a GPU. The generated code before it is that of states.h. The uniform values of a
 * row are computed first, once for all of its states. A thread computes a state, or, for results that are reduced, a warp
 * a piece of a row; the pieces are put together at last. */
#define NUMBER_OF_THREAD (blockIdx.x * (long long)blockDim.x + threadIdx.x)

extern "C" __global__ void rows(long long count, const double *const *in, const long long *in_step, double *U) {
    const long long o = NUMBER_OF_THREAD;
    if (o >= count) return;
    double given[INPUTS + 1];
    for (int k = 0; k < INPUTS; ++k) given[k] = in[k][o * in_step[k]];
    uniform(given, U + o * ROOM);
}

/* the results `y` of a state of a row; its reason, with which they are NaN */
PER_VECTOR int state(const double *restrict U, const double *const *restrict column,
                     const long long *restrict column_step, long long o, long long i, v *y) {
    v a[COLUMNS + 1], finite = 0.0;
    for (int k = 0; k < COLUMNS; ++k) a[k] = column[k][o * column_step[k] + i];
    states(U + o * ROOM, a, y);
    for (int r = 0; r < RESULTS; ++r) finite += y[r] * 0.0;
    if (finite == finite && y[RESULTS] == 0.0) return 0;
    for (int r = 0; r < RESULTS; ++r) y[r] = NAN;
    return y[RESULTS] != 0.0 ? (int)y[RESULTS] : NOT_FINITE;
}

#if REDUCED
#define BINS(h, row, bins) \
    int *const h = counters + row; \
    for (int b = lane; b < bins; b += WARP) h[b] = 0;
#define COUNT(h, y, low, per, bins) atomicAdd(h + bin_of(y, low, per, bins), 1);
#define PART(row, x) { const double s = x; if (!lane) part[(row)*warps + w] = s; }
#define PART_COUNTS(row, h, bins) for (int b = lane; b < bins; b += WARP) part[(row + b) * warps + w] = (double)h[b];
extern "C" __global__ void __launch_bounds__(BLOCK) pieces(
    long long count, long long n, long long parts, const double *restrict U, const double *const *restrict column,
    const long long *restrict column_step, const double *restrict L, double *restrict part, short *restrict part_reason) {
    __shared__ int counts[BLOCK / WARP][COUNTERS];
    const long long warps = count * parts, w = NUMBER_OF_THREAD / WARP, o = w / parts, p = w - o * parts;
    const int lane = threadIdx.x % WARP;
    if (w >= warps) return;
    int *const counters = counts[threadIdx.x / WARP];
    int worst = 0;
    const double one = 1.0;
    BEGIN
    (void)counters, (void)one;
    __syncwarp();
    for (long long i = n * p / parts + lane; i < n * (p + 1) / parts; i += WARP) {
        v y[RESULTS + 1];
        const int code = state(U, column, column_step, o, i, y);
        if (code > worst) worst = code;
        TAKE
    }
    __syncwarp();
    PARTS
    worst = (int)lane_largest((double)worst);
    if (!lane) part_reason[w] = (short)worst;
}

#define OVER_PARTS(name, take) \
    PER_VECTOR double name(const double *x, long long parts) { \
        double s = x[0]; \
        for (long long k = 1; k < parts; ++k) s = take; \
        return s; \
    }
OVER_PARTS(part_sum, s + x[k])
OVER_PARTS(part_least, x[k] < s ? x[k] : s)
OVER_PARTS(part_largest, x[k] > s ? x[k] : s)
#define SUM(a, row) part_sum(part + (row)*warps + o * parts, parts)
#define LEAST(a, row) part_least(part + (row)*warps + o * parts, parts)
#define LARGEST(a, row) part_largest(part + (row)*warps + o * parts, parts)
#define RESULT(row, x) out[row][o] = worst ? NAN : (x);
#define COUNTS(row, h, bins) for (int b = 0; b < bins; ++b) RESULT(row + b, SUM(h, row + b))
extern "C" __global__ void finish(long long count, long long n, long long parts, const double *restrict part,
                                  const short *restrict part_reason, double *const *restrict out, short *restrict reason) {
    const long long o = NUMBER_OF_THREAD, warps = count * parts;
    if (o >= count) return;
    short worst = 0;
    for (long long k = 0; k < parts; ++k)
        if (part_reason[o * parts + k] > worst) worst = part_reason[o * parts + k];
    (void)n;
    END
    reason[o] = worst;
}
#else
extern "C" __global__ void __launch_bounds__(BLOCK, RESIDENT) stored(
    long long count, long long n, const double *restrict U, const double *const *restrict column,
    const long long *restrict column_step, double *const *restrict out, short *restrict reason) {
    const long long s = NUMBER_OF_THREAD;
    if (s >= count * n) return;
    const long long o = count == 1 ? 0 : s / n;
    v y[RESULTS + 1];
    reason[s] = (short)state(U, column, column_step, o, s - o * n, y);
    for (int r = 0; r < RESULTS; ++r) out[r][s] = y[r];
}
#endif
