/* In place of elementary.h: the functions of the C library, for a comparison of the cost. */
#include <math.h>

#define ROUNDED_APART
#if defined __GNUC__ && !defined __clang__
#pragma GCC optimize("fp-contract=off", "no-tree-slp-vectorize")
#endif

typedef struct { double a, b; } Two;
static inline Two sine_and_cosine(double x) { return (Two){sin(x), cos(x)}; }
#define arcsine asin
#define arccosine acos
#define arctangent2 atan2
#define exponential exp
#define logarithm log
#define least_of fmin
#define largest_of fmax
