# find_package(ksl CONFIG) and pkg-config for C and C++ users.
include(CMakePackageConfigHelpers)

# ksl::compat: headers by their bare names, as <coscrew.h>.
add_library(ksl_compat INTERFACE)
add_library(ksl::compat ALIAS ksl_compat)
set_target_properties(ksl_compat PROPERTIES EXPORT_NAME compat)
target_include_directories(ksl_compat INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include/ksl/compat> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/ksl/compat>)
target_link_libraries(ksl_compat INTERFACE ksl_algebra)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/ksl)
# Headers whose code is in the engine's library come with it.  What is in C++ beside them is written with the engine's headers.
set(of_the_engine)
if(NOT KSL_ENGINE)
  file(GLOB cpp RELATIVE ${PROJECT_SOURCE_DIR}/include/ksl ${PROJECT_SOURCE_DIR}/include/ksl/*.hpp)
  list(REMOVE_ITEM cpp algebra.hpp isa.hpp pack.hpp spatial.hpp) # templates of the algebra
  foreach(header IN ITEMS engine arrays.h engine.h engine_building.h engine_calls.h engine_loops.h engine_simulate.h engine_types.h LISTS cpp)
    list(APPEND of_the_engine PATTERN include/ksl/${header} EXCLUDE)
  endforeach()
endif()
install(DIRECTORY include/ksl DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} ${of_the_engine})
install(TARGETS ksl_algebra ksl_algebra_static ksl_compat EXPORT ksl_algebra)
install(EXPORT ksl_algebra NAMESPACE ksl:: FILE ksl-algebra-targets.cmake DESTINATION ${package})
if(KSL_ENGINE)
  install(TARGETS ksl EXPORT ksl)
  install(EXPORT ksl NAMESPACE ksl:: FILE ksl-targets.cmake DESTINATION ${package})
  # apart: it needs pugixml where it is linked, and who links the shared library doesn't
  install(TARGETS ksl_static EXPORT ksl_static)
  install(EXPORT ksl_static NAMESPACE ksl:: FILE ksl-static-targets.cmake DESTINATION ${package})
endif()
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/ksl-config-version.cmake COMPATIBILITY SameMinorVersion)
configure_file(cmake/ksl-config.cmake ksl-config.cmake @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ksl-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/ksl-config-version.cmake DESTINATION ${package})

# NAME.pc of a library, for pkg-config, and NAME-static.pc, which links its static form where the shared one lies beside it, too.  PRIVATE is
# what the static form needs: libraries after those that call them, libm last.
function(ksl_install_pkg_config name library description private)
  # relative, so that the tree may be moved
  file(RELATIVE_PATH KSL_PC_TO_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
  set(libs "-L\${libdir} -l${library} -lm")
  configure_file(cmake/ksl.pc.in ${name}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
  set(libs "\${libdir}/${CMAKE_STATIC_LIBRARY_PREFIX}${library}${CMAKE_STATIC_LIBRARY_SUFFIX} ${private}")
  set(private "")
  string(APPEND name "-static")
  configure_file(cmake/ksl.pc.in ${name}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()

ksl_install_pkg_config(ksl-algebra ksl_algebra "Spatial algebra in C" "-lm")
if(KSL_ENGINE)
  set(runtime -lstdc++)
  if("c++" IN_LIST CMAKE_CXX_IMPLICIT_LINK_LIBRARIES)
    set(runtime -lc++)
  endif()
  if(KSL_INSTALLED_PUGIXML)
    string(PREPEND runtime "-lpugixml ")
  endif()
  ksl_install_pkg_config(ksl ksl "${PROJECT_DESCRIPTION}" "${runtime} -pthread -lm")
endif()
