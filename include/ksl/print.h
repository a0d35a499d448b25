/* KSL: printing.  Link with libksl: the default options are one set for the whole program, so printing is the one part of
   the C headers that is no inline code.

     ksl_SE3_print(stdout, &D);
     ksl_SE3_print(stdout, &D, "D_ab = ");
     ksl_SE3_print(stdout, &D, "D_ab = ", options);

   ksl_T_print is for every T below; ksl_T_debug is the same and nothing at all if NDEBUG is defined.  Arrays take their
   length or lengths before the pointer.  A label or options of NULL stand for none and for the default set.  Nothing is
   printed if the file or the data are NULL.

   One line:  label [1, 2, 3]
   Matrices:  label [[1, 2],         one bracketed line for each row, or for each column if print_row_column_major is
                     [3, 4]]         KSL_COLUMN_MAJOR; no line breaks with KSL_NO_BREAK_BETWEEN_LINES

   Numbers appear as real_fmt and int_fmt say.  Such a format must hold exactly one conversion, with flags, a width and a
   precision of at most three digits: of a, e, f, g, A, E, F, G (with or without l) and of d, i; otherwise the default one
   is used.  All other texts are printed as they are.  A text of more than 99 bytes is cut, between characters if it is
   UTF-8.

   The default set is not locked: set it before threads print.

   As in the published library, this header gives all headers of what it prints. */
#ifndef KSL_PRINT_H
#define KSL_PRINT_H

#include "ksl/SE3.h"
#include "ksl/array.h"
#include "ksl/axis.h"
#include "ksl/config.h"
#include "ksl/coscrew.h"
#include "ksl/eulerangles.h"
#include "ksl/inertia.h"
#include "ksl/linalg.h"
#include "ksl/mat3x3.h"
#include "ksl/mat4x4.h"
#include "ksl/matrix.h"
#include "ksl/quaternion.h"
#include "ksl/screw.h"
#include "ksl/types.h"
#include "ksl/vec3.h"
#include "ksl/vec4.h"

#include <stdbool.h>
#include <stdio.h>

KSL_BEGIN_C

typedef enum ksl_print_breakBetweenLines_enum_t {
  KSL_NO_BREAK_BETWEEN_LINES = 0,
  KSL_BREAK_BETWEEN_LINES
} ksl_print_breakBetweenLines_enum_t;

/** How to print.  The texts end with a zero byte. */
typedef struct ksl_print_options_t {
  char delimiter[100];           /**< between numbers, and between the lines of a matrix: ", " */
  char real_fmt[100];            /**< "%0.6g" */
  char int_fmt[100];             /**< "%d" */
  char true_fmt[100];            /**< "true" */
  char false_fmt[100];           /**< "false" */
  char inner_left_bracket[100];  /**< before each line of a matrix: "[" */
  char inner_right_bracket[100]; /**< "]" */
  char outer_left_bracket[100];  /**< before the whole: "[" */
  char outer_right_bracket[100]; /**< "]" */
  ksl_print_breakBetweenLines_enum_t line_breaks_in_matrices; /**< KSL_BREAK_BETWEEN_LINES */
  ksl_matrix_enum_t print_row_column_major;                   /**< KSL_ROW_MAJOR */
} ksl_print_options_t;

/** A new set with the values above, to be freed with free(); NULL if there is no memory. */
KSL_EXPORT ksl_print_options_t *ksl_print_options(void);

/** Gives the default set the values above. */
KSL_EXPORT void ksl_print_setDefaultOptions(void);

/* Setters.  `...` is ksl_print_options_t *options, exactly one; NULL is the default set.  The macros add it. */

KSL_EXPORT void ksl_print_setDelimiterOption(const char *delimiter, ...);
/** A format that is not one (see above) is replaced by the default one. */
KSL_EXPORT void ksl_print_setRealFormatOption(const char *format, ...);
KSL_EXPORT void ksl_print_setInnerBracketsOption(const char *left, const char *right, ...);
KSL_EXPORT void ksl_print_setOuterBracketsOption(const char *left, const char *right, ...);
KSL_EXPORT void ksl_print_setBreakBetweenLinesInMatrixOption(ksl_print_breakBetweenLines_enum_t value, ...);
/** What stands for true and for false: texts, not formats. */
KSL_EXPORT void ksl_print_setBooleanOption(const char *for_true, const char *for_false, ...);
KSL_EXPORT void ksl_print_setRowColumnMajorPrintingOption(ksl_matrix_enum_t value, ...);

#define ksl_print_setDelimiter(...) ksl_print_setDelimiterOption(__VA_ARGS__, (void *)0)
#define ksl_print_setRealFormat(...) ksl_print_setRealFormatOption(__VA_ARGS__, (void *)0)
#define ksl_print_setInnerBrackets(...) ksl_print_setInnerBracketsOption(__VA_ARGS__, (void *)0)
#define ksl_print_setOuterBrackets(...) ksl_print_setOuterBracketsOption(__VA_ARGS__, (void *)0)
#define ksl_print_setBreakBetweenLinesInMatrix(...) ksl_print_setBreakBetweenLinesInMatrixOption(__VA_ARGS__, (void *)0)
#define ksl_print_setBoolean(...) ksl_print_setBooleanOption(__VA_ARGS__, (void *)0)
#define ksl_print_setRowColumnMajorPrinting(...) ksl_print_setRowColumnMajorPrintingOption(__VA_ARGS__, (void *)0)

/* Printing functions.  `...` is const char *label, ksl_print_options_t *options: these two are read, no more and no
   less, and each may be NULL.  The macros add them. */

#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/print.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/print.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** Three angles and the sequence, (0.1, 0.2, 0.3, xyz), in one line. */
KSL_EXPORT void ksl_eulerangles_printWithOptions(FILE *file, const ksl_eulerangles_t *self, ...);
KSL_EXPORT void ksl_euleranglesf_printWithOptions(FILE *file, const ksl_euleranglesf_t *self, ...);

/** n integers in one line, without brackets. */
KSL_EXPORT void ksl_arrayi_printWithOptions(FILE *file, int n, const int *A, ...);

/** Packed symmetric matrices of integers and of truth values, see ksl_triang_printWithOptions. */
KSL_EXPORT void ksl_triangi_printWithOptions(FILE *file, int n, const int *a, ...);
KSL_EXPORT void ksl_triangb_printWithOptions(FILE *file, int n, const bool *a, ...);

KSL_END_C

#define ksl_vec3_print(...) ksl_vec3_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_vec3f_print(...) ksl_vec3f_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_vec4_print(...) ksl_vec4_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_vec4f_print(...) ksl_vec4f_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_quaternion_print(...) ksl_quaternion_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_quaternionf_print(...) ksl_quaternionf_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_mat3x3_print(...) ksl_mat3x3_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_mat3x3f_print(...) ksl_mat3x3f_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_mat4x4_print(...) ksl_mat4x4_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_mat4x4f_print(...) ksl_mat4x4f_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_SE3_print(...) ksl_SE3_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_SE3f_print(...) ksl_SE3f_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_screw_print(...) ksl_screw_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_screwf_print(...) ksl_screwf_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_coscrew_print(...) ksl_coscrew_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_coscrewf_print(...) ksl_coscrewf_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_inertia_print(...) ksl_inertia_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_inertiaf_print(...) ksl_inertiaf_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_spatial_inertia_print(...) ksl_spatial_inertia_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_spatial_inertiaf_print(...) ksl_spatial_inertiaf_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_eulerangles_print(...) ksl_eulerangles_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_euleranglesf_print(...) ksl_euleranglesf_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_array_print(...) ksl_array_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_arrayf_print(...) ksl_arrayf_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_array2D_print(...) ksl_array2D_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_array2Df_print(...) ksl_array2Df_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_triang_print(...) ksl_triang_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_triangf_print(...) ksl_triangf_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_arrayi_print(...) ksl_arrayi_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_triangi_print(...) ksl_triangi_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)
#define ksl_triangb_print(...) ksl_triangb_printWithOptions(__VA_ARGS__, (void *)0, (void *)0)

#ifdef NDEBUG
#define ksl_vec3_debug(...) ((void)0)
#define ksl_vec3f_debug(...) ((void)0)
#define ksl_vec4_debug(...) ((void)0)
#define ksl_vec4f_debug(...) ((void)0)
#define ksl_quaternion_debug(...) ((void)0)
#define ksl_quaternionf_debug(...) ((void)0)
#define ksl_mat3x3_debug(...) ((void)0)
#define ksl_mat3x3f_debug(...) ((void)0)
#define ksl_mat4x4_debug(...) ((void)0)
#define ksl_mat4x4f_debug(...) ((void)0)
#define ksl_SE3_debug(...) ((void)0)
#define ksl_SE3f_debug(...) ((void)0)
#define ksl_screw_debug(...) ((void)0)
#define ksl_screwf_debug(...) ((void)0)
#define ksl_coscrew_debug(...) ((void)0)
#define ksl_coscrewf_debug(...) ((void)0)
#define ksl_inertia_debug(...) ((void)0)
#define ksl_inertiaf_debug(...) ((void)0)
#define ksl_spatial_inertia_debug(...) ((void)0)
#define ksl_spatial_inertiaf_debug(...) ((void)0)
#define ksl_eulerangles_debug(...) ((void)0)
#define ksl_euleranglesf_debug(...) ((void)0)
#define ksl_array_debug(...) ((void)0)
#define ksl_arrayf_debug(...) ((void)0)
#define ksl_array2D_debug(...) ((void)0)
#define ksl_array2Df_debug(...) ((void)0)
#define ksl_triang_debug(...) ((void)0)
#define ksl_triangf_debug(...) ((void)0)
#define ksl_arrayi_debug(...) ((void)0)
#define ksl_triangi_debug(...) ((void)0)
#define ksl_triangb_debug(...) ((void)0)
#else
#define ksl_vec3_debug(...) ksl_vec3_print(__VA_ARGS__)
#define ksl_vec3f_debug(...) ksl_vec3f_print(__VA_ARGS__)
#define ksl_vec4_debug(...) ksl_vec4_print(__VA_ARGS__)
#define ksl_vec4f_debug(...) ksl_vec4f_print(__VA_ARGS__)
#define ksl_quaternion_debug(...) ksl_quaternion_print(__VA_ARGS__)
#define ksl_quaternionf_debug(...) ksl_quaternionf_print(__VA_ARGS__)
#define ksl_mat3x3_debug(...) ksl_mat3x3_print(__VA_ARGS__)
#define ksl_mat3x3f_debug(...) ksl_mat3x3f_print(__VA_ARGS__)
#define ksl_mat4x4_debug(...) ksl_mat4x4_print(__VA_ARGS__)
#define ksl_mat4x4f_debug(...) ksl_mat4x4f_print(__VA_ARGS__)
#define ksl_SE3_debug(...) ksl_SE3_print(__VA_ARGS__)
#define ksl_SE3f_debug(...) ksl_SE3f_print(__VA_ARGS__)
#define ksl_screw_debug(...) ksl_screw_print(__VA_ARGS__)
#define ksl_screwf_debug(...) ksl_screwf_print(__VA_ARGS__)
#define ksl_coscrew_debug(...) ksl_coscrew_print(__VA_ARGS__)
#define ksl_coscrewf_debug(...) ksl_coscrewf_print(__VA_ARGS__)
#define ksl_inertia_debug(...) ksl_inertia_print(__VA_ARGS__)
#define ksl_inertiaf_debug(...) ksl_inertiaf_print(__VA_ARGS__)
#define ksl_spatial_inertia_debug(...) ksl_spatial_inertia_print(__VA_ARGS__)
#define ksl_spatial_inertiaf_debug(...) ksl_spatial_inertiaf_print(__VA_ARGS__)
#define ksl_eulerangles_debug(...) ksl_eulerangles_print(__VA_ARGS__)
#define ksl_euleranglesf_debug(...) ksl_euleranglesf_print(__VA_ARGS__)
#define ksl_array_debug(...) ksl_array_print(__VA_ARGS__)
#define ksl_arrayf_debug(...) ksl_arrayf_print(__VA_ARGS__)
#define ksl_array2D_debug(...) ksl_array2D_print(__VA_ARGS__)
#define ksl_array2Df_debug(...) ksl_array2Df_print(__VA_ARGS__)
#define ksl_triang_debug(...) ksl_triang_print(__VA_ARGS__)
#define ksl_triangf_debug(...) ksl_triangf_print(__VA_ARGS__)
#define ksl_arrayi_debug(...) ksl_arrayi_print(__VA_ARGS__)
#define ksl_triangi_debug(...) ksl_triangi_print(__VA_ARGS__)
#define ksl_triangb_debug(...) ksl_triangb_print(__VA_ARGS__)
#endif

#endif
