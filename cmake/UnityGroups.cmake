# meniscus_unity(TARGET) has the sources of TARGET that stand together in a line of unity_groups.txt
# compiled as one (scripts/unity_groups.py). To be called where TARGET is made.
option(MENISCUS_UNITY "Compile several sources as one, in half the time; OFF: each alone" ON)
set(MENISCUS_UNITY_GROUPS ${CMAKE_CURRENT_LIST_DIR}/unity_groups.txt)
set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY
  CMAKE_CONFIGURE_DEPENDS ${MENISCUS_UNITY_GROUPS})

function(meniscus_unity target)
  if(NOT MENISCUS_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  file(STRINGS ${MENISCUS_UNITY_GROUPS} groups REGEX "^${target} ")
  set(number 0)
  foreach(group IN LISTS groups)
    math(EXPR number "${number} + 1")
    string(REPLACE " " ";" files "${group}")
    list(POP_FRONT files)
    list(TRANSFORM files PREPEND ${PROJECT_SOURCE_DIR}/)
    set_source_files_properties(${files} PROPERTIES UNITY_GROUP ${number})
  endforeach()
endfunction()
