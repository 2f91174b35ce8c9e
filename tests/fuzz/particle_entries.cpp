#include "fuzz/particle_entries.hpp"

#include <cstdio>
#include <cstdlib>
#include <vector>

#include "io/readers.hpp"
#include "meniscus/io.hpp"
#include "same_bits.hpp"

namespace meniscus::fuzz {
namespace {

void check_sizes(const Particles& p) {
  const auto fits = [&](std::size_t n) { return n == 0 || n == p.size(); };
  want(p.y.size() == p.size() && p.z.size() == p.size() && fits(p.vx.size()) &&
           p.vy.size() == p.vx.size() && p.vz.size() == p.vx.size() && fits(p.density.size()) &&
           fits(p.radius.size()) && fits(p.id.size()),
       "the arrays do not fit each other");
  for (const Attribute& attribute : p.attributes)
    want(attribute.values.size() == p.size() && !attribute.name.empty(),
         "an attribute does not fit");
}

// In two parts from where the values lie.
void check_source(const char* name, const std::string& bytes, const Particles& all) {
  const LayoutReader read = layout_reader_of(name);
  if (!read || all.size() == 0) return;
  const InputFile file{name, bytes};
  const auto from = memory_bytes(file);
  const auto source = source_of(from, read(from, {}));
  want(source->size() == static_cast<std::int64_t>(all.size()), "a source of another size");
  want(source->has_velocity() == !all.vx.empty(), "a source of other values");
  const std::size_t half = all.size() / 2;
  std::vector<float> x(all.size()), z(all.size()), vy(all.size());
  for (const auto& [first, count] :
       {std::pair<std::size_t, std::size_t>{0, half}, {half, all.size() - half}})
    source->read(static_cast<std::int64_t>(first), count,
                 {.x = x.data() + first, .z = z.data() + first, .vy = vy.data() + first});
  want(same_bits(x, all.x) && same_bits(z, all.z) && (all.vx.empty() || same_bits(vy, all.vy)),
       "a source gives other values");
}

}  // namespace

void want(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "fuzz: %s\n", what);
  std::abort();
}

void particles(const char* name, const std::string& bytes) {
  const Particles p = particles_of({name, bytes}, 0);
  check_sizes(p);
  check_source(name, bytes, p);
  const Particles more =
      particles_of({name, bytes}, ReadOptions{.attributes = {"temperature", "force"}});
  check_sizes(more);
  want(same_bits(more.x, p.x), "other positions with attributes");
}

void series(const std::string& bytes) {
  for (const SeriesFrame& frame : read_pvd({"f.pvd", bytes}))
    want(!frame.file.empty(), "a frame without a file");
}

}  // namespace meniscus::fuzz
