// What the C interface says about a thread's last calls.
#include "c_api/handles.hpp"
#include "engine/states/thread_memory.hpp"

#include <cstring>

namespace ksl::c_api {
namespace {

// In memory of the thread; a literal where there was none.
KSL_THREAD_LOCAL const char *message = nullptr;
KSL_THREAD_LOCAL char warning[256] = "";

} // namespace

const char *last_message() noexcept { return message ? message : ""; }

void keep_message(const char *sentence) noexcept {
  const std::size_t bytes = std::strlen(sentence) + 1;
  if (std::byte *const memory = thread_memory_if_any(kept_for::message, bytes))
    message = static_cast<const char *>(std::memcpy(memory, sentence, bytes));
  else
    message = "out of memory, also for the message; the status tells what kind of error it is";
}

void say_out_of_memory() noexcept { message = "out of memory"; }

char (&last_warning() noexcept)[256] { return warning; }

} // namespace ksl::c_api
