/* Read before any other header in C++ for macOS.  Apple's math.h reads a part of float.h; LLVM's float.h, whose guard is then set, gives nobody the rest. */
#include <math.h>
#undef _LIBCPP_FLOAT_H
#include <float.h>
