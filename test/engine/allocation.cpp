// Counts every way to get memory, and makes allocations fail.
#include "allocation.hpp"

#include <cerrno>
#include <cstddef>
#include <new>

std::atomic<long> allocations{0}, allocated_bytes{0}, live_blocks{0};

namespace {

std::atomic<long> left{0}, failed{0}; ///< left: allocations until the one that fails; 0 or less: it has come
std::atomic<bool> failing{false}, all_that_follow{false};

/// Counts an allocation.  Is it one that fails?
[[maybe_unused]] bool refused(std::size_t bytes) {
  ++allocations;
  allocated_bytes += static_cast<long>(bytes);
  if (!failing.load(std::memory_order_relaxed))
    return false;
  const long n = --left;
  if (n > 0 || (n < 0 && !all_that_follow))
    return false;
  ++failed;
  errno = ENOMEM;
  return true;
}

} // namespace

void fail_allocation(long nth, bool all_after) {
  left = nth, all_that_follow = all_after, failed = 0;
  failing = true;
}

long stop_failing_allocations() {
  failing = false;
  return failed;
}

#ifdef COUNTS_MALLOC
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#pragma GCC visibility push(default) // or shared libraries, as that of C++, would not call these
extern "C" {
void *__libc_malloc(std::size_t);
void *__libc_calloc(std::size_t, std::size_t);
void *__libc_realloc(void *, std::size_t);
void *__libc_memalign(std::size_t, std::size_t);
void __libc_free(void *);

static void *counted(void *block) {
  live_blocks += block != nullptr;
  return block;
}

void *malloc(std::size_t n) { return refused(n) ? nullptr : counted(__libc_malloc(n)); }
void *calloc(std::size_t n, std::size_t size) { return refused(n * size) ? nullptr : counted(__libc_calloc(n, size)); }
void *realloc(void *p, std::size_t n) {
  if (refused(n))
    return nullptr;
  void *const block = __libc_realloc(p, n);
  live_blocks += (block != nullptr) - (p && (block || n == 0));
  return block;
}
void *memalign(std::size_t alignment, std::size_t n) {
  return refused(n) ? nullptr : counted(__libc_memalign(alignment, n));
}
void *aligned_alloc(std::size_t alignment, std::size_t n) { return memalign(alignment, n); }
int posix_memalign(void **p, std::size_t alignment, std::size_t n) {
  void *const block = memalign(alignment, n);
  if (block)
    *p = block;
  return block ? 0 : ENOMEM;
}
void *reallocarray(void *p, std::size_t n, std::size_t size) { return realloc(p, n * size); }
void *valloc(std::size_t n) { return memalign(4096, n); }
void *pvalloc(std::size_t n) { return memalign(4096, (n + 4095) / 4096 * 4096); }
void free(void *p) {
  live_blocks -= p != nullptr;
  __libc_free(p);
}
void *mmap(void *at, std::size_t n, int protection, int flags, int file, off_t offset) {
  if (refused(n))
    return MAP_FAILED;
  return reinterpret_cast<void *>(syscall(SYS_mmap, at, n, protection, flags, file, offset));
}
}
#pragma GCC visibility pop
#elif !defined(KSL_TEST_THREAD_SANITIZER) // which has an operator new of its own
// operator new as it is, besides that it counts; the forms that are not here call these.
namespace {

void *allocated(std::size_t n, std::size_t alignment) {
  if (refused(n))
    throw std::bad_alloc();
  void *block = nullptr;
  if (alignment <= alignof(std::max_align_t))
    block = std::malloc(n ? n : 1);
  else if (posix_memalign(&block, alignment, n ? n : 1) != 0)
    block = nullptr;
  if (!block)
    throw std::bad_alloc();
  return block;
}

} // namespace

#pragma GCC visibility push(                                                                                           \
    default) // clang declares no sized forms in <new>, and would hide them from the library of C++
void *operator new(std::size_t n) { return allocated(n, 1); }
void *operator new[](std::size_t n) { return allocated(n, 1); }
void *operator new(std::size_t n, std::align_val_t alignment) {
  return allocated(n, static_cast<std::size_t>(alignment));
}
void *operator new[](std::size_t n, std::align_val_t alignment) {
  return allocated(n, static_cast<std::size_t>(alignment));
}
void *operator new(std::size_t n, const std::nothrow_t &) noexcept {
  try {
    return allocated(n, 1);
  } catch (const std::bad_alloc &) {
    return nullptr;
  }
}
void *operator new(std::size_t n, std::align_val_t alignment, const std::nothrow_t &) noexcept {
  try {
    return allocated(n, static_cast<std::size_t>(alignment));
  } catch (const std::bad_alloc &) {
    return nullptr;
  }
}
void operator delete(void *p) noexcept { std::free(p); }
void operator delete[](void *p) noexcept { std::free(p); }
void operator delete(void *p, std::size_t) noexcept { std::free(p); }
void operator delete[](void *p, std::size_t) noexcept { std::free(p); }
void operator delete(void *p, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void *p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void *p, std::size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void *p, std::size_t, std::align_val_t) noexcept { std::free(p); }
#pragma GCC visibility pop
#endif
