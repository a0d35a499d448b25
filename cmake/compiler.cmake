# The compiler, where nobody names one: clang, if there is one of 14 or later that works.  Its kernels are up to a third faster than those of gcc 12
# for one state, and take a quarter less time to compile (docs/decisions/0014-weight.md).  Results are the same to the bit.
#
# CC, CXX, CMAKE_C_COMPILER, CMAKE_CXX_COMPILER or a toolchain file is a name.  pip's build sets CC and CXX to the compiler of Python: there, say
# CC=clang CXX=clang++.  Included before project().
if(NOT CMAKE_SOURCE_DIR STREQUAL CMAKE_CURRENT_SOURCE_DIR OR NOT CMAKE_HOST_UNIX OR CMAKE_HOST_APPLE OR CMAKE_CROSSCOMPILING)
  return() # what this project is a part of has chosen
endif()
foreach(chosen IN ITEMS "${CMAKE_C_COMPILER}" "${CMAKE_CXX_COMPILER}" "${CMAKE_TOOLCHAIN_FILE}" "${CMAKE_SYSTEM_NAME}" "$ENV{CC}" "$ENV{CXX}")
  if(NOT chosen STREQUAL "")
    return()
  endif()
endforeach()
find_program(KSL_CLANG clang)
find_program(KSL_CLANGXX clang++)
mark_as_advanced(KSL_CLANG KSL_CLANGXX)
if(NOT KSL_CLANG OR NOT KSL_CLANGXX)
  return()
endif()
# One without a C++ library of C++20 beside it doesn't serve.
file(WRITE ${CMAKE_BINARY_DIR}/CMakeFiles/ksl_compiler.cpp "#include <span>\nstatic_assert(__clang_major__ >= 14);\nint main() { return std::span<int>().size(); }\n")
execute_process(COMMAND ${KSL_CLANGXX} -std=c++20 -o ${CMAKE_BINARY_DIR}/CMakeFiles/ksl_compiler ${CMAKE_BINARY_DIR}/CMakeFiles/ksl_compiler.cpp
  RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET)
if(NOT failed)
  set(CMAKE_C_COMPILER ${KSL_CLANG})
  set(CMAKE_CXX_COMPILER ${KSL_CLANGXX})
endif()
