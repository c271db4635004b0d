/* The operations of the generated code on a GPU, by the names of lanes.h. A vector is the number of one thread, and the
 * threads of a warp are the lanes. */
#define WARP 32
#define restrict __restrict__
#define PER_ROW static __device__
#define PER_VECTOR static __device__ __forceinline__
#ifndef NAN
#define NAN __longlong_as_double(0x7ff8000000000000LL)
#define INFINITY __longlong_as_double(0x7ff0000000000000LL)
#endif

typedef double v;

#define V(x) ((double)(x))
#define ONES(truth) ((truth) ? 1.0 : 0.0)

PER_VECTOR double sign(double x) { return x < 0.0 ? -1.0 : x > 0.0 ? 1.0 : x; }

#define sin_v sin
#define cos_v cos
#define exp_v exp
#define log_v log
#define asin_v asin
#define acos_v acos
#define tan_v tan
#define atan_v atan
#define sinh_v sinh
#define cosh_v cosh
#define tanh_v tanh
#define floor_v floor
#define ceil_v ceil
#define sign_v sign
#define fabs_v fabs
#define atan2_v atan2
#define pow_v pow
#define fmod_v fmod
#define copysign_v copysign

/* Quotients and roots from approximations to 20 bits, as in lanes.h: a third of the instructions, and no branch. An
 * inverse or a root whose approximation is not finite is that of 0 or of a number below all normal ones. */
#ifndef NEAR_INVERSE
PER_VECTOR double near_inverse(double x) {
    double y;
    asm("rcp.approx.ftz.f64 %0, %1;" : "=d"(y) : "d"(x));
    return y;
}
PER_VECTOR double near_inverse_root(double x) {
    double y;
    asm("rsqrt.approx.ftz.f64 %0, %1;" : "=d"(y) : "d"(x));
    return y;
}
#define NEAR_INVERSE near_inverse
#define NEAR_INVERSE_ROOT near_inverse_root
#endif
PER_VECTOR v div_v(v x, v z) {
    const v near = NEAR_INVERSE(z), rest = fma(-z, near, 1.0);
    const int sound = rest == rest;
    const v inverse = sound ? fma(near, rest, near) : near, y = x * inverse;
    return sound ? fma(inverse, fma(-z, y, x), y) : y;
}
PER_VECTOR v inv_v(v z) {
    const v near = NEAR_INVERSE(z), rest = fma(-z, near, 1.0);
    const int sound = rest == rest;
    const v inverse = sound ? fma(near, rest, near) : near;
    return sound ? fma(inverse, fma(-z, inverse, 1.0), inverse) : inverse;
}
PER_VECTOR v sqrt_v(v x) {
    const v raw = NEAR_INVERSE_ROOT(x), near = raw > 1e160 ? 0.0 : raw;
    const v first = x * near, half = 0.5 * near, rest = fma(-first, half, 0.5);
    const v root = fma(first, rest, first), half_inverse = fma(half, rest, half);
    return fma(half_inverse, fma(-root, root, x), root);
}

/* a NaN on either side stays one */
PER_VECTOR v fmin_v(v x, v z) { return x < z || x != x ? x : z; }
PER_VECTOR v fmax_v(v x, v z) { return x > z || x != x ? x : z; }
PER_VECTOR v lt_v(v x, v z) { return ONES(x < z); }
PER_VECTOR v le_v(v x, v z) { return ONES(x <= z); }
PER_VECTOR v eq_v(v x, v z) { return ONES(x == z); }
PER_VECTOR v ne_v(v x, v z) { return ONES(x != z); }
PER_VECTOR v and_v(v x, v z) { return ONES(x != 0.0 && z != 0.0); }
PER_VECTOR v or_v(v x, v z) { return ONES(x != 0.0 || z != 0.0); }
PER_VECTOR v not_v(v x) { return ONES(x == 0.0); }
PER_VECTOR v if_else_zero_v(v x, v z) { return x != 0.0 ? z : 0.0; }

PER_VECTOR int bin_of(double y, double low, double per, int bins) {
    const double place = floor((y - low) * per);
    return place > 0.0 ? (place < bins - 1 ? (int)place : bins - 1) : 0;
}

/* the first lane has the result */
#define OVER_LANES(name, take) \
    static __device__ double name(double s) { \
        for (int d = WARP / 2; d; d /= 2) { \
            const double x = __shfl_down_sync(~0u, s, d); \
            s = take; \
        } \
        return s; \
    }
OVER_LANES(lane_sum, s + x)
OVER_LANES(lane_least, x < s ? x : s)
OVER_LANES(lane_largest, x > s ? x : s)
