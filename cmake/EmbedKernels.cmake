# meniscus_embed_kernels(VARIABLE FILE.cl ...) makes a C++ source that holds the kernels' text and
# puts its path into VARIABLE. It is made again whenever a kernel changes.
function(meniscus_embed_kernels variable)
  set(out ${CMAKE_CURRENT_BINARY_DIR}/embedded_kernels.cpp)
  add_custom_command(
    OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} -DOUT=${out} "-DFILES=${ARGN}" -P ${PROJECT_SOURCE_DIR}/cmake/embed.cmake
    DEPENDS ${ARGN} ${PROJECT_SOURCE_DIR}/cmake/embed.cmake
    COMMENT "Embedding the kernels"
    VERBATIM)
  set(${variable} ${out} PARENT_SCOPE)
endfunction()
