"""The warnings that C and C++ are free of, with gcc and clang: headers, in a user's project too, sources and tests.

CMakeLists.txt turns the same on in our own builds (ksl_warnings), where they are no errors."""

ALWAYS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wfloat-conversion", "-Wshadow", "-Wdouble-promotion", "-Wcast-align", "-Wcast-qual", "-Wundef",
          "-Wformat=2", "-Wno-format-nonliteral"]  # formats of numbers that are printed are the user's
ONLY_CXX = ["-Wnon-virtual-dtor", "-Woverloaded-virtual", "-Wextra-semi"]
# gcc's -Wsign-conversion is left out: gcc 12 warns of every array whose size is an int parameter of a template.
OF = {"gcc": ["-Wlogical-op", "-Wduplicated-cond", "-Wno-restrict"],  # gcc 12 warns of std::string's own code
      "clang": ["-Wsign-conversion", "-Wunreachable-code", "-Wno-static-in-inline"]}  # clang takes `extern inline` for inline alone


def options(family, language, test=False):
    """The options for gcc or clang, "c" or "c++".  In tests clang may find NAN and INFINITY, which are floats, where doubles are meant."""
    chosen = [*ALWAYS, *(ONLY_CXX if language == "c++" else []), *OF[family]]
    return [*chosen, "-Wno-double-promotion"] if test and family == "clang" else chosen
