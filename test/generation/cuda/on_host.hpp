// The words of CUDA for a compiler of C++: kernels run on the processor, thread by thread.
//
// A thread of a warp runs until __syncwarp(), and then the next one does, since what a warp hands on in shared memory is there only behind it.  Every other
// round begins at the warp's last thread: what wants one order of threads without saying so is found.
#pragma once
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <ucontext.h>
#include <vector>

#define __device__
#define __global__
#define __shared__ static
#define __forceinline__ inline
#define __noinline__ __attribute__((noinline))
#define __launch_bounds__(threads)

static struct { unsigned x; } threadIdx, blockIdx, blockDim;

namespace on_host {
struct fiber {
  ucontext_t context;
  std::vector<char> stack = std::vector<char>(512 << 10);
  bool ended;
};

inline std::vector<fiber> fibers(32);
inline ucontext_t scheduler;
inline std::function<void()> kernel;
inline int lane;

inline void run_one() {
  kernel();
  fibers[lane].ended = true;
}

inline void run_warp(unsigned first) {
  for (fiber &f : fibers) {
    getcontext(&f.context);
    f.context.uc_stack.ss_sp = f.stack.data();
    f.context.uc_stack.ss_size = f.stack.size();
    f.context.uc_link = &scheduler;
    f.ended = false;
    makecontext(&f.context, run_one, 0);
  }
  for (int round = 0, running = 32; running; ++round) {
    for (int k = 0; k < 32; ++k) {
      lane = round % 2 ? 31 - k : k;
      threadIdx.x = first + lane;
      swapcontext(&scheduler, &fibers[lane].context);
      running -= fibers[lane].ended;
    }
    if (running % 32) {
      std::fprintf(stderr, "threads of a warp wait at different places\n");
      std::abort();
    }
  }
}

inline void grid(unsigned blocks, unsigned threads, const std::function<void()> &of_thread) {
  kernel = of_thread, blockDim.x = threads;
  for (blockIdx.x = 0; blockIdx.x < blocks; ++blockIdx.x)
    for (unsigned first = 0; first < threads; first += 32)
      run_warp(first);
}
} // namespace on_host

static inline void __syncwarp() { swapcontext(&on_host::fibers[on_host::lane].context, &on_host::scheduler); }
