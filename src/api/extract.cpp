// The one call: checks, canonical order, the pipeline, and the way back to world space.
#include "api/extract.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/pipeline.hpp"
#include "base/order_statistics.hpp"
#include "base/parallel.hpp"
#include "base/printed.hpp"
#include "device/device.hpp"
#include "meniscus/device.hpp"
#include "meniscus/meniscus.hpp"
#include "output/to_world.hpp"
#include "prepare/attributes.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/crowds.hpp"
#include "prepare/origin.hpp"
#include "prepare/radius_estimate.hpp"
#include "prepare/velocities.hpp"

namespace meniscus {
double choose_radius(const BorrowedParticles& p, const std::vector<std::size_t>& order,
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
  const RadiusEstimate estimate = estimate_radius(p, order);
  if (estimate.radius > 0) {
    constexpr double kSure = 1.1;  // the most over the least
    const std::string range =
        estimate.most > kSure * estimate.least
            ? printed(", which is uncertain, since the fluid is thin or loose: %.3g to %.3g",
                      estimate.least, estimate.most)
            : printed(", to within %.0f %%",
                      std::max(5.0, 50 * (estimate.most / estimate.least - 1)));
    warnings.push_back("no particle radius in the file: estimated " +
                       printed("%.6g", estimate.radius) + " from the spacing" + range +
                       " (give --particle-radius to override)");
    return estimate.radius;
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
  return extract(device, BorrowedParticles(particles), camera, params, timings);
}

Surface extract(Device& device, const BorrowedParticles& particles, const Camera& camera,
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
  const auto gather = [&](const Column& values, std::vector<float>& to, std::size_t k) {
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
  for (const BorrowedAttribute& attribute : particles.attributes) {
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
