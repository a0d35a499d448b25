# KSL_VERSION as include/ksl/config.h has it, where the version stands: the single header, C, Python, the wheel and packages take it from there.
file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/../include/ksl/config.h KSL_VERSION REGEX "#define KSL_VERSION \"")
string(REGEX REPLACE ".*\"(.*)\".*" "\\1" KSL_VERSION "${KSL_VERSION}")
