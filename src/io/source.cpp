// Particle sources: values that are left in a file, and particles in memory.
#include "meniscus/source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/parallel.hpp"
#include "base/team.hpp"
#include "io/layout.hpp"
#include "io/parts.hpp"
#include "io/readers.hpp"
#include "io/rows.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"
#include "prepare/attributes.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kHead = std::size_t{1} << 16;  // a longer header is read as a whole

class MemorySource : public ParticleSource {
 public:
  explicit MemorySource(const BorrowedParticles& particles) : particles_(particles) {}
  /// `moving`: whether they would have velocities where there are none.
  MemorySource(Particles&& particles, bool moving)
      : own_(std::move(particles)), particles_(own_), moving_(moving) {}

  std::int64_t size() const override { return static_cast<std::int64_t>(particles_.size()); }
  bool has_radius() const override { return !particles_.radius.empty(); }
  bool has_velocity() const override {
    return particles_.size() == 0 ? moving_ : !particles_.vx.empty();
  }
  double particle_radius() const override { return particles_.particle_radius; }
  std::string name(std::int64_t particle) const override {
    return "particle " + std::to_string(particle);
  }
  std::vector<std::string> attributes() const override {
    std::vector<std::string> names;
    for (const BorrowedAttribute& attribute : particles_.attributes)
      names.push_back(attribute.name);
    return names;
  }
  const BorrowedParticles* in_memory() const override { return &particles_; }
  void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const override {
    const auto copy = [&](const Column& from, float* values) {
      if (!values || from.empty()) return;
      constexpr std::size_t kGrain = std::size_t{1} << 17;  // values that are worth a thread
      parallel_for(count, kGrain, [&](std::size_t begin, std::size_t end) {
        from.copy(static_cast<std::size_t>(first) + begin, end - begin, values + begin);
      });
    };
    copy(particles_.x, to.x);
    copy(particles_.y, to.y);
    copy(particles_.z, to.z);
    copy(particles_.vx, to.vx);
    copy(particles_.vy, to.vy);
    copy(particles_.vz, to.vz);
    copy(particles_.radius, to.radius);
    for (std::size_t k = 0; k < to.attributes.size(); ++k)
      copy(particles_.attributes[k].values, to.attributes[k]);
  }

 private:
  Particles own_;
  BorrowedParticles particles_;
  bool moving_ = false;
};

void check_scalar(const char* name, std::size_t size, std::size_t particles) {
  require(size == 0 || size == particles, std::string("particles: ") + name + " has " +
                                              std::to_string(size) + " values for " +
                                              std::to_string(particles) + " particles");
}

// Throws unless each array has one entry a particle or, where it is optional, none.
void check_sizes(const BorrowedParticles& p) {
  const auto vector = [&](const char* names, const std::array<const Column*, 3>& axes) {
    for (const Column* values : axes)
      require(values->size() == axes[0]->size() && (values->empty() || values->size() == p.size()),
              std::string("particles: ") + names + " have " + std::to_string(axes[0]->size()) +
                  ", " + std::to_string(axes[1]->size()) + " and " +
                  std::to_string(axes[2]->size()) + " values for " + std::to_string(p.size()) +
                  " particles");
  };
  vector("x, y and z", {&p.x, &p.y, &p.z});
  vector("vx, vy and vz", {&p.vx, &p.vy, &p.vz});
  check_scalar("radius", p.radius.size(), p.size());
  std::vector<std::string> names;
  for (const BorrowedAttribute& attribute : p.attributes) {
    check_scalar(attribute.name.c_str(), attribute.values.size(), p.size());
    require(attribute.values.size() == p.size(),
            "particles: attribute " + attribute.name + " has no values");
    names.push_back(attribute.name);
  }
  check_names(names);
}

void check_sizes(const Particles& p) {
  check_sizes(BorrowedParticles(p));
  check_scalar("density", p.density.size(), p.size());
  check_scalar("id", p.id.size(), p.size());
}

// Files of fewer particles are read at once, and looked through for what else may be wrong.
constexpr std::int64_t kLarge = std::int64_t{1} << 18;

}  // namespace

std::unique_ptr<ParticleSource> open_rows(const std::string& path, const ReadOptions& options) {
  if (!lower_case(path).ends_with(".ply")) {
    try {
      const LayoutReader read = layout_reader_of(path);
      if (!read) return nullptr;
      const auto bytes = bytes_of_file(path);
      Layout layout = read(bytes, options);
      return is_on_disk(layout) ? source_of(bytes, std::move(layout)) : nullptr;
    } catch (const InputError&) {
      return nullptr;
    }
  }
  try {
    const auto bytes = bytes_of_file(path);
    const InputFile head{
        path, text_at(*bytes, 0,
                      static_cast<std::size_t>(std::min<std::uint64_t>(kHead, bytes->size())))};
    const auto rows = ply_rows(head, bytes->size(), options);
    if (!rows || !(rows->particle_radius >= 0) || !std::isfinite(rows->particle_radius))
      return nullptr;
    Layout layout;
    layout.count = rows->count;
    layout.item = "vertex";
    layout.attributes = rows->attributes;
    layout.particle_radius =
        options.particle_radius > 0 ? options.particle_radius : rows->particle_radius;
    for (const RowLayout::Column& column : rows->columns)
      if (column.field != Field::radius || !(options.particle_radius > 0))
        layout.columns.push_back({column.field, column.attribute, "", column.type, rows->order,
                                  bytes, rows->offset + column.offset, rows->stride});
    return source_of(bytes, std::move(layout));
  } catch (const InputError&) {
    return nullptr;
  }
}

std::unique_ptr<ParticleSource> open_file(const std::string& path, const ReadOptions& options) {
  if (const LayoutReader read = layout_reader_of(path)) {
    const auto bytes = bytes_of_file(path);
    if (bytes->size() == 0) throw InputError(path + ": is empty (0 bytes)");
    Layout layout = read(bytes, options);
    if (layout.count >= kLarge && is_on_disk(layout)) return source_of(bytes, std::move(layout));
    const bool moving = std::any_of(layout.columns.begin(), layout.columns.end(),
                                    [](const auto& column) { return column.field == Field::vx; });
    return std::make_unique<MemorySource>(checked_particles(*bytes, layout), moving);
  }
  auto rows = open_rows(path, options);
  if (rows && rows->size() >= kLarge) return rows;
  const bool moving = rows && rows->has_velocity();
  return std::make_unique<MemorySource>(read_particles(path, options), moving);
}

std::unique_ptr<ParticleSource> open_particles(const std::string& path,
                                               const ReadOptions& options) {
  require(options.particle_radius >= 0, "open_particles: particle_radius is " +
                                            shown(options.particle_radius) +
                                            ", must be > 0, or 0 for what the file states");
  return open_parts(path, options, alone());
}

std::unique_ptr<ParticleSource> open_particles(const std::string& path, double particle_radius) {
  return open_particles(path, ReadOptions{.particle_radius = particle_radius});
}

void check(const Particles& particles) {
  check_sizes(particles);
  check(BorrowedParticles(particles));
}

void check(const BorrowedParticles& particles) {
  check_sizes(particles);
  const std::string wanted = ", must be > 0 and finite";
  for (std::size_t i = 0; i < particles.radius.size(); ++i) {
    const float radius = particles.radius[i];
    if (!(radius > 0) || !std::isfinite(radius))
      throw InvalidArgument("particles: radius of particle " + std::to_string(i) + " is " +
                            shown(radius) + wanted + " (leave radius empty where all are alike)");
  }
  const double stated = particles.particle_radius;
  require(stated >= 0 && std::isfinite(stated), "particles: particle_radius is " + shown(stated) +
                                                    wanted + ", or 0 where it is not known");
}

std::unique_ptr<ParticleSource> source_of(const Particles& particles) {
  check_sizes(particles);
  return std::make_unique<MemorySource>(BorrowedParticles(particles));
}

std::unique_ptr<ParticleSource> source_of(const BorrowedParticles& particles) {
  check_sizes(particles);
  return std::make_unique<MemorySource>(particles);
}

}  // namespace meniscus
