// A driver of cards for machines without one: the card's memory is the processor's, and kernels are libraries of the processor.
//
// Tests set what it says, and read what it was asked.  A module's image is the word FAKE and the path of a library, which has `fake_run` (fake_card.py).
#include <cstdint>
#include <cstring>
#include <dlfcn.h>
#include <map>
#include <mutex>
#include <string>

#define EXPORT extern "C" __attribute__((visibility("default")))

extern "C" {
__attribute__((visibility("default"))) int fake_version = 12040, fake_cards = 2, fake_code = 0, fake_launches = 0,
                                           fake_modules = 0, fake_contexts = 0, fake_best = 1024, fake_of_streams = 0;
__attribute__((visibility("default"))) char fake_failing[64] = ""; // this function returns fake_code
__attribute__((visibility("default"))) std::uint64_t fake_stream = 0, fake_blocks = 0, fake_threads = 0, fake_card = 0;
}

namespace {
struct owned {
  std::uint64_t size;
  int card;
};
std::map<std::uint64_t, owned> memory;
struct kernel { void *function, *run; };
int contexts[8]; // their addresses are what users hold
thread_local void *current = nullptr, *before = nullptr;

int result(const char *name) { return std::strcmp(name, fake_failing) == 0 ? fake_code : 0; }
#define OR_FAIL                                                                                                        \
  if (int code = result(__func__))                                                                                     \
  return code
} // namespace

EXPORT void fake_own(std::uint64_t pointer, std::uint64_t size, int card) { memory[pointer] = {size, card}; }
EXPORT void fake_free(std::uint64_t pointer) { memory.erase(pointer); }

EXPORT int cuInit(unsigned) {
  OR_FAIL;
  return 0;
}
EXPORT int cuDriverGetVersion(int *version) { return *version = fake_version, result(__func__); }
EXPORT int cuGetErrorName(int code, const char **name) {
  *name = code == 2 ? "CUDA_ERROR_OUT_OF_MEMORY" : "CUDA_ERROR_OF_THE_FAKE";
  return code == 999 ? 1 : 0;
}
EXPORT int cuGetErrorString(int code, const char **text) { return *text = "what the fake says", code == 999 ? 1 : 0; }
EXPORT int cuDeviceGetCount(int *count) { return *count = fake_cards, result(__func__); }
EXPORT int cuDeviceGet(int *device, int card) { return *device = card, result(__func__); }
EXPORT int cuDeviceGetName(char *name, int length, int) {
  return std::strncpy(name, "Fake card", length), result(__func__);
}
EXPORT int cuDeviceGetAttribute(int *value, int which, int card) {
  return *value = which == 75 ? 9 : which == 76 ? card : which == 16 ? 5 : 0, result(__func__);
}
EXPORT int cuDevicePrimaryCtxRetain(void **context, int card) {
  return *context = &contexts[card], ++fake_contexts, result(__func__);
}
EXPORT int cuCtxGetCurrent(void **context) { return *context = current, result(__func__); }
EXPORT int cuCtxPushCurrent_v2(void *context) { return before = current, current = context, result(__func__); }
EXPORT int cuCtxPopCurrent_v2(void **context) { return *context = current, current = before, result(__func__); }

EXPORT int cuModuleLoadData(void **module, const char *image) {
  OR_FAIL;
  if (std::strncmp(image, "FAKE", 4) != 0)
    return 200;
  ++fake_modules;
  return (*module = dlopen(image + 4, RTLD_NOW | RTLD_LOCAL)) != nullptr ? 0 : 200;
}
EXPORT int cuModuleGetFunction(void **function, void *module, const char *name) {
  OR_FAIL;
  void *called = dlsym(module, (std::string(name) + "_called").c_str()), *run = dlsym(module, "fake_run");
  if (called == nullptr || run == nullptr)
    return 500;
  *function = new kernel{called, run};
  return 0;
}
EXPORT int cuFuncGetAttribute(int *value, int which, void *) { return *value = which == 4 ? 64 : 16, result(__func__); }
EXPORT int cuStreamGetCtx(void *, void **context) { return *context = &contexts[fake_of_streams], result(__func__); }
EXPORT int cuOccupancyMaxPotentialBlockSize(int *grid, int *threads, void *, void *, std::size_t, int most) {
  *grid = 10, *threads = most < fake_best ? most : fake_best;
  return result(__func__);
}
EXPORT int cuPointerGetAttribute(void *value, int which, std::uint64_t pointer) {
  auto found = memory.upper_bound(pointer);
  if (found == memory.begin() || pointer >= (--found)->first + found->second.size)
    return 1;
  *static_cast<int *>(value) = which == 9 ? found->second.card : 2;
  return result(__func__);
}

EXPORT int cuLaunchKernel(void *function, unsigned x, unsigned, unsigned, unsigned threads, unsigned, unsigned,
                          unsigned, void *stream, void **given, void **) {
  OR_FAIL;
  if (current == nullptr)
    return 201;
  static std::mutex one; // threads of a program launch, and kernels on the processor share their fibers
  const std::scoped_lock lock(one);
  ++fake_launches, fake_blocks = x, fake_threads = threads, fake_card = static_cast<int *>(current) - contexts;
  fake_stream = reinterpret_cast<std::uint64_t>(stream);
  const auto *of = static_cast<kernel *>(function);
  reinterpret_cast<void (*)(void *, void **, unsigned, unsigned)>(of->run)(of->function, given, x, threads);
  return 0;
}
