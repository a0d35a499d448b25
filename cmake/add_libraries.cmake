# ksl_add_libraries(NAME FACE OBJECTS...): the shared library ksl::FACE and the static one ksl::FACE_static, both called
# NAME on disk, from the same objects.  The names are the same in the build tree and in the installed package.
function(ksl_add_libraries name face)
  foreach(kind IN ITEMS SHARED STATIC)
    string(REPLACE SHARED "" suffix ${kind})
    string(REPLACE STATIC _static suffix "${suffix}")
    add_library(${name}${suffix} ${kind} ${ARGN})
    add_library(ksl::${face}${suffix} ALIAS ${name}${suffix})
    set_target_properties(${name}${suffix} PROPERTIES OUTPUT_NAME ${name} EXPORT_NAME ${face}${suffix})
    target_include_directories(${name}${suffix} PUBLIC
      $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    target_link_libraries(${name}${suffix} PUBLIC m) # the headers' inline functions call it
  endforeach()
  set_target_properties(${name} PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION 0)
endfunction()
