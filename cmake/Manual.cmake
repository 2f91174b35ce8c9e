# Man pages and completions of shells, made from the program's help where it can be asked.
find_package(Python3 COMPONENTS Interpreter)
if(NOT Python3_Interpreter_FOUND OR CMAKE_CROSSCOMPILING)
  message(STATUS "No man pages and completions: no Python to make them, or another machine's program")
  return()
endif()
set(manual ${PROJECT_BINARY_DIR}/manual)
set(maker ${PROJECT_SOURCE_DIR}/scripts/manual.py)
add_custom_command(
  OUTPUT ${manual}/made
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${manual}
  COMMAND ${Python3_EXECUTABLE} ${maker} $<TARGET_FILE:meniscus_program> ${manual}
  COMMAND ${CMAKE_COMMAND} -E touch ${manual}/made
  DEPENDS meniscus_program ${maker}
  COMMENT "Making man pages and completions"
  VERBATIM)
add_custom_target(meniscus_manual ALL DEPENDS ${manual}/made)
install(DIRECTORY ${manual}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${manual}/completions/meniscus
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)
install(FILES ${manual}/completions/_meniscus
  DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT program)
install(FILES ${manual}/completions/meniscus.fish
  DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
