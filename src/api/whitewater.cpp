// Whitewater over a finished surface: checks, and chunks of particles on their way to the stage.
#include "meniscus/whitewater.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "api/host_threads.hpp"
#include "base/comma_separated.hpp"
#include "base/parallel.hpp"
#include "base/printed.hpp"
#include "base/rounded_up.hpp"
#include "device/stage_clock.hpp"
#include "meniscus/device.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/survey.hpp"
#include "prepare/velocities.hpp"
#include "stages/extras/whitewater.hpp"

namespace meniscus {
namespace {

constexpr std::array kTypes{std::pair{WhitewaterType::foam, "foam"},
                            std::pair{WhitewaterType::spray, "spray"},
                            std::pair{WhitewaterType::bubble, "bubble"}};

constexpr double kShareOfWater = 0.25;  // the radius where nobody states one, of the water's

// Of the water's radius. Larger discs are of another unit, and would cover the image once for each
// particle, which takes hours.
constexpr double kMostOfWater = 16;

constexpr std::size_t kBytesPerParticle = 28;  // position, radius and velocity

std::string name_of(const WhitewaterSource& source) {
  return source.name.empty() ? to_string(source.type) : source.name;
}

void check_surface(const Surface& surface) {
  check(surface.camera);
  const auto pixels = static_cast<std::size_t>(surface.camera.width) *
                      static_cast<std::size_t>(surface.camera.height);
  require(surface.depth.size() == pixels, "draw_whitewater: the surface has " +
                                              std::to_string(surface.depth.size()) +
                                              " depths for " + std::to_string(pixels) +
                                              " pixels (extract with Parameters::image set)");
  require(surface.layers.most == 0 || surface.layers.exit.size() >= pixels,
          "draw_whitewater: the layers' depths do not fit the camera");
  require(surface.particle_radius > 0 && std::isfinite(surface.particle_radius),
          printed("draw_whitewater: the surface's particle radius is %g, must be > 0 and finite",
                  surface.particle_radius));
}

// Around which the coordinates are taken: near what is seen, so that floats have all their digits
// there. The point on the camera's axis in the middle of the surface's depths.
std::array<double, 3> origin_near(const Surface& surface) {
  float low = kNoSurface, high = 0;
  for (const float depth : surface.depth)
    if (depth < kNoSurface) {
      low = std::min(low, depth);
      high = std::max(high, depth);
    }
  const double middle = low < kNoSurface ? 0.5 * (double{low} + double{high}) : 0;
  const View view = make_view(surface.camera, 1, {});
  const Vec3d at = world_from_eye(view, {0, 0, -middle});
  // Exact in float, as kernels have it.
  return {static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z)};
}

// Which attribute tells the particles of this type from others; none: all are.
std::optional<std::size_t> place_of_attribute(const WhitewaterSource& source) {
  if (source.attribute.empty()) return std::nullopt;
  const std::vector<std::string> names = source.particles->attributes();
  const auto found = std::find(names.begin(), names.end(), source.attribute);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  throw InputError("has no attribute " + source.attribute + " of its particles" +
                   (names.empty() ? std::string() : ", but " + comma_separated(names)));
}

// One type's particles on their way to the device, a chunk at a time.
class Drawing {
 public:
  Drawing(Device& device, const View& view, const WhitewaterSource& source,
          const Parameters& params, std::size_t chunk)
      : device_(device),
        view_(view),
        source_(source),
        params_(params),
        place_(place_of_attribute(source)),
        own_radius_(source.particles->has_radius() && !(params.whitewater.radius > 0)),
        moves_(source.particles->has_velocity() && params.motion),
        buffers_{allocate<float>(device, chunk),
                 allocate<float>(device, chunk),
                 allocate<float>(device, chunk),
                 allocate<float>(device, chunk),
                 {},
                 {},
                 {}} {
    for (Buffer<float>* velocity : {&buffers_.vx, &buffers_.vy, &buffers_.vz})
      *velocity = moves_ ? allocate<float>(device, chunk) : buffers_.x;  // of which nobody asks
    const double stated = source.particles->particle_radius();
    radius_ = static_cast<float>(params.whitewater.radius > 0 ? params.whitewater.radius
                                 : stated > 0                 ? stated
                                                              : kShareOfWater * view.radius);
  }

  bool moves() const { return moves_; }
  ChunkValues wanted() const {
    return {.radius = own_radius_, .velocity = moves_, .attributes = place_.has_value()};
  }
  std::int64_t drawn() const { return drawn_; }

  // What the kernel may not see is put right here: who is of another type has no radius, and who
  // has no velocity stands still.
  void draw(ParticleChunk& chunk, const ShownDepths& shown, const WhitewaterSums& sums) {
    if (!own_radius_) chunk.radius.assign(chunk.stride(), radius_);
    for (std::size_t i = 0; i < chunk.count; ++i) look_at_particle(chunk, i);
    const std::size_t bytes = chunk.count * sizeof(float);
    const auto put = [&](const std::vector<float>& values, const Buffer<float>& to) {
      device_.state().write_bytes(to.memory, values.data(), bytes);
    };
    put(chunk.x, buffers_.x);
    put(chunk.y, buffers_.y);
    put(chunk.z, buffers_.z);
    put(chunk.radius, buffers_.radius);
    if (moves_) {
      put(chunk.vx, buffers_.vx);
      put(chunk.vy, buffers_.vy);
      put(chunk.vz, buffers_.vz);
    }
    meniscus::draw_whitewater(device_, view_, buffers_, chunk.count, shown, sums);
  }

  void report(std::vector<Notice>& notices) const {
    Notices own;
    if (bad_ > 0) {
      Notice notice = not_finite(bad_, bad_ + drawn_, first_bad_);
      notice.text += params_.strict ? "; leave " + setting("strict") + " away to drop them"
                                    : " and were dropped";
      if (params_.strict) throw InputError(notice);
      own.add(std::move(notice));
    }
    velocities_.report("particles", params_, own);
    for (Notice notice : own.all()) {
      notice.text = name_of(source_) + ": " + notice.text;
      notices.push_back(std::move(notice));
      device_.state().tell(notices.back());
    }
  }

 private:
  void look_at_particle(ParticleChunk& chunk, std::size_t i) {
    const std::int64_t place = chunk.first + static_cast<std::int64_t>(i);
    float& radius = chunk.radius[i];
    if (place_ && !(chunk.attributes[*place_][i] == source_.value)) {
      radius = 0;
      return;
    }
    if (!(radius > 0) || !std::isfinite(radius))
      throw InputError(Notice{.code = Code::bad_radius,
                              .text = source_.particles->name(place) +
                                      printed(": radius is %g, must be > 0 and finite (give ",
                                              static_cast<double>(radius)) +
                                      setting("whitewater-radius") + " to override)",
                              .place = place,
                              .found = radius});
    if (radius > kMostOfWater * view_.radius)
      throw InputError(
          Notice{.code = Code::bad_radius,
                 .text = source_.particles->name(place) +
                         printed(": radius is %g, must be at most %g times the water's, %g (in "
                                 "another unit? ",
                                 static_cast<double>(radius), kMostOfWater, view_.radius) +
                         setting("whitewater-radius") + " sets it)",
                 .place = place,
                 .found = radius,
                 .wanted = kMostOfWater * view_.radius});
    if (!std::isfinite(chunk.x[i]) || !std::isfinite(chunk.y[i]) || !std::isfinite(chunk.z[i])) {
      if (bad_++ == 0) first_bad_ = place;
      radius = 0;
      return;
    }
    ++drawn_;
    if (moves_ && !is_known(velocities_.checked({chunk.vx[i], chunk.vy[i], chunk.vz[i]}, place)))
      chunk.vx[i] = chunk.vy[i] = chunk.vz[i] = 0;
  }

  Device& device_;
  const View& view_;
  const WhitewaterSource& source_;
  const Parameters& params_;
  std::optional<std::size_t> place_;
  bool own_radius_, moves_;
  WhitewaterParticles buffers_;
  float radius_ = 0;  // where particles have none of their own
  std::int64_t drawn_ = 0, bad_ = 0, first_bad_ = -1;
  VelocityCheck velocities_;
};

WhitewaterMaps draw_type(Device& device, const View& view, const WhitewaterSource& source,
                         const Parameters& params, std::size_t memory, Surface& surface) {
  const bool bubbles = source.type == WhitewaterType::bubble;
  std::vector<float> exit;  // of the first body
  if (surface.layers.most > 0)
    exit.assign(surface.layers.exit.begin(),
                surface.layers.exit.begin() + static_cast<std::ptrdiff_t>(surface.depth.size()));
  const std::size_t chunk =
      std::min(chunk_within(memory, kBytesPerParticle),
               std::max<std::size_t>(
                   64, rounded_up(static_cast<std::size_t>(source.particles->size()), 64)));
  Drawing drawing(device, view, source, params, chunk);
  const WhitewaterSums sums = no_whitewater(device, view, drawing.moves(), bubbles);
  const ShownDepths shown =
      shown_depths(device, view, source.type, surface.depth, exit, params.whitewater.tolerance);
  for_each_chunk(*source.particles, chunk, drawing.wanted(),
                 [&](ParticleChunk& now) { drawing.draw(now, shown, sums); });
  drawing.report(surface.notices);
  surface.counts.whitewater =
      std::max<std::int64_t>(0, surface.counts.whitewater) + drawing.drawn();
  return finish_whitewater(device, view, source.type, sums);
}

}  // namespace

std::string to_string(WhitewaterType type) {
  for (const auto& [known, name] : kTypes)
    if (known == type) return name;
  return "unknown";
}

WhitewaterType whitewater_named(const std::string& name) {
  for (const auto& [type, known] : kTypes)
    if (known == name) return type;
  throw InvalidArgument("whitewater: type is " + name + ", must be foam, spray or bubble");
}

void draw_whitewater(Device& device, const std::vector<WhitewaterSource>& sources,
                     const Parameters& parameters, Surface& surface,
                     std::vector<StageTime>* timings, std::size_t memory) {
  check(parameters);
  check_surface(surface);
  std::vector<const WhitewaterSource*> ordered;
  for (const auto& [type, name] : kTypes)
    for (const WhitewaterSource& source : sources) {
      if (source.type != type) continue;
      require(source.particles != nullptr,
              std::string("draw_whitewater: ") + name + " has no particles");
      require(ordered.empty() || ordered.back()->type != type,
              std::string("draw_whitewater: ") + name + " is given twice");
      ordered.push_back(&source);
    }
  require(ordered.size() == sources.size(), "draw_whitewater: a source has an unknown type");
  const TimedKernels timed(device, timings != nullptr);
  StageClock clock(device, timings);
  device.state().told.clear();
  surface.whitewater.clear();
  surface.counts.whitewater = -1;
  const View view = make_view(surface.camera, surface.particle_radius, origin_near(surface));
  on_threads(host_threads(device.info()), [&] {
    for (const WhitewaterSource* source : ordered) {
      clock.start("whitewater");
      try {
        surface.whitewater.push_back(draw_type(device, view, *source, parameters, memory, surface));
      } catch (const InputError& error) {
        Notice notice = error.notice;
        notice.text = name_of(*source) + ": " + notice.text;
        throw InputError(notice);
      }
      clock.stop();
    }
  });
}

}  // namespace meniscus
