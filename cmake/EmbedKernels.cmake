# meniscus_embed_kernels(VARIABLE FILE.cl ...) makes a C++ source that holds the kernels' text and a
# header with a handle for each, and puts their paths into VARIABLE. They are made again whenever a
# kernel changes.
function(meniscus_embed_kernels variable)
  set(out ${CMAKE_CURRENT_BINARY_DIR}/embedded_kernels.cpp)
  set(header ${CMAKE_CURRENT_BINARY_DIR}/made/device/kernels.hpp)
  file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/made/device)
  add_custom_command(
    OUTPUT ${out} ${header}
    COMMAND ${CMAKE_COMMAND} -DOUT=${out} -DHEADER=${header} "-DFILES=${ARGN}"
            -P ${PROJECT_SOURCE_DIR}/cmake/embed.cmake
    DEPENDS ${ARGN} ${PROJECT_SOURCE_DIR}/cmake/embed.cmake
    COMMENT "Embedding the kernels"
    VERBATIM)
  set(${variable} ${out} ${header} PARENT_SCOPE)
endfunction()
