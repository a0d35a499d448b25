/* KSL: printing.  Texts of the user's are never formats, except real_fmt and int_fmt, which are checked at each use. */
#include "ksl/print.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define FACTORY {", ", "%0.6g", "%d", "true", "false", "[", "]", "[", "]", KSL_BREAK_BETWEEN_LINES, KSL_ROW_MAJOR}

static const ksl_print_options_t factory = FACTORY;
static ksl_print_options_t defaults = FACTORY;

/* ---- options ---- */

/* True for a text with exactly one conversion: flags, width and precision of at most three digits, one of `letters`. */
static bool is_format(const char *text, const char *letters) {
  int conversions = 0;
  for (const char *s = text; *s; s++) {
    if (*s != '%')
      continue;
    if (*++s == '%')
      continue;
    s += strspn(s, "-+ #0");
    const size_t width = strspn(s, "0123456789");
    s += width;
    size_t precision = 0;
    if (*s == '.')
      precision = strspn(++s, "0123456789"), s += precision;
    if (*s == 'l' && strchr(letters, 'f')) /* %lf is %f */
      s++;
    if (width > 3 || precision > 3 || !*s || !strchr(letters, *s))
      return false;
    conversions++;
  }
  return conversions == 1;
}

static bool is_real_format(const char *text) { return is_format(text, "aAeEfFgG"); }
static bool is_int_format(const char *text) { return is_format(text, "di"); }

/* Ends a text where its field ends, not within a UTF-8 character. */
static void end_text(char field[100]) {
  if (!memchr(field, 0, 100)) {
    size_t end = 99;
    while (end > 0 && ((unsigned char)field[end] & 0xc0) == 0x80)
      end--;
    field[end] = 0;
  }
}

static void set_text(char field[100], const char *text) {
  size_t length = 0;
  while (text && length < 100 && text[length])
    length++;
  if (length)
    memmove(field, text, length);
  memset(field + length, 0, 100 - length);
  end_text(field);
}

/* The options to print with, made safe: the user may have written the fields directly. */
static ksl_print_options_t checked(const ksl_print_options_t *options) {
  ksl_print_options_t o = options ? *options : defaults;
  char *texts[] = {o.delimiter,
                   o.real_fmt,
                   o.int_fmt,
                   o.true_fmt,
                   o.false_fmt,
                   o.inner_left_bracket,
                   o.inner_right_bracket,
                   o.outer_left_bracket,
                   o.outer_right_bracket};
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
    end_text(texts[i]);
  if (!is_real_format(o.real_fmt))
    set_text(o.real_fmt, factory.real_fmt);
  if (!is_int_format(o.int_fmt))
    set_text(o.int_fmt, factory.int_fmt);
  return o;
}

ksl_print_options_t *ksl_print_options(void) {
  ksl_print_options_t *options = (ksl_print_options_t *)malloc(sizeof *options);
  if (options)
    *options = factory;
  return options;
}

void ksl_print_setDefaultOptions(void) { defaults = factory; }

/* The set that a setter's `...` names. */
static ksl_print_options_t *chosen(va_list rest) {
  ksl_print_options_t *options = va_arg(rest, ksl_print_options_t *);
  return options ? options : &defaults;
}

void ksl_print_setDelimiterOption(const char *delimiter, ...) {
  va_list rest;
  va_start(rest, delimiter);
  set_text(chosen(rest)->delimiter, delimiter);
  va_end(rest);
}

void ksl_print_setRealFormatOption(const char *format, ...) {
  va_list rest;
  va_start(rest, format);
  char *field = chosen(rest)->real_fmt;
  set_text(field, format);
  if (!is_real_format(field))
    set_text(field, factory.real_fmt);
  va_end(rest);
}

void ksl_print_setInnerBracketsOption(const char *left, const char *right, ...) {
  va_list rest;
  va_start(rest, right);
  ksl_print_options_t *o = chosen(rest);
  set_text(o->inner_left_bracket, left);
  set_text(o->inner_right_bracket, right);
  va_end(rest);
}

void ksl_print_setOuterBracketsOption(const char *left, const char *right, ...) {
  va_list rest;
  va_start(rest, right);
  ksl_print_options_t *o = chosen(rest);
  set_text(o->outer_left_bracket, left);
  set_text(o->outer_right_bracket, right);
  va_end(rest);
}

void ksl_print_setBreakBetweenLinesInMatrixOption(ksl_print_breakBetweenLines_enum_t value, ...) {
  va_list rest;
  va_start(rest, value);
  chosen(rest)->line_breaks_in_matrices = value;
  va_end(rest);
}

void ksl_print_setBooleanOption(const char *for_true, const char *for_false, ...) {
  va_list rest;
  va_start(rest, for_false);
  ksl_print_options_t *o = chosen(rest);
  set_text(o->true_fmt, for_true);
  set_text(o->false_fmt, for_false);
  va_end(rest);
}

void ksl_print_setRowColumnMajorPrintingOption(ksl_matrix_enum_t value, ...) {
  va_list rest;
  va_start(rest, value);
  chosen(rest)->print_row_column_major = value;
  va_end(rest);
}

/* ---- lines and matrices ---- */

typedef enum number_kind { DOUBLE, FLOAT, INT, BOOL } number_kind;

static void put_number(FILE *file, const ksl_print_options_t *o, number_kind kind, const void *data, ptrdiff_t i) {
  switch (kind) {
  case DOUBLE: fprintf(file, o->real_fmt, ((const double *)data)[i]); break;
  case FLOAT: fprintf(file, o->real_fmt, (double)((const float *)data)[i]); break;
  case INT: fprintf(file, o->int_fmt, ((const int *)data)[i]); break;
  case BOOL: fputs(((const bool *)data)[i] ? o->true_fmt : o->false_fmt, file); break;
  }
}

/* n numbers, `step` apart, with the delimiter between them */
static void put_numbers(FILE *file, const ksl_print_options_t *o, number_kind kind, const void *data, int n,
                        ptrdiff_t first, ptrdiff_t step) {
  for (ptrdiff_t i = 0; i < n; i++) {
    if (i)
      fputs(o->delimiter, file);
    put_number(file, o, kind, data, first + i * step);
  }
}

/* The start of everything: the label, and the options to use; false if there is nothing to print or nowhere to. */
static bool begin(FILE *file, const void *data, va_list rest, const char **label, ksl_print_options_t *o) {
  const char *text = va_arg(rest, const char *);
  *label = text ? text : "";
  *o = checked(va_arg(rest, ksl_print_options_t *));
  if (!file || !data)
    return false;
  fputs(*label, file);
  return true;
}

typedef enum bracket_kind { NONE, INNER, OUTER } bracket_kind;

/* One line; text, unless NULL, follows the numbers. */
static void put_line(FILE *file, number_kind kind, bracket_kind brackets, int n, const void *data, const char *text,
                     va_list rest) {
  const char *label;
  ksl_print_options_t o;
  if (!begin(file, data, rest, &label, &o))
    return;
  const char *left[] = {"", o.inner_left_bracket, o.outer_left_bracket};
  const char *right[] = {"", o.inner_right_bracket, o.outer_right_bracket};
  fputs(left[brackets], file);
  put_numbers(file, &o, kind, data, n, 0, 1);
  if (text) {
    fputs(o.delimiter, file);
    fputs(text, file);
  }
  fputs(right[brackets], file);
  fputc('\n', file);
}

/* Which lines a matrix is printed in. */
typedef enum layout {
  COLUMN_STORED, /* stored by columns; printed by rows or columns as the option says */
  OPTION_STORED, /* stored as the option says, printed by rows */
  ROW_STORED,    /* printed by rows */
  TRIANGULAR     /* packed lower triangle */
} layout;

/* Line i has the numbers at i * line_step + j * step:

       the memory in lines of `columns` numbers        line_step = columns, step = 1
       rows of what is stored by columns               line_step = 1, step = rows
       of a packed triangle                            i (i + 1) / 2 + j, j <= i; beyond the diagonal those of the mirror image */
static void put_lines(FILE *file, number_kind kind, layout stored, int rows, int columns, const void *data,
                      va_list rest) {
  const char *label;
  ksl_print_options_t o;
  if (!begin(file, data, rest, &label, &o))
    return;
  const bool by_columns = o.print_row_column_major == KSL_COLUMN_MAJOR;
  ptrdiff_t line_step = columns, step = 1;
  if (stored == COLUMN_STORED ? !by_columns : stored == OPTION_STORED && by_columns) {
    line_step = 1;
    step = rows;
  }
  fputs(o.outer_left_bracket, file);
  for (ptrdiff_t i = 0; i < rows; i++) {
    if (i) {
      fputs(o.delimiter, file);
      if (o.line_breaks_in_matrices != KSL_NO_BREAK_BETWEEN_LINES) {
        fputc('\n', file);
        for (size_t k = strlen(label) + strlen(o.outer_left_bracket); k > 0; k--)
          fputc(' ', file);
      }
    }
    fputs(o.inner_left_bracket, file);
    if (stored == TRIANGULAR) {
      for (ptrdiff_t j = 0; j < columns; j++) {
        if (j)
          fputs(o.delimiter, file);
        put_number(file, &o, kind, data, j <= i ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i);
      }
    } else {
      put_numbers(file, &o, kind, data, columns, i * line_step, step);
    }
    fputs(o.inner_right_bracket, file);
  }
  fputs(o.outer_right_bracket, file);
  fputc('\n', file);
}

/* ---- the published names ---- */

#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#define NUMBER DOUBLE
#include "print.inc"
#undef NUMBER
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#define NUMBER FLOAT
#include "print.inc"
#undef NUMBER
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/* The axes' letters: "xyz"; "invalid" for what is no sequence. */
static const char *sequence(ksl_axis_enum_t axis, char text[4]) {
  const ksl_vec3i_t axes = ksl_axis_getVector(axis);
  for (int i = 0; i < 3; i++)
    text[i] = "xyz"[axes.at[i]];
  text[3] = 0;
  return (unsigned)axis >= (unsigned)KSL_AXIS_INVALID ? "invalid" : text;
}

void ksl_eulerangles_printWithOptions(FILE *file, const ksl_eulerangles_t *self, ...) {
  va_list rest;
  va_start(rest, self);
  char text[4];
  if (self)
    put_line(file, DOUBLE, OUTER, 3, self->angles.at, sequence(self->axis, text), rest);
  va_end(rest);
}

void ksl_euleranglesf_printWithOptions(FILE *file, const ksl_euleranglesf_t *self, ...) {
  va_list rest;
  va_start(rest, self);
  char text[4];
  if (self)
    put_line(file, FLOAT, OUTER, 3, self->angles.at, sequence(self->axis, text), rest);
  va_end(rest);
}

void ksl_arrayi_printWithOptions(FILE *file, int n, const int *a, ...) {
  va_list rest;
  va_start(rest, a);
  put_line(file, INT, NONE, n, a, NULL, rest);
  va_end(rest);
}

void ksl_triangi_printWithOptions(FILE *file, int n, const int *a, ...) {
  va_list rest;
  va_start(rest, a);
  put_lines(file, INT, TRIANGULAR, n, n, a, rest);
  va_end(rest);
}

void ksl_triangb_printWithOptions(FILE *file, int n, const bool *a, ...) {
  va_list rest;
  va_start(rest, a);
  put_lines(file, BOOL, TRIANGULAR, n, n, a, rest);
  va_end(rest);
}
