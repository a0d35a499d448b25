/* Checks of tests in C: what fails is printed and counted, and the program goes on. */
#pragma once

#include <ksl/engine.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

static int failures;

#define CHECK(condition)                                                                                               \
  do {                                                                                                                 \
    if (!(condition)) {                                                                                                \
      ++failures;                                                                                                      \
      printf("%s:%d: %s; last message: %s\n", __FILE__, __LINE__, #condition, ksl_error_message());                    \
    }                                                                                                                  \
  } while (0)

/* The call is refused with this status, in one line that has the words. */
#define CHECK_REFUSED(call, status, words)                                                                             \
  do {                                                                                                                 \
    CHECK((call) == (status));                                                                                         \
    CHECK(strstr(ksl_error_message(), words) != NULL);                                                                 \
    CHECK(strchr(ksl_error_message(), '\n') == NULL);                                                                  \
  } while (0)

static inline int close_to(double x, double y) { return fabs(x - y) <= 1e-12 * fmax(1, fabs(y)); }

/* Of the program: 1 if anything failed.  The number itself won't do, since systems keep its last eight bits only. */
static inline int exit_status(void) { return failures > 0; }
