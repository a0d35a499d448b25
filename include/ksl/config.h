/* KSL: how functions are declared.  Depends on nothing, allocates nothing. */
#ifndef KSL_CONFIG_H
#define KSL_CONFIG_H

#define KSL_VERSION_MAJOR 0
#define KSL_VERSION_MINOR 1
#define KSL_VERSION_PATCH 0
#define KSL_VERSION "0.1.0"

/** Marks what the shared library exports. */
#if defined(__GNUC__)
#define KSL_EXPORT __attribute__((visibility("default")))
#else
#define KSL_EXPORT
#endif

/** Linkage of the inline C functions.  A user keeps the default, which needs no library; the library itself
    defines KSL_INLINE so that every function is also emitted as a symbol (src/ksl.c). */
#ifndef KSL_INLINE
#define KSL_INLINE static inline
#endif

/** Linkage of the helpers that only other functions of these headers call.  They are no symbols of the library. */
#ifndef KSL_INLINE_HELPER
#define KSL_INLINE_HELPER static inline
#endif

/** KSL_INT_ENUM: an enumeration of the C interface holds any int in C++ too, as it does in C, so that a call can refuse values that it
    doesn't know. */
#ifdef __cplusplus
#define KSL_BEGIN_C extern "C" {
#define KSL_END_C }
#define KSL_INT_ENUM : int
#else
#define KSL_BEGIN_C
#define KSL_END_C
#define KSL_INT_ENUM
#endif

#endif
