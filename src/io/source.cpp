// Particle sources: rows of a binary file, and particles in memory.
#include "meniscus/source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <system_error>
#include <utility>

#include "io/parts.hpp"
#include "io/rows.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"
#include "stream/team.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kHead = std::size_t{1} << 16;   // a longer header is read as a whole
constexpr std::size_t kBlock = std::size_t{1} << 18;  // bytes read at a time: fits a cache

class MemorySource : public ParticleSource {
 public:
  explicit MemorySource(const BorrowedParticles& particles) : particles_(particles) {}
  explicit MemorySource(Particles&& particles) : own_(std::move(particles)), particles_(own_) {}

  std::int64_t size() const override { return static_cast<std::int64_t>(particles_.size()); }
  bool has_radius() const override { return !particles_.radius.empty(); }
  bool has_velocity() const override { return !particles_.vx.empty(); }
  double particle_radius() const override { return particles_.particle_radius; }
  std::string name(std::int64_t particle) const override {
    return "particle " + std::to_string(particle);
  }
  const BorrowedParticles* in_memory() const override { return &particles_; }
  void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const override {
    const auto copy = [&](const Column& from, float* values) {
      if (values && !from.empty()) from.copy(static_cast<std::size_t>(first), count, values);
    };
    copy(particles_.x, to.x);
    copy(particles_.y, to.y);
    copy(particles_.z, to.z);
    copy(particles_.vx, to.vx);
    copy(particles_.vy, to.vy);
    copy(particles_.vz, to.vz);
    copy(particles_.radius, to.radius);
  }

 private:
  Particles own_;
  BorrowedParticles particles_;
};

class RowSource : public ParticleSource {
 public:
  RowSource(std::string path, int descriptor, RowLayout rows)
      : path_(std::move(path)), descriptor_(descriptor), rows_(std::move(rows)) {
    posix_fadvise(descriptor_, 0, 0, POSIX_FADV_SEQUENTIAL);
  }
  ~RowSource() override { close(descriptor_); }

  std::int64_t size() const override { return rows_.count; }
  bool has_radius() const override { return column(Field::radius) != nullptr; }
  bool has_velocity() const override { return column(Field::vx) != nullptr; }
  double particle_radius() const override { return rows_.particle_radius; }
  std::string name(std::int64_t particle) const override {
    return "vertex " + std::to_string(particle);
  }

  void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const override {
    const std::pair<Field, float*> wanted[] = {
        {Field::x, to.x},   {Field::y, to.y},   {Field::z, to.z},          {Field::vx, to.vx},
        {Field::vy, to.vy}, {Field::vz, to.vz}, {Field::radius, to.radius}};
    const std::size_t step = std::max<std::size_t>(1, kBlock / rows_.stride);
    std::vector<char> block(std::min(step, count) * rows_.stride);
    for (std::size_t done = 0; done < count; done += step) {
      const std::size_t now = std::min(step, count - done);
      fetch(rows_.offset + (static_cast<std::uint64_t>(first) + done) * rows_.stride, block.data(),
            now * rows_.stride);
      for (const auto& [field, values] : wanted)
        if (values) unpack(block.data(), now, field, values + done);
    }
  }

 private:
  const RowLayout::Column* column(Field field) const {
    for (const RowLayout::Column& c : rows_.columns)
      if (c.field == field) return &c;
    return nullptr;
  }

  void unpack(const char* rows, std::size_t count, Field field, float* to) const {
    const RowLayout::Column* const c = column(field);
    if (!c) return;
    const char* from = rows + c->offset;
    if (c->type == Scalar::float32 && rows_.order == std::endian::native) {
      for (std::size_t i = 0; i < count; ++i, from += rows_.stride)
        std::memcpy(to + i, from, sizeof(float));
    } else {
      for (std::size_t i = 0; i < count; ++i, from += rows_.stride)
        to[i] = load_real<float>(from, c->type, rows_.order);
    }
  }

  void fetch(std::uint64_t at, char* to, std::size_t size) const {
    while (size > 0) {
      const ssize_t n = pread(descriptor_, to, size, static_cast<off_t>(at));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0)
        throw InputError(path_ + ": " + byte_place(static_cast<std::size_t>(at)) + ": " +
                         (n < 0 ? "cannot be read: " + std::generic_category().message(errno)
                                : "the file ends here, it was longer when it was opened"));
      to += n;
      at += static_cast<std::uint64_t>(n);
      size -= static_cast<std::size_t>(n);
    }
  }

  std::string path_;
  int descriptor_;
  RowLayout rows_;
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
}

void check_sizes(const Particles& p) {
  check_sizes(BorrowedParticles(p));
  check_scalar("density", p.density.size(), p.size());
  check_scalar("id", p.id.size(), p.size());
}

// Files of fewer particles are read at once, and looked through for what else may be wrong.
constexpr std::int64_t kLarge = std::int64_t{1} << 18;

}  // namespace

std::unique_ptr<ParticleSource> open_rows(const std::string& path, double particle_radius) {
  if (!lower_case(path).ends_with(".ply")) return nullptr;
  // Without waiting for who writes to a pipe.
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat status {};
  InputFile head{path, std::string(kHead, '\0')};
  const ssize_t length =
      descriptor >= 0 && fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode)
          ? pread(descriptor, head.bytes.data(), head.bytes.size(), 0)
          : -1;
  std::optional<RowLayout> rows;
  if (length > 0) {
    head.bytes.resize(static_cast<std::size_t>(length));
    try {
      rows = ply_rows(head, static_cast<std::uint64_t>(status.st_size));
    } catch (const InputError&) {
      rows.reset();
    }
  }
  const double stated = rows ? rows->particle_radius : 0;
  if (!rows || !(stated >= 0) || !std::isfinite(stated)) {
    if (descriptor >= 0) close(descriptor);
    return nullptr;
  }
  if (particle_radius > 0) {
    rows->particle_radius = particle_radius;
    std::erase_if(rows->columns,
                  [](const RowLayout::Column& c) { return c.field == Field::radius; });
  }
  return std::make_unique<RowSource>(path, descriptor, *rows);
}

std::unique_ptr<ParticleSource> open_file(const std::string& path, double particle_radius) {
  if (auto rows = open_rows(path, particle_radius); rows && rows->size() >= kLarge) return rows;
  return std::make_unique<MemorySource>(read_particles(path, particle_radius));
}

std::unique_ptr<ParticleSource> open_particles(const std::string& path, double particle_radius) {
  require(particle_radius >= 0, "open_particles: particle_radius is " + shown(particle_radius) +
                                    ", must be > 0, or 0 for what the file states");
  return open_parts(path, particle_radius, alone());
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
