# KSL_PUGIXML: the target of pugixml, which reads robot files.  Its static form where there is one: then nobody who uses KSL's libraries needs it.
#
# KSL_FETCH_PUGIXML=ON downloads it, and compiles it into KSL: for machines without a package of it, and for wheels, whose parts are all pinned.
option(KSL_FETCH_PUGIXML "Download the source of pugixml, and compile it into KSL" OFF)
set(KSL_FETCHED_PUGIXML 1.13) # scripts/dist/sbom.py reads it here

if(KSL_FETCH_PUGIXML)
  include(FetchContent)
  # the same bytes at both places
  FetchContent_Declare(ksl_pugixml SOURCE_SUBDIR none # its own build stays out
    URL http://deb.debian.org/debian/pool/main/p/pugixml/pugixml_${KSL_FETCHED_PUGIXML}.orig.tar.gz
        https://github.com/zeux/pugixml/archive/refs/tags/v${KSL_FETCHED_PUGIXML}.tar.gz
    URL_HASH SHA256=5c5ad5d7caeb791420408042a7d88c2c6180781bf218feca259fd9d840a888e1
    DOWNLOAD_EXTRACT_TIMESTAMP ON)
  FetchContent_MakeAvailable(ksl_pugixml)
  add_library(ksl_pugixml_objects OBJECT ${ksl_pugixml_SOURCE_DIR}/src/pugixml.cpp)
  target_include_directories(ksl_pugixml_objects SYSTEM INTERFACE ${ksl_pugixml_SOURCE_DIR}/src)
  list(APPEND KSL_OBJECTS $<TARGET_OBJECTS:ksl_pugixml_objects>)
  add_library(ksl_pugixml INTERFACE) # where its header is; its code is among our objects
  target_include_directories(ksl_pugixml SYSTEM INTERFACE ${ksl_pugixml_SOURCE_DIR}/src)
  set(KSL_PUGIXML ksl_pugixml)
  set(KSL_INSTALLED_PUGIXML "")
  set(KSL_LINKED_PUGIXML "")
  return()
endif()

find_package(pugixml QUIET)
if(NOT pugixml_FOUND)
  message(FATAL_ERROR "KSL reads robot files with pugixml, which was not found; on Debian and Ubuntu: apt install libpugixml-dev; elsewhere "
    "-DKSL_FETCH_PUGIXML=ON downloads it")
endif()
set(KSL_PUGIXML pugixml::pugixml)
set(KSL_INSTALLED_PUGIXML pugixml::pugixml)
# what users of the static library link: the static form where they have it, or no program could be static throughout
set(KSL_LINKED_PUGIXML $<IF:$<TARGET_EXISTS:pugixml::static>,pugixml::static,pugixml::pugixml>)
if(TARGET pugixml::static)
  set(KSL_PUGIXML pugixml::static)
endif()
