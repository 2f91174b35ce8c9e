#include "program/program_identity.hpp"

#include "base/content_hash.hpp"
#include "device/kernel_sources.hpp"
#include "io/input_file.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {
namespace {

std::string identity() {
  std::string text = "meniscus " + version();
  for (const KernelSource& source : kernel_sources())
    text += ' ' + hex_digits(content_hash(source.text.data(), source.text.size()));
  try {
    text += ' ' + hex_digits(content_hash(read_file("/proc/self/exe").bytes));
  } catch (const InputError&) {  // no such file on this system: the kernels must do
  }
  return text;
}

}  // namespace

const std::string& program_identity() {
  static const std::string known = identity();
  return known;
}

}  // namespace meniscus
