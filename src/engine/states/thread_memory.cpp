// A block for each use, since one call uses several at once: arguments while workspaces are at work.  Blocks grow to the largest call that a thread
// has made, so that a call like an earlier one allocates nothing, and are freed when the thread ends.
#include "engine/states/thread_memory.hpp"

#include <atomic>
#include <cerrno>
#include <new>
#include <pthread.h>

namespace ksl {
namespace {

constexpr std::align_val_t alignment{64};

struct blocks {
  std::byte *memory[kept_blocks];
  std::size_t size[kept_blocks];
  bool freed_at_end; ///< of the thread
};
KSL_THREAD_LOCAL blocks of_this_thread; // zeros

/// Called by the system when a thread ends.  Another key's destructor may call the library once more; then this is called again.
void free_blocks(void *of) {
  blocks &b = *static_cast<blocks *>(of);
  for (std::byte *&memory : b.memory) {
    ::operator delete(memory, alignment);
    memory = nullptr;
  }
  b = {};
}

/// The key that all threads share.  A program has about a thousand; where none is left, and where the library has
/// deleted it, a thread's blocks are lost when it ends.
pthread_key_t key;
std::atomic<bool> has_key{false};
const struct lifetime {
  lifetime() { has_key = pthread_key_create(&key, free_blocks) == 0; }
  /// The code that frees the blocks goes with the library.  Another thread may be in a call while the program ends, so that no
  /// block is freed here.
  ~lifetime() {
    if (has_key.exchange(false)) // first, since other threads may still ask for memory
      pthread_key_delete(key);
  }
} of_the_library;

/// Has the blocks freed when the thread ends, if there is a key.  False where there is no memory for that.
bool free_at_end(blocks &b) {
  if (b.freed_at_end || !has_key)
    return true;
  const int status = pthread_setspecific(key, &b);
  b.freed_at_end = status == 0;
  return status != ENOMEM; // or the key has been deleted meanwhile
}

} // namespace

std::byte *thread_memory_if_any(kept_for use, std::size_t bytes) noexcept {
  blocks &b = of_this_thread;
  std::byte *&memory = b.memory[static_cast<int>(use)];
  std::size_t &size = b.size[static_cast<int>(use)];
  if (bytes <= size)
    return memory;
  if (!free_at_end(b))
    return nullptr;
  ::operator delete(memory, alignment); // first, so that both are never needed at once
  memory = nullptr, size = 0;
  memory = static_cast<std::byte *>(::operator new(bytes, alignment, std::nothrow));
  size = memory ? bytes : 0;
  return memory;
}

std::byte *thread_memory(kept_for use, std::size_t bytes) {
  std::byte *const memory = thread_memory_if_any(use, bytes);
  if (!memory && bytes)
    throw std::bad_alloc();
  return memory;
}

} // namespace ksl
