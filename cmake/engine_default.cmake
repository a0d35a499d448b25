# KSL_ENGINE_DEFAULT: whether the engine is built unless KSL_ENGINE says so.  By itself KSL builds it.  As part of another
# project it does where that project has C++ and pugixml is there: who wants the algebra alone needs a C compiler and no more.
get_property(KSL_PARENT_LANGUAGES GLOBAL PROPERTY ENABLED_LANGUAGES) # C is among them by now
set(KSL_ENGINE_DEFAULT ON)
if(NOT PROJECT_IS_TOP_LEVEL)
  find_package(pugixml QUIET)
  if(NOT CXX IN_LIST KSL_PARENT_LANGUAGES OR NOT pugixml_FOUND)
    set(KSL_ENGINE_DEFAULT OFF)
  endif()
endif()
