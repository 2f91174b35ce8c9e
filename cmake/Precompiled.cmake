# meniscus_precompiled(TARGET FILE FLAGS [LIBRARY ...]): targets that link FLAGS and say
#   target_precompile_headers(t REUSE_FROM TARGET)
# read the headers in FILE, which need these libraries, as they were compiled once. Their compile
# options have to be those of TARGET. -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON compiles without.
function(meniscus_precompiled target file flags)
  add_library(${target} OBJECT ${PROJECT_SOURCE_DIR}/cmake/precompiled.cpp)
  target_link_libraries(${target} PRIVATE meniscus ${flags} ${ARGN})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_precompile_headers(${target} PRIVATE ${file})
endfunction()
