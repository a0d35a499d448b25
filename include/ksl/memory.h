/* KSL: arrays on the heap: ksl_array2D<t>_alloc, ksl_array2D<t>_free and ksl_array<t>_free, with <t> nothing for double,
   f float, i int, ui unsigned int, c char, b bool. */
#ifndef KSL_MEMORY_H
#define KSL_MEMORY_H

#include "ksl/config.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

KSL_BEGIN_C
#pragma push_macro("element")
#undef element

#define element double
#define KSL_ARRAY2D(verb) ksl_array2D_##verb
#define KSL_ARRAY(verb) ksl_array_##verb
#include "ksl/detail/array2D.inc"
#undef element
#undef KSL_ARRAY2D
#undef KSL_ARRAY

#define element float
#define KSL_ARRAY2D(verb) ksl_array2Df_##verb
#define KSL_ARRAY(verb) ksl_arrayf_##verb
#include "ksl/detail/array2D.inc"
#undef element
#undef KSL_ARRAY2D
#undef KSL_ARRAY

#define element int
#define KSL_ARRAY2D(verb) ksl_array2Di_##verb
#define KSL_ARRAY(verb) ksl_arrayi_##verb
#include "ksl/detail/array2D.inc"
#undef element
#undef KSL_ARRAY2D
#undef KSL_ARRAY

#define element unsigned int
#define KSL_ARRAY2D(verb) ksl_array2Dui_##verb
#define KSL_ARRAY(verb) ksl_arrayui_##verb
#include "ksl/detail/array2D.inc"
#undef element
#undef KSL_ARRAY2D
#undef KSL_ARRAY

#define element char
#define KSL_ARRAY2D(verb) ksl_array2Dc_##verb
#define KSL_ARRAY(verb) ksl_arrayc_##verb
#include "ksl/detail/array2D.inc"
#undef element
#undef KSL_ARRAY2D
#undef KSL_ARRAY

#define element bool
#define KSL_ARRAY2D(verb) ksl_array2Db_##verb
#define KSL_ARRAY(verb) ksl_arrayb_##verb
#include "ksl/detail/array2D.inc"
#undef element
#undef KSL_ARRAY2D
#undef KSL_ARRAY

#pragma pop_macro("element")
KSL_END_C

#endif
