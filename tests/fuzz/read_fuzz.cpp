// Feeds the readers bytes of libFuzzer's making. The first byte chooses the format, the rest is
// the file. Anything but particles whose arrays fit together or an InputError is a fault.
#include <cstdint>
#include <cstdlib>

#include "io/readers.hpp"

namespace {

bool fits_together(const meniscus::Particles& p) {
  const auto fits = [&](std::size_t n) { return n == 0 || n == p.size(); };
  return p.y.size() == p.size() && p.z.size() == p.size() && fits(p.vx.size()) &&
         p.vy.size() == p.vx.size() && p.vz.size() == p.vx.size() && fits(p.density.size()) &&
         fits(p.radius.size()) && fits(p.id.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const char* const kNames[] = {"f.ply", "f.vtk", "f.bgeo", "f.xyz", "f.csv"};
  if (size < 2) return 0;  // read_file refuses an empty file
  const char* const bytes = reinterpret_cast<const char*>(data);
  try {
    const auto particles =
        meniscus::particles_of({kNames[data[0] % 5], std::string(bytes + 1, size - 1)}, 0);
    if (!fits_together(particles)) std::abort();
  } catch (const meniscus::InputError&) {
  }
  return 0;
}
