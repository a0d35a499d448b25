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
