// Memory that belongs to the calling thread and is kept from call to call, so that calls allocate at their first use at most.
//
// A thread_local object with a destructor can't be used: the C library allocates to register the destructor, and ends the program if
// it can't.  So thread-local variables are plain here, and the system frees the memory as the value of a key of the thread.
#pragma once

#include <cstddef>

/// A thread-local variable whose place is reserved when the thread begins.  Without this, if the library was loaded while the program
/// ran, glibc allocates the variable at its first use, and ends the program if it can't.  For few bytes only, since glibc reserves
/// little room.
#if defined(__GLIBC__)
#define KSL_THREAD_LOCAL thread_local __attribute__((tls_model("initial-exec")))
#else
#define KSL_THREAD_LOCAL thread_local
#endif

namespace ksl {

/// What a block is for.  Calls of different layers that are under way at the same time use different blocks.
enum class kept_for { workspace, arguments, message };
constexpr int kept_blocks = 3;

/// The thread's block for this use, with at least so many bytes, aligned to 64.  If it has to grow, its contents are lost.  Throws
/// std::bad_alloc.
std::byte *thread_memory(kept_for use, std::size_t bytes);

/// The block; null where there is no memory.
std::byte *thread_memory_if_any(kept_for use, std::size_t bytes) noexcept;

} // namespace ksl
