# cpack in the build folder makes Debian packages of what is installed, and the source archive (cpack
# --config CPackSourceConfig.cmake).
foreach(document LICENSE NOTICE)
  install(FILES ${PROJECT_SOURCE_DIR}/${document} DESTINATION ${CMAKE_INSTALL_DOCDIR}
    COMPONENT program)
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME meniscus)
set(CPACK_PACKAGE_VENDOR "the authors of Meniscus")
set(CPACK_PACKAGE_CONTACT "the authors of Meniscus <meniscus@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_COMPONENTS_ALL program)
if(MENISCUS_SHARED)
  list(APPEND CPACK_COMPONENTS_ALL library development)
endif()
if(MENISCUS_MPI)
  list(APPEND CPACK_COMPONENTS_ALL mpi)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME meniscus)
# The loader alone finds no device.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "pocl-opencl-icd | opencl-icd")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "The program meniscus.
 It extracts the surface that a camera sees from the particles of a fluid
 simulation, writes maps, meshes and pictures, and checks and measures OpenCL
 devices.")

set(CPACK_DEBIAN_MPI_PACKAGE_NAME meniscus-mpi)
set(CPACK_DEBIAN_MPI_PACKAGE_DEPENDS "meniscus (= ${PROJECT_VERSION}-1), openmpi-bin")
set(CPACK_COMPONENT_MPI_DESCRIPTION "One frame on several machines.
 What the program meniscus loads where mpirun or srun started it.")

set(soversion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libmeniscus${soversion})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA "${PROJECT_BINARY_DIR}/triggers")
file(WRITE ${PROJECT_BINARY_DIR}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "The library of Meniscus.
 Surfaces of particle-based fluid simulations as maps and meshes.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libmeniscus-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "libmeniscus${soversion} (= ${PROJECT_VERSION}-1)")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "The library of Meniscus, to build with.
 Headers, and the files of CMake and pkg-config.")

set(CPACK_SOURCE_GENERATOR TGZ)
set(CPACK_SOURCE_PACKAGE_FILE_NAME meniscus-${PROJECT_VERSION})
set(CPACK_SOURCE_IGNORE_FILES "/\\\\.git" "/build/" "/\\\\.cache/" "\\\\.pyc$" "__pycache__" "/\\\\.[a-z]+_cache/" "/\\\\.ci/")
include(CPack)

# What the packages hold, without tests and benchmarks.
add_custom_target(all_packaged)
foreach(target meniscus meniscus_shared meniscus_program meniscus_mpi meniscus_manual)
  if(TARGET ${target})
    add_dependencies(all_packaged ${target})
  endif()
endforeach()
