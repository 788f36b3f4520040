# The version, as viscopade_version.h has it. A request is met by a version of the same major number that is not older.
# The headers are the same for every processor, so the size of a pointer is not compared.
foreach(_viscopade_folder ../../../include ../exports)
  set(_viscopade_header "${CMAKE_CURRENT_LIST_DIR}/${_viscopade_folder}/viscopade_version.h")
  if(EXISTS "${_viscopade_header}")
    file(STRINGS "${_viscopade_header}" _viscopade_line REGEX "define VISCOPADE_VERSION \"")
    break()
  endif()
endforeach()
string(REGEX REPLACE ".*\"([0-9]+[.][0-9]+[.][0-9]+).*" "\\1" PACKAGE_VERSION "${_viscopade_line}")
string(REGEX MATCH "^[0-9]+" _viscopade_major "${PACKAGE_VERSION}")

set(PACKAGE_VERSION_COMPATIBLE FALSE)
set(PACKAGE_VERSION_EXACT FALSE)
if(PACKAGE_FIND_VERSION_RANGE)
  if(PACKAGE_FIND_VERSION_MIN_MAJOR EQUAL _viscopade_major
      AND PACKAGE_VERSION VERSION_GREATER_EQUAL PACKAGE_FIND_VERSION_MIN
      AND (PACKAGE_VERSION VERSION_LESS PACKAGE_FIND_VERSION_MAX
        OR (PACKAGE_FIND_VERSION_RANGE_MAX STREQUAL "INCLUDE"
          AND PACKAGE_VERSION VERSION_EQUAL PACKAGE_FIND_VERSION_MAX)))
    set(PACKAGE_VERSION_COMPATIBLE TRUE)
  endif()
elseif(NOT PACKAGE_FIND_VERSION)
  set(PACKAGE_VERSION_COMPATIBLE TRUE)
elseif(PACKAGE_FIND_VERSION_MAJOR EQUAL _viscopade_major AND PACKAGE_VERSION VERSION_GREATER_EQUAL PACKAGE_FIND_VERSION)
  set(PACKAGE_VERSION_COMPATIBLE TRUE)
  if(PACKAGE_VERSION VERSION_EQUAL PACKAGE_FIND_VERSION)
    set(PACKAGE_VERSION_EXACT TRUE)
  endif()
endif()
