# meniscus_shared: the library as a shared one, made of the static one's object files. Program and
# tests link the static one, since they use what is not for others. The version script hides what the
# compiler could not: templates of the standard library.
add_library(meniscus_shared SHARED $<TARGET_OBJECTS:meniscus>)
target_include_directories(meniscus_shared
  PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
         $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_compile_features(meniscus_shared PUBLIC cxx_std_20)
target_link_libraries(meniscus_shared
  PRIVATE ${meniscus_private_libraries} OpenCL::OpenCL Threads::Threads)
# While the version is 0.x, every minor one may change what is called.
set_target_properties(meniscus_shared PROPERTIES
  OUTPUT_NAME meniscus EXPORT_NAME meniscus
  CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(symbols ${PROJECT_SOURCE_DIR}/cmake/meniscus.map)
target_link_options(meniscus_shared PRIVATE
  LINKER:--version-script=${symbols} LINKER:--no-undefined LINKER:--gc-sections)
set_property(TARGET meniscus_shared PROPERTY LINK_DEPENDS ${symbols})
