/* Vectors of W doubles, in the vector extensions of GCC and Clang, and the operations of the generated code on them.
 * Functions without a vector form are computed lane by lane. */
#include <math.h>
#include <string.h>

/* vectors of 8 were no faster on processors that have them */
#if defined __AVX__
#include <immintrin.h>
#define W 4
#else
#define W 2
#endif

typedef double v __attribute__((vector_size(8 * W)));
typedef double v_free __attribute__((vector_size(8 * W), aligned(8), may_alias));
typedef long long bits __attribute__((vector_size(8 * W)));

#define V(x) ((v){0} + (x))
#define ONES(mask) ((v)((mask) & (bits)V(1.0)))
#define LOAD(p) (*(const v_free *)(p))
#define STORE(p, x) (*(v_free *)(p) = (x))

static inline double sign(double x) { return x < 0.0 ? -1.0 : x > 0.0 ? 1.0 : x; }

#define BY_LANES(f) \
    static inline v f##_v(v x) { \
        v y; \
        for (int k = 0; k < W; ++k) y[k] = f(x[k]); \
        return y; \
    }
#define PAIR_BY_LANES(f) \
    static inline v f##_v(v x, v z) { \
        v y; \
        for (int k = 0; k < W; ++k) y[k] = f(x[k], z[k]); \
        return y; \
    }
/* the vector functions of the GNU C library are exact to 4 units in the last place */
#if defined VECTOR_LIBRARY && defined __AVX2__ && W == 4
#define VECTOR(f) extern v _ZGVdN4v_##f(v); static inline v f##_v(v x) { return _ZGVdN4v_##f(x); }
#define VECTOR_PAIR(f) extern v _ZGVdN4vv_##f(v, v); static inline v f##_v(v x, v z) { return _ZGVdN4vv_##f(x, z); }
#else
#define VECTOR(f) BY_LANES(f)
#define VECTOR_PAIR(f) PAIR_BY_LANES(f)
#endif
VECTOR(sin)
VECTOR(cos)
VECTOR(exp)
VECTOR(log)
#if VECTOR_LIBRARY >= 235
VECTOR(asin)
VECTOR(acos)
VECTOR_PAIR(atan2)
#else
BY_LANES(asin)
BY_LANES(acos)
PAIR_BY_LANES(atan2)
#endif
BY_LANES(tan)
BY_LANES(atan)
BY_LANES(sinh)
BY_LANES(cosh)
BY_LANES(tanh)
BY_LANES(sqrt)
BY_LANES(floor)
BY_LANES(ceil)
BY_LANES(sign)
VECTOR_PAIR(pow)
PAIR_BY_LANES(fmod)
PAIR_BY_LANES(copysign)

static inline v fabs_v(v x) { return (v)((bits)x & 0x7fffffffffffffffLL); }
static inline v choose_v(bits mask, v x, v z) { return (v)((mask & (bits)x) | (~mask & (bits)z)); }
/* a NaN on either side stays one */
static inline v fmin_v(v x, v z) { return choose_v((x < z) | (x != x), x, z); }
static inline v fmax_v(v x, v z) { return choose_v((x > z) | (x != x), x, z); }
static inline v lt_v(v x, v z) { return ONES(x < z); }
static inline v le_v(v x, v z) { return ONES(x <= z); }
static inline v eq_v(v x, v z) { return ONES(x == z); }
static inline v ne_v(v x, v z) { return ONES(x != z); }
static inline v and_v(v x, v z) { return ONES((x != 0.0) & (z != 0.0)); }
static inline v or_v(v x, v z) { return ONES((x != 0.0) | (z != 0.0)); }
static inline v not_v(v x) { return ONES(x == 0.0); }
static inline v if_else_zero_v(v x, v z) { return (v)((x != 0.0) & (bits)z); }
/* large results go past the cache, where their place permits it */
static inline void copy(double *restrict to, const double *restrict from, long n) {
#if defined __AVX__
    if (n % W == 0 && (size_t)to % sizeof(v) == 0) {
        for (long i = 0; i < n; i += W) _mm256_stream_pd(to + i, LOAD(from + i));
        return;
    }
#endif
    memcpy(to, from, (size_t)n * sizeof(double));
}
static inline int any(bits mask) {
    long long all = 0;
    for (int k = 0; k < W; ++k) all |= mask[k];
    return all != 0;
}

#define OVER_LANES(name, take) \
    static inline double name(v x) { \
        double s = x[0]; \
        for (int k = 1; k < W; ++k) s = take; \
        return s; \
    }
OVER_LANES(lane_sum, s + x[k])
OVER_LANES(lane_least, x[k] < s ? x[k] : s)
OVER_LANES(lane_largest, x[k] > s ? x[k] : s)
