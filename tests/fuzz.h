/* What the two drivers with random calls share. */
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

static unsigned long long seed = 88172645463325252ull;
static unsigned random_below(unsigned n) {
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return (unsigned)(seed >> 33) % n;
}

static double random_value(void) {
    static const double odd[] = {0.0, -1.0, 1e308, -1e308, 1e-308, NAN, INFINITY, -INFINITY, 0.9};
    return random_below(4) ? (double)random_below(2000) / 100.0 - 5.0 : odd[random_below(9)];
}

static int random_integer(void) {
    static const int odd[] = {0, 1, -1, INT_MAX, INT_MIN};
    return random_below(2) ? (int)random_below(40) - 10 : odd[random_below(5)];
}

/* A value reference of this type, most often; `otherwise` where there is none. */
static unsigned random_of(Type type, unsigned otherwise) {
    const unsigned first = (unsigned)(model.n_p + model.n_u), all = first + (unsigned)model.n_y, from = random_below(all);
    for (unsigned k = 0; random_below(10) && k < all; ++k) {
        const unsigned i = (from + k) % all;
        if (i < first && model.declared[i].type == type) return i;
        if (i >= first && type == INTEGER && model.group_of[i - first] == model.discrete) return i + (unsigned)model.n_x;
    }
    return otherwise;
}

static long messages, count[4]; /* of status OK, discard, error, other */

/* One call: an error of a live instance that has a logger is told in that call. */
static long silent;
static void judge(const char *call, int failed, int heard, long before) {
    if (failed && heard && messages == before && ++silent <= 10) printf("an error without a message: %s\n", call);
}
#define TRY(call)                                             \
    do {                                                      \
        const long before = messages;                         \
        s = (call);                                           \
        judge(#call, s == FAILED, c && hears[i], before);     \
    } while (0)

/* A pointer, now and then none. */
#define MAYBE(pointer) (random_below(40) ? (pointer) : NULL)

/* Linked with --wrap: now and then there is no memory, where it is said to be scarce. */
static int scarce;
void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__wrap_malloc(size_t size) { return scarce && !random_below(3) ? NULL : __real_malloc(size); }
void *__wrap_calloc(size_t n, size_t size) { return scarce && !random_below(3) ? NULL : __real_calloc(n, size); }

/* Flip a bit of a saved state; where it is not sealed anew with the checksum of runtime.c, it must be refused. */
static int flipped(unsigned char *bytes, size_t size) {
    bytes[random_below((unsigned)size)] ^= (unsigned char)(1 << random_below(8));
    if (random_below(2)) return 1;
    /* the CRC-32 of all behind the first 8 bytes, bit by bit */
    unsigned crc = ~0u;
    for (size_t at = 8; at < size; ++at) {
        crc ^= bytes[at];
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1u ? 0xedb88320u : 0u);
    }
    const unsigned long long sum = crc ^ ~0u;
    memcpy(bytes, &sum, sizeof sum);
    return 0;
}

static int counted(long calls) {
    printf("%ld calls: %ld ok, %ld discarded, %ld errors, %ld other; %ld messages\n", calls, count[0], count[1], count[2],
           count[3], messages);
    return count[3] || !count[0] || !count[2] || silent;
}
