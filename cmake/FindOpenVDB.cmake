# OpenVDB, whose own module asks for more than reading needs: OpenVDB::openvdb.
find_path(OpenVDB_INCLUDE_DIR openvdb/openvdb.h)
find_library(OpenVDB_LIBRARY openvdb)
mark_as_advanced(OpenVDB_INCLUDE_DIR OpenVDB_LIBRARY)
if(OpenVDB_INCLUDE_DIR)
  foreach(part MAJOR MINOR PATCH)
    file(STRINGS ${OpenVDB_INCLUDE_DIR}/openvdb/version.h line
      REGEX "^#define OPENVDB_LIBRARY_${part}_VERSION_NUMBER +[0-9]+")
    string(REGEX REPLACE ".* " "" OpenVDB_${part} "${line}")
  endforeach()
  set(OpenVDB_VERSION ${OpenVDB_MAJOR}.${OpenVDB_MINOR}.${OpenVDB_PATCH})
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenVDB
  REQUIRED_VARS OpenVDB_LIBRARY OpenVDB_INCLUDE_DIR VERSION_VAR OpenVDB_VERSION)
if(OpenVDB_FOUND AND NOT TARGET OpenVDB::openvdb)
  find_package(TBB CONFIG REQUIRED)
  find_package(Imath CONFIG REQUIRED)
  find_package(Boost REQUIRED)  # headers
  add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
  set_target_properties(OpenVDB::openvdb PROPERTIES
    IMPORTED_LOCATION "${OpenVDB_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${OpenVDB_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "TBB::tbb;Imath::Imath;Boost::headers")
endif()
