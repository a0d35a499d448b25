# Faults that the targets must find, planted in copies of the sources: what is replaced, and by what.
set(file_of_numbers element.cpp) # an attribute with more numbers than are wanted is written behind the array
set(whole_numbers "if (i < count)")
set(broken_numbers "if (i < count + 1)")
set(file_of_utf16 xml.cpp) # a surrogate at the end of the text: the one that it lacks is read behind the end
set(whole_utf16 "i + 3 < bytes.size() ? unit(i + 2) : 0")
set(broken_utf16 "i + 2 < bytes.size() + 1 ? unit(i + 2) : 0")
set(file_of_quadratic mimic.cpp) # leaders of mimic joints are looked for one by one
set(file_of_names check.cpp) # a second link of the same name is accepted
set(whole_names "if (!is_new)")
set(broken_names "if (!is_new && kind == \"joint\")")

set(name ${file_of_${KSL_FUZZ_PLANTED}})
file(READ ${PROJECT_SOURCE_DIR}/src/load/${name} text)
string(REPLACE "${whole_${KSL_FUZZ_PLANTED}}" "${broken_${KSL_FUZZ_PLANTED}}" faulty "${text}")
if(faulty STREQUAL text)
  message(FATAL_ERROR "planted.cmake: src/load/${name} no longer holds what the fault ${KSL_FUZZ_PLANTED} replaces")
endif()
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/planted_${name} "${faulty}")
list(REMOVE_ITEM sources ${PROJECT_SOURCE_DIR}/src/load/${name})
list(APPEND sources ${CMAKE_CURRENT_BINARY_DIR}/planted_${name})
