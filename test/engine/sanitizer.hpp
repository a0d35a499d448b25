// Whether tests are built with a sanitizer: some take the place of functions that it needs.
#pragma once

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define KSL_TEST_SANITIZER
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define KSL_TEST_SANITIZER
#endif

/// ThreadSanitizer must see each thread begin: no test takes the place of pthread_create then.
#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define KSL_TEST_THREAD_SANITIZER
#endif
#endif
#if defined(__SANITIZE_THREAD__)
#define KSL_TEST_THREAD_SANITIZER
#endif

/// While one exists, what its thread allocates is no leak to AddressSanitizer: memory that is lost on purpose.
#if defined(KSL_TEST_SANITIZER) && !defined(KSL_TEST_THREAD_SANITIZER)
#include <sanitizer/lsan_interface.h>
using memory_that_is_lost = __lsan::ScopedDisabler;
#else
struct memory_that_is_lost {
  memory_that_is_lost() {}
};
#endif
