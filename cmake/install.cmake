# find_package(ksl CONFIG) and pkg-config for C and C++ users.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# ksl::compat: headers by their bare names, as <coscrew.h>.
add_library(ksl_compat INTERFACE)
set_target_properties(ksl_compat PROPERTIES EXPORT_NAME compat)
target_include_directories(ksl_compat INTERFACE
  $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include/ksl/compat> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/ksl/compat>)
target_link_libraries(ksl_compat INTERFACE ksl)

install(TARGETS ksl ksl_compat EXPORT ksl LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/ksl DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT ksl NAMESPACE ksl:: FILE ksl-config.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/ksl)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/ksl-config-version.cmake COMPATIBILITY SameMinorVersion)
# relative, so that the tree may be moved
file(RELATIVE_PATH KSL_PC_TO_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
configure_file(cmake/ksl.pc.in ksl.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ksl-config-version.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/ksl)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ksl.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
