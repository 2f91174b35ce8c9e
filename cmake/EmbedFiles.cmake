# meniscus_embed_files(VARIABLE HEADER FUNCTION FILE ...) makes a C++ source that defines
# `std::string_view FUNCTION(std::string_view name)`, declared in HEADER in namespace meniscus: the
# bytes of the FILE with that name, empty when there is none. Its path goes into VARIABLE.
function(meniscus_embed_files variable header function)
  set(out ${CMAKE_CURRENT_BINARY_DIR}/${function}.cpp)
  add_custom_command(
    OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} -DOUT=${out} -DHEADER=${header} -DFUNCTION=${function}
            "-DFILES=${ARGN}" -P ${PROJECT_SOURCE_DIR}/cmake/embed_bytes.cmake
    DEPENDS ${ARGN} ${PROJECT_SOURCE_DIR}/cmake/embed_bytes.cmake
    COMMENT "Embedding ${function}"
    VERBATIM)
  set(${variable} ${out} PARENT_SCOPE)
endfunction()
