// The one call: checks, canonical order, the pipeline, and the way back to world space.
#include "extract.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "attributes.hpp"
#include "canonical_order.hpp"
#include "crowds.hpp"
#include "device/device.hpp"
#include "exact_math.hpp"
#include "meniscus/device.hpp"
#include "meniscus/meniscus.hpp"
#include "order_statistics.hpp"
#include "origin.hpp"
#include "parallel.hpp"
#include "pipeline.hpp"
#include "printed.hpp"
#include "to_world.hpp"
#include "velocities.hpp"

namespace meniscus {
namespace {

// Half the particles' spacing s, from how many particles a sphere inside the fluid holds: for up to
// 512 particles spread over the canonical order, the sum of 1 - (d/R)^2 over all particles within R
// is 8 pi R^3 / (15 s^3) inside, less at the surface; the 95th percentile is taken as inside. R is
// four times the median distance to the nearest neighbour. (That distance alone says little: it is
// s on a lattice and 0.79 s in a splashing fluid.) Where such spheres hold less than of any fluid
// there are drops and no inside: then s is that median. Particles at one position count once: a
// solver that has failed may leave most of them there.
double estimate_radius(const Particles& p, std::vector<std::size_t> order) {
  const auto copied = [&](std::size_t a, std::size_t b) { return at_one_position(p, a, b); };
  order.erase(std::unique(order.begin(), order.end(), copied), order.end());
  constexpr std::size_t kSamples = 512;
  const std::size_t step = std::max<std::size_t>(1, order.size() / kSamples);
  const auto percentile = [](std::vector<double>& values, double share) {
    const auto place = values.begin() +
                       static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  const auto squared_distance = [&](std::size_t i, std::size_t j) {
    const double dx = double{p.x[j]} - p.x[i], dy = double{p.y[j]} - p.y[i],
                 dz = double{p.z[j]} - p.z[i];
    return dx * dx + dy * dy + dz * dz;
  };
  std::vector<double> nearest;
  for (std::size_t k = 0; k < order.size(); k += step) {
    double best = INFINITY;
    for (const std::size_t j : order) {
      const double squared = squared_distance(order[k], j);
      if (squared > 0) best = std::min(best, squared);
    }
    if (std::isfinite(best)) nearest.push_back(std::sqrt(best));
  }
  if (nearest.empty()) return 0;
  // Of particles strewn without any order, the thinnest fluid, s is 1.8 times that distance.
  constexpr double kThinnest = 2;  // s over the distance
  const double apart = percentile(nearest, 0.5), reach = 4 * apart;
  std::vector<double> held;
  for (std::size_t k = 0; k < order.size(); k += step) {
    double sum = 0;
    for (const std::size_t j : order)
      sum += std::max(0.0, 1 - squared_distance(order[k], j) / (reach * reach));
    held.push_back(sum);
  }
  const double volume = 8 * std::numbers::pi / 15 * reach * reach * reach;
  const double spacing = cube_root(volume / percentile(held, 0.95));
  return 0.5 * (spacing < kThinnest * apart ? spacing : apart);
}

}  // namespace

double choose_radius(const Particles& p, const std::vector<std::size_t>& order,
                     const Parameters& params, std::vector<std::string>& warnings) {
  if (params.particle_radius > 0) return params.particle_radius;
  if (!p.radius.empty() && !order.empty()) {
    std::vector<float> radii;
    for (const std::size_t i : order) radii.push_back(p.radius[i]);
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    if (*middle > 0 && std::isfinite(*middle)) return *middle;
  }
  if (p.particle_radius > 0) return p.particle_radius;
  const double estimate = estimate_radius(p, order);
  if (estimate > 0) {
    warnings.push_back("no particle radius in the file: estimated " + printed("%.6g", estimate) +
                       " from the spacing (give --particle-radius to override)");
    return estimate;
  }
  if (!order.empty())
    warnings.push_back(
        "no particle radius in the file and none can be estimated: 1 is used (give "
        "--particle-radius)");
  return 1;
}

Surface extract(Device& device, const Particles& particles, const Camera& camera,
                const Parameters& params, std::vector<StageTime>* timings) {
  check(camera);
  check(params);
  check(particles);
  if (static_cast<std::int64_t>(particles.size()) >= kStreamed)
    return extract(device, *source_of(particles), camera, params, timings);

  Surface surface;
  surface.camera = camera;
  std::vector<std::size_t> order = canonical_order(particles, params, surface.warnings);
  surface.particle_radius = choose_radius(particles, order, params, surface.warnings);
  order = without_crowds(particles, std::move(order), surface.particle_radius, surface.warnings);

  WorldParticles world;
  std::array<float, 3> low{}, high{};
  const auto gather = [&](const std::vector<float>& values, std::vector<float>& to, std::size_t k) {
    to.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) to[i] = values[order[i]];
    const Bounds bounds = bounds_of(to);
    low[k] = bounds.least;
    high[k] = bounds.most;
  };
  const std::array axes{std::pair{&particles.x, &world.x}, std::pair{&particles.y, &world.y},
                        std::pair{&particles.z, &world.z}};
  parallel_for(axes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) gather(*axes[k].first, *axes[k].second, k);
  });
  if (!particles.radius.empty())
    for (const std::size_t i : order)
      world.scale.push_back(static_cast<float>(particles.radius[i] / surface.particle_radius));
  world.moving = params.motion && !particles.vx.empty();
  if (world.moving) {
    VelocityCheck velocities;
    for (const std::size_t i : order)
      world.velocity.push_back(velocities.checked(
          {particles.vx[i], particles.vy[i], particles.vz[i]}, static_cast<std::int64_t>(i)));
    velocities.report("particles", params, surface.warnings);
  }
  for (const Attribute& attribute : particles.attributes) {
    ValueCheck values;
    Attribute& ordered = world.attributes.emplace_back(Attribute{attribute.name, {}});
    for (const std::size_t i : order)
      ordered.values.push_back(values.checked(attribute.values[i], static_cast<std::int64_t>(i)));
    values.report(attribute.name, params, surface.warnings);
  }
  std::array<double, 3> origin{};
  if (!order.empty()) {
    std::vector<std::array<float, 3>> sample;
    constexpr std::size_t kSample = 1024;
    for (std::size_t i = 0; i < order.size(); i += 1 + order.size() / kSample)
      sample.push_back({world.x[i], world.y[i], world.z[i]});
    origin = origin_of(low, high, sample);
  }
  const View view = make_view(camera, surface.particle_radius, origin);
  const TimedKernels timed(device, timings != nullptr);
  return on_threads(host_threads(device.info()), [&] {
    return to_world(device, view, run_pipeline(device, view, world, params, timings),
                    std::move(surface), params, timings);
  });
}

}  // namespace meniscus
