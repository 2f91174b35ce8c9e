# Installs the library, its headers, the package that find_package(Meniscus) reads, and the file of
# pkg-config. None of them holds a path of this machine, so that all may be moved.
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/Meniscus)
set_target_properties(meniscus PROPERTIES EXPORT_NAME meniscus_static)
install(TARGETS meniscus EXPORT MeniscusStaticTargets
  DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT static)
install(EXPORT MeniscusStaticTargets NAMESPACE Meniscus:: DESTINATION ${package_folder}
  COMPONENT static)
if(MENISCUS_SHARED)
  install(TARGETS meniscus_shared EXPORT MeniscusTargets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library
            NAMELINK_COMPONENT development)
  install(EXPORT MeniscusTargets NAMESPACE Meniscus:: DESTINATION ${package_folder}
    COMPONENT development)
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/meniscus DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  COMPONENT development)

configure_package_config_file(
  ${PROJECT_SOURCE_DIR}/cmake/MeniscusConfig.cmake.in ${PROJECT_BINARY_DIR}/MeniscusConfig.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(
  ${PROJECT_BINARY_DIR}/MeniscusConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/MeniscusConfig.cmake
              ${PROJECT_BINARY_DIR}/MeniscusConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindBlosc.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindLibdeflate.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindOpenVDB.cmake
  DESTINATION ${package_folder} COMPONENT development)

# Whoever links the static library also links what it uses.
set(link_privately "-lOpenEXR -lOpenEXRCore -lIlmThread -lIex -lImath -lpng -lblosc -ldeflate -lz -ltbb")
if(MENISCUS_OPENVDB)
  string(PREPEND link_privately "-lopenvdb ")
endif()
set(link_privately "${link_privately} -lOpenCL -lgmp -ldl -pthread -lstdc++ -lm")
if(MENISCUS_SHARED)
  set(pc_cflags "")
  set(pc_requires "")
  set(pc_private "${link_privately}")
  set(pc_public "")
else()
  set(pc_cflags " -DMENISCUS_STATIC")
  set(pc_requires " OpenCL")
  set(pc_private "")
  set(pc_public " -Wl,--exclude-libs,libmeniscus.a ${link_privately}")
endif()
file(RELATIVE_PATH pc_prefix
  ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" pc_prefix ${pc_prefix})
configure_file(${PROJECT_SOURCE_DIR}/cmake/meniscus.pc.in ${PROJECT_BINARY_DIR}/meniscus.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/meniscus.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

if(TARGET meniscus_program)
  include(Manual)
endif()
include(Packages)
