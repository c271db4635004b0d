/* The language of a GPU for a C++ compiler: the threads of a warp take turns, and wait for one another where they
 * exchange values. Blocks come one after the other. The approximations have as few digits as those of a device. */
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <ucontext.h>
#include <vector>

#define __global__
#define __device__
#define __forceinline__ inline
#define __shared__ static
#define __launch_bounds__(...)
using std::fma;

struct Place { unsigned x; };
static Place blockIdx, blockDim, threadIdx;

static const int LANES = 32, STACK = 1 << 19;
static ucontext_t scheduler, threads[LANES];
static std::vector<char> stacks(LANES *STACK);
static std::function<void()> work;
static int running;
static bool ended[LANES];
static double exchanged[LANES];

static inline void __syncwarp() { swapcontext(&threads[running], &scheduler); }
static inline double __shfl_down_sync(unsigned, double x, int by) {
    const int lane = running;
    exchanged[lane] = x;
    __syncwarp();
    const double y = lane + by < LANES ? exchanged[lane + by] : x;
    __syncwarp();
    return y;
}
static inline int atomicAdd(int *to, int x) { const int before = *to; *to += x; return before; }

static void one_thread() {
    work();
    ended[running] = true;
    while (true) __syncwarp();
}
static void launch(unsigned grid, unsigned block, std::function<void()> kernel) {
    work = std::move(kernel);
    blockDim.x = block;
    for (blockIdx.x = 0; blockIdx.x < grid; ++blockIdx.x)
        for (unsigned first = 0; first < block; first += LANES) {
            for (int k = 0; k < LANES; ++k) {
                ended[k] = false;
                getcontext(&threads[k]);
                threads[k].uc_stack.ss_sp = stacks.data() + k * STACK;
                threads[k].uc_stack.ss_size = STACK;
                threads[k].uc_link = nullptr;
                makecontext(&threads[k], one_thread, 0);
            }
            for (bool open = true; open;) {
                open = false;
                for (running = 0; running < LANES; ++running) {
                    if (ended[running]) continue;
                    threadIdx.x = first + running;
                    swapcontext(&scheduler, &threads[running]);
                    open = open || !ended[running];
                }
            }
        }
}

/* the upper 32 bits of a number */
static inline double upper(double x) {
    uint64_t bits;
    std::memcpy(&bits, &x, 8);
    bits &= ~0xffffffffull;
    std::memcpy(&x, &bits, 8);
    return x;
}
static inline double flushed(double x) { return std::fabs(x) < 2.2250738585072014e-308 ? std::copysign(0.0, x) : x; }
#define NEAR_INVERSE(x) flushed(upper(1.0 / flushed(upper(x))))
#define NEAR_INVERSE_ROOT(x) upper(1.0 / std::sqrt(flushed(upper(x))))
