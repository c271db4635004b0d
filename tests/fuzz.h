/* What the two drivers with random calls share. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static unsigned long long seed = 88172645463325252ull;
static unsigned random_below(unsigned n) {
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return (unsigned)(seed >> 33) % n;
}

static double random_value(void) {
    static const double odd[] = {0.0, -1.0, 1e308, -1e308, 1e-308, NAN, INFINITY, -INFINITY, 0.9};
    return random_below(4) ? (double)random_below(2000) / 100.0 - 5.0 : odd[random_below(9)];
}

static long messages, count[4]; /* of status OK, discard, error, other */

static int counted(long calls) {
    printf("%ld calls: %ld ok, %ld discarded, %ld errors, %ld other; %ld messages\n", calls, count[0], count[1], count[2],
           count[3], messages);
    return count[3] || !count[0] || !count[2] || messages < count[2];
}
