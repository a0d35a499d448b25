/* KSL: what the headers of Python's stable ABI ask pyconfig.h for, on a Mac.  What differs between processors is in Python's own pymacconfig.h, which
   Python.h includes after this. */
#pragma once

#include <sys/types.h>
#include <wchar.h>

#define HAVE_FORK 1
#define HAVE_SSIZE_T 1
#define HAVE_SYS_STAT_H 1
#define HAVE_SYS_TYPES_H 1
#define HAVE_WCHAR_H 1
#define SIZEOF_INT 4
#define SIZEOF_LONG_LONG 8
#define SIZEOF_PID_T 4
#define SIZEOF_WCHAR_T 4
#define WITH_DOC_STRINGS 1
#define WITH_PYMALLOC 1

static_assert(sizeof(int) == SIZEOF_INT && sizeof(long long) == SIZEOF_LONG_LONG && sizeof(pid_t) == SIZEOF_PID_T &&
              sizeof(wchar_t) == SIZEOF_WCHAR_T);
