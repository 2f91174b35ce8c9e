// The one call: checks, canonical order, the pipeline, and the way back to world space.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "meniscus/device.hpp"
#include "meniscus/meniscus.hpp"
#include "pipeline.hpp"

namespace meniscus {
namespace {

// Indices of the particles with finite coordinates, in an order that depends on the set alone: by
// position, then by own radius. Particles that agree in all of them are interchangeable.
std::vector<std::size_t> canonical_order(const Particles& p, const Parameters& params,
                                         std::vector<std::string>& warnings) {
  std::vector<std::size_t> order;
  order.reserve(p.size());
  std::size_t first_bad = p.size();
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (std::isfinite(p.x[i]) && std::isfinite(p.y[i]) && std::isfinite(p.z[i]))
      order.push_back(i);
    else
      first_bad = std::min(first_bad, i);
  }
  const std::size_t bad = p.size() - order.size();
  if (bad > 0) {
    const std::string what = std::to_string(bad) + " of " + std::to_string(p.size()) +
                             " particles have NaN or infinite coordinates (the first is particle " +
                             std::to_string(first_bad) + ")";
    if (params.strict) throw InputError(what + "; leave --strict away to drop them");
    warnings.push_back(what + " and were dropped");
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (p.x[a] != p.x[b]) return p.x[a] < p.x[b];
    if (p.y[a] != p.y[b]) return p.y[a] < p.y[b];
    if (p.z[a] != p.z[b]) return p.z[a] < p.z[b];
    return !p.radius.empty() && p.radius[a] < p.radius[b];
  });
  return order;
}

// Half the particles' spacing s, from how many particles a sphere inside the fluid holds: for up to
// 512 particles spread over the canonical order, the sum of 1 - (d/R)^2 over all particles within R
// is 8 pi R^3 / (15 s^3) inside, less at the surface; the 95th percentile is taken as inside. R is
// four times the median distance to the nearest neighbour. (That distance alone says little: it is
// s on a lattice and 0.79 s in a splashing fluid.)
double estimate_radius(const Particles& p, const std::vector<std::size_t>& order) {
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
  const double reach = 4 * percentile(nearest, 0.5);
  std::vector<double> held;
  for (std::size_t k = 0; k < order.size(); k += step) {
    double sum = 0;
    for (const std::size_t j : order)
      sum += std::max(0.0, 1 - squared_distance(order[k], j) / (reach * reach));
    held.push_back(sum);
  }
  const double volume = 8 * std::numbers::pi / 15 * reach * reach * reach;
  return 0.5 * std::cbrt(volume / percentile(held, 0.95));
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

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
    warnings.push_back("no particle radius in the file: estimated " + number(estimate) +
                       " from the spacing (give --particle-radius to override)");
    return estimate;
  }
  if (!order.empty())
    warnings.push_back(
        "no particle radius in the file and none can be estimated: 1 is used (give "
        "--particle-radius)");
  return 1;
}

}  // namespace

Surface extract(Device& device, const Particles& particles, const Camera& camera,
                const Parameters& params, std::vector<StageTime>* timings) {
  check(camera);
  check(params);
  const std::size_t n = particles.size();
  require(particles.y.size() == n && particles.z.size() == n,
          "particles: x, y and z have different sizes");
  require(particles.radius.empty() || particles.radius.size() == n,
          "particles: radius has " + std::to_string(particles.radius.size()) + " values for " +
              std::to_string(n) + " particles");
  require(n < (std::size_t{1} << 31), "particles: more than 2^31 - 1 in one call");

  Surface surface;
  surface.camera = camera;
  const std::vector<std::size_t> order = canonical_order(particles, params, surface.warnings);
  surface.particle_radius = choose_radius(particles, order, params, surface.warnings);

  WorldParticles world;
  std::array<double, 3> low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
  for (const std::size_t i : order) {
    const std::array<float, 3> x{particles.x[i], particles.y[i], particles.z[i]};
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], static_cast<double>(x[k]));
      high[k] = std::max(high[k], static_cast<double>(x[k]));
    }
    world.x.push_back(x[0]);
    world.y.push_back(x[1]);
    world.z.push_back(x[2]);
    if (!particles.radius.empty())
      world.scale.push_back(static_cast<float>(particles.radius[i] / surface.particle_radius));
  }
  // The origin that is subtracted first: the middle of the particles, exact in float.
  std::array<double, 3> origin{};
  if (!order.empty())
    for (std::size_t k = 0; k < 3; ++k) origin[k] = static_cast<float>((low[k] + high[k]) / 2);
  const View view = make_view(camera, surface.particle_radius, origin);

  const Extraction extraction = run_pipeline(device, view, world, params, timings);

  const SurfaceMap& image = extraction.image;
  const std::size_t pixels = image.depth.size();
  surface.depth.assign(pixels, kNoSurface);
  surface.normal.resize(pixels);
  surface.position.resize(pixels);
  surface.group.assign(pixels, 0);
  surface.kind = image.kind;
  surface.residual.assign(pixels, 0.0f);
  std::int64_t covered = 0;
  for (std::size_t s = 0; s < pixels; ++s) {
    if (!(image.depth[s] < kNoSurface)) continue;
    ++covered;
    const double u = static_cast<double>(s % image.grid.nx) + 0.5;
    const double v = static_cast<double>(s / image.grid.nx) + 0.5;
    surface.depth[s] = static_cast<float>(image.depth[s] * view.radius);
    surface.position[s] =
        static_cast<Vec3>(world_from_eye(view, point_at(view, u, v, image.depth[s])));
    surface.normal[s] = static_cast<Vec3>(world_direction(view, Vec3d(image.normal[s])));
    const std::int32_t g = image.group[s];
    if (g < 0) continue;
    surface.group[s] = static_cast<std::uint32_t>(g) + 1;
    surface.residual[s] = std::max(0.0f, extraction.residual[g]);
  }
  surface.mesh = extraction.mesh;
  surface.counts = extraction.counts;
  if (params.image) surface.counts.emplace_back("pixels", covered);
  for (const auto& [name, count] : surface.counts)
    if (name == "in view" && count == 0)
      surface.warnings.push_back(n == 0 ? "there are no particles: the surface is empty"
                                        : "no particle is in view: the surface is empty");
  return surface;
}

}  // namespace meniscus
