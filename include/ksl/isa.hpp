// KSL: the inline namespace in which algebra and engine lie, named after the instruction set that a translation unit is
// compiled for.  Two objects compiled for different sets then share no symbol, and the linker can't merge an AVX-512
// copy of a function into the baseline path.
#pragma once

// The library's own kernel objects name their set (src/engine/).  Elsewhere the name follows from the compiler's options.
#ifndef KSL_ISA
#if defined(__AVX512F__) && defined(__AVX512VL__)
#define KSL_ISA header_x86_64_v4
#elif defined(__AVX2__) && defined(__FMA__)
#define KSL_ISA header_x86_64_v3
#elif defined(__SSE4_2__)
#define KSL_ISA header_x86_64_v2
#elif defined(__x86_64__)
#define KSL_ISA header_x86_64
#elif defined(__aarch64__)
#define KSL_ISA header_neon
#else
#define KSL_ISA header_generic
#endif
#endif
