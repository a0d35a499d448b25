// Memory of results.  Arrays that are returned are NumPy's own; the memory of large ones comes from here.
//
// The system gives a program fresh memory page by page, each cleared when it is first touched.  For a batch of derivatives this takes longer than the
// derivatives.  So blocks whose arrays are gone are kept for later results, `most_kept` bytes at most, and from 2 MiB on they ask for large pages.
#pragma once

#include "array.hpp"

#include <cstdint>
#include <cstring>
#include <mutex>
#include <new>
#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace calls {
namespace result_memory {

inline constexpr std::size_t least_bytes = std::size_t(120)
                                           << 10; ///< of arrays from here; malloc gives 128 KiB fresh each time
inline constexpr std::size_t large_page = std::size_t(2) << 20;
inline constexpr std::size_t most_kept = std::size_t(128) << 20;
inline constexpr int most_blocks = 32;

/// What stands before the numbers of a block, in a cache line of its own.
struct alignas(64) header {
  std::size_t bytes;     ///< of the block, without the header
  std::align_val_t unit; ///< that it was made with
};

inline void give_back(header *block) noexcept { ::operator delete(block, block->unit); }

/// Blocks whose arrays are gone.
class kept_blocks {
public:
  /// One with at least so many bytes, and not many times as many; or null.
  header *take(std::size_t bytes) {
    const std::unique_lock<std::mutex> lock(
        mutex_, std::try_to_lock); // in a child of fork() it may be held by nobody who is left
    if (!lock)
      return nullptr;
    int best = -1;
    for (int i = 0; i < n_; ++i)
      if (block_[i]->bytes >= bytes && block_[i]->bytes / 2 <= bytes &&
          (best < 0 || block_[i]->bytes < block_[best]->bytes))
        best = i;
    return best < 0 ? nullptr : remove(best);
  }
  /// Keeps a block, and gives up older ones for it.  False if it is too large to be kept.
  bool keep(header *block) {
    if (block->bytes > most_kept)
      return false;
    const std::unique_lock<std::mutex> lock(mutex_, std::try_to_lock);
    if (!lock)
      return false;
    while (n_ == most_blocks || kept_ + block->bytes > most_kept)
      give_back(remove(0));
    kept_ += block->bytes;
    block_[n_++] = block;
    return true;
  }

  /// Gives all up.  Were there any?
  bool give_up() {
    const std::unique_lock<std::mutex> lock(mutex_, std::try_to_lock);
    const bool any = lock && n_ > 0;
    while (lock && n_ > 0)
      give_back(remove(n_ - 1));
    return any;
  }

private:
  header *remove(int i) {
    header *const block = block_[i];
    kept_ -= block->bytes;
    for (--n_; i < n_; ++i)
      block_[i] = block_[i + 1];
    return block;
  }

  std::mutex mutex_;
  header *block_[most_blocks] = {};
  int n_ = 0;
  std::size_t kept_ = 0;
};

/// Never destroyed: arrays may outlive all else.
inline kept_blocks &kept() {
  static kept_blocks *const blocks = new kept_blocks;
  return *blocks;
}

inline void *allocate(void *, std::size_t bytes) noexcept {
  header *block = kept().take(bytes);
  if (!block) {
    const std::size_t unit = bytes >= large_page ? large_page : 4096;
    const std::size_t whole = (bytes + sizeof(header) + unit - 1) / unit * unit;
    if (whole < bytes)
      return nullptr;
    do
      block = static_cast<header *>(::operator new(whole, std::align_val_t(unit), std::nothrow));
    while (!block && kept().give_up());
    if (!block)
      return nullptr;
#if defined(__linux__)
    if (unit == large_page)
      madvise(block, whole, MADV_HUGEPAGE);
#endif
    block->bytes = whole - sizeof(header);
    block->unit = std::align_val_t(unit);
  }
  return block + 1;
}

inline void release(void *, void *numbers, std::size_t) noexcept {
  header *const block = numbers ? static_cast<header *>(numbers) - 1 : nullptr;
  if (block && !kept().keep(block))
    give_back(block);
}

inline void *allocate_zeros(void *context, std::size_t n, std::size_t each) noexcept {
  void *const numbers = each && n > SIZE_MAX / each ? nullptr : allocate(context, n * each);
  return numbers ? std::memset(numbers, 0, n * each) : nullptr;
}

inline void *resize(void *context, void *numbers, std::size_t bytes) noexcept {
  void *const other = allocate(context, bytes);
  if (other && numbers) {
    const std::size_t before = (static_cast<header *>(numbers) - 1)->bytes;
    std::memcpy(other, numbers, before < bytes ? before : bytes);
    release(context, numbers, before);
  }
  return other;
}

inline PyDataMem_Handler handler = {"ksl results", 1, {nullptr, allocate, allocate_zeros, resize, release}};

/// NumPy asks the handler for the memory of arrays that are made while this lives, and the array remembers it.
class our_memory {
public:
  our_memory() : before_(nb::steal(PyDataMem_SetHandler(capsule().ptr()))) {
    if (!before_.is_valid())
      nb::raise_python_error();
  }
  ~our_memory() { nb::steal(PyDataMem_SetHandler(before_.ptr())); }
  our_memory(const our_memory &) = delete;
  our_memory &operator=(const our_memory &) = delete;

private:
  static nb::handle capsule() {
    static PyObject *const made = PyCapsule_New(&handler, "mem_handler", nullptr);
    if (!made)
      nb::raise_python_error();
    return made;
  }
  nb::object before_;
};

} // namespace result_memory

/// A new array, not initialised.  Raises MemoryError.
inline nb::object new_array(int axes, const npy_intp *shape, int type) {
  std::size_t bytes = type == NPY_DOUBLE ? 8 : 4;
  for (int i = 0; i < axes; ++i)
    bytes *= static_cast<std::size_t>(shape[i]);
  std::optional<result_memory::our_memory> ours;
  if (bytes >= result_memory::least_bytes)
    ours.emplace();
  nb::object array = nb::steal(PyArray_SimpleNew(axes, const_cast<npy_intp *>(shape), type));
  if (!array.is_valid())
    nb::raise_python_error();
  return array;
}

} // namespace calls
