/* Vectors of W doubles, in the vector extensions of GCC and Clang, and the operations of the generated code on them.
 * Functions without a vector form are computed lane by lane. */
#include <math.h>
#include <string.h>

#if defined __AVX__
#include <immintrin.h>
#endif
#if defined __AVX512F__ && defined __AVX512DQ__ && defined __AVX512VL__
#define APPROXIMATIONS
#endif
#ifndef W
#if defined APPROXIMATIONS
#define W 8
#elif defined __AVX__
#define W 4
#else
#define W 2
#endif
#endif

typedef double v __attribute__((vector_size(8 * W)));
typedef double v_free __attribute__((vector_size(8 * W), aligned(8), may_alias));
typedef long long bits __attribute__((vector_size(8 * W)));

#define PER_ROW static
#define PER_VECTOR static inline

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
#if defined VECTOR_LIBRARY && defined __AVX512F__ && W == 8
#define VECTOR(f) extern v _ZGVeN8v_##f(v); static inline v f##_v(v x) { return _ZGVeN8v_##f(x); }
#define VECTOR_PAIR(f) extern v _ZGVeN8vv_##f(v, v); static inline v f##_v(v x, v z) { return _ZGVeN8vv_##f(x, z); }
#elif defined VECTOR_LIBRARY && defined __AVX2__ && W == 4
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
BY_LANES(floor)
BY_LANES(ceil)
BY_LANES(sign)
VECTOR_PAIR(pow)
PAIR_BY_LANES(fmod)
PAIR_BY_LANES(copysign)

/* A division takes as long as some ten products, and a root longer. From an approximation to 14 bits, two steps of
 * Newton's method lead to one unit in the last place. Each step goes by the remainder, which one rounding makes exact;
 * where there is none, as of a division by 0, the approximation is the result. */
#if defined APPROXIMATIONS && W == 8
#define NEAR_INVERSE(x) ((v)_mm512_rcp14_pd((__m512d)(x)))
#define NEAR_INVERSE_ROOT(x) ((v)_mm512_min_pd(_mm512_set1_pd(1e160), _mm512_rsqrt14_pd((__m512d)(x))))
#define IS_NUMBER(x) _mm512_cmp_pd_mask((__m512d)(x), (__m512d)(x), _CMP_ORD_Q)
#define PLUS_WHERE(mask, x, y, z) ((v)_mm512_mask3_fmadd_pd((__m512d)(y), (__m512d)(z), (__m512d)(x), mask))
#elif defined APPROXIMATIONS && W == 4
#define NEAR_INVERSE(x) ((v)_mm256_rcp14_pd((__m256d)(x)))
#define NEAR_INVERSE_ROOT(x) ((v)_mm256_min_pd(_mm256_set1_pd(1e160), _mm256_rsqrt14_pd((__m256d)(x))))
#define IS_NUMBER(x) _mm256_cmp_pd_mask((__m256d)(x), (__m256d)(x), _CMP_ORD_Q)
#define PLUS_WHERE(mask, x, y, z) ((v)_mm256_mask3_fmadd_pd((__m256d)(y), (__m256d)(z), (__m256d)(x), mask))
#endif
#if defined NEAR_INVERSE
static inline v div_v(v x, v z) {
    const v near = NEAR_INVERSE(z), rest = 1.0 - z * near;
    const __mmask8 sound = IS_NUMBER(rest);
    const v inverse = PLUS_WHERE(sound, near, near, rest), y = x * inverse;
    return PLUS_WHERE(sound, y, inverse, x - z * y);
}
static inline v inv_v(v z) {
    const v near = NEAR_INVERSE(z), rest = 1.0 - z * near;
    const __mmask8 sound = IS_NUMBER(rest);
    const v inverse = PLUS_WHERE(sound, near, near, rest);
    return PLUS_WHERE(sound, inverse, inverse, 1.0 - z * inverse);
}
/* the limit of the approximation makes the root of 0 a 0 */
static inline v sqrt_v(v x) {
    const v near = NEAR_INVERSE_ROOT(x), first = x * near, half = 0.5 * near, rest = 0.5 - first * half;
    const v root = first + first * rest, half_inverse = half + half * rest;
    return root + half_inverse * (x - root * root);
}
#else
static inline v div_v(v x, v z) { return x / z; }
static inline v inv_v(v z) { return 1.0 / z; }
BY_LANES(sqrt)
#endif

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
    if (n % 4 == 0 && (size_t)to % 32 == 0) {
        for (long i = 0; i < n; i += 4) _mm256_stream_pd(to + i, _mm256_loadu_pd(from + i));
        return;
    }
#endif
    memcpy(to, from, (size_t)n * sizeof(double));
}
static inline int any(bits mask) {
#if defined APPROXIMATIONS && W == 8
    return _mm512_test_epi64_mask((__m512i)mask, (__m512i)mask) != 0;
#elif defined __AVX__ && W == 4
    return !_mm256_testz_si256((__m256i)mask, (__m256i)mask);
#else
    long long all = 0;
    for (int k = 0; k < W; ++k) all |= mask[k];
    return all != 0;
#endif
}

#define OVER_LANES(name, take) \
    static inline double name(v x) { \
        double s = x[0]; \
        for (int k = 1; k < W; ++k) s = take; \
        return s; \
    }
/* the bin of a value, the first or the last one for a value beyond them */
static inline int bin_of(double y, double low, double per, int bins) {
    const double place = floor((y - low) * per);
    return place > 0.0 ? (place < bins - 1 ? (int)place : bins - 1) : 0;
}
OVER_LANES(lane_sum, s + x[k])
OVER_LANES(lane_least, x[k] < s ? x[k] : s)
OVER_LANES(lane_largest, x[k] > s ? x[k] : s)
