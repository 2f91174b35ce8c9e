# Writes OUT, a C++ source with the bytes of every file in FILES (run by EmbedFiles.cmake).
set(cases "")
set(count 0)
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  file(READ ${file} bytes HEX)
  string(REGEX REPLACE "(..)" "\\\\x\\1" bytes "${bytes}")
  string(APPEND cases "  static const char ${FUNCTION}_${count}[] = \"${bytes}\";
  if (name == \"${name}\") return {${FUNCTION}_${count}, sizeof ${FUNCTION}_${count} - 1};\n")
  math(EXPR count "${count} + 1")
endforeach()
file(WRITE ${OUT} "// Made by cmake/embed_bytes.cmake.
#include \"${HEADER}\"

namespace meniscus {

std::string_view ${FUNCTION}(std::string_view name) {
${cases}  return {};
}

}  // namespace meniscus
")
