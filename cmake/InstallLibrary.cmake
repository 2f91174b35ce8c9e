# Installs the library, its headers and the package that find_package(Meniscus) reads.
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/Meniscus)
install(TARGETS meniscus EXPORT MeniscusTargets DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/meniscus DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT MeniscusTargets NAMESPACE Meniscus:: DESTINATION ${package_folder})

configure_package_config_file(
  ${PROJECT_SOURCE_DIR}/cmake/MeniscusConfig.cmake.in ${PROJECT_BINARY_DIR}/MeniscusConfig.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(
  ${PROJECT_BINARY_DIR}/MeniscusConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/MeniscusConfig.cmake
              ${PROJECT_BINARY_DIR}/MeniscusConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindBlosc.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindLibdeflate.cmake
  DESTINATION ${package_folder})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/NOTICE
  DESTINATION ${CMAKE_INSTALL_DOCDIR})
