/* KSL: emits every inline function of the C headers as a symbol of the library. */
#include "ksl/config.h"

#undef KSL_INLINE
#define KSL_INLINE extern inline KSL_EXPORT

#include "ksl/ksl.h"
#include "ksl/memory.h"
#include "ksl/trig.h"
