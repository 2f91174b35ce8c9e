// settle_samples, follow_field, settle_points and draw_splash: samples at random around clouds of
// particles. And the weights of measure_gradients, which make the field that they follow.
#include "verify/stage_cases/settle.hpp"

#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/into_new.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

using reference::Shown;

struct Seen {
  explicit Seen(const std::string& kernel)
      : depth(kernel, "depth"),
        normal(kernel, "normal"),
        kind(kernel, "kind and group"),
        reference(kernel, "reference"),
        behind(kernel, "behind") {}
  Worst depth, normal, kind, reference, behind;
  void add_to(ReferenceErrors& errors) const {
    for (const Worst* worst : {&depth, &normal, &kind, &reference, &behind})
      errors.push_back(worst->error());
  }
};

// One sample against what it should show.
void see(const Layer& before, const Layer& after, std::size_t s, const reference::FieldOnRay& ray,
         const Shown& expected, Seen* seen) {
  if (!expected.sure) return;
  const auto see_kind = [&](bool splash) {
    seen->kind.see(after.group[s], splash ? -1 : before.group[s], 0);
    seen->kind.see(after.kind[s], splash ? static_cast<int>(Kind::splash) : before.kind[s], 0);
  };
  seen->reference.see(after.reference[s],
                      expected.passed ? before.depth[s] + 4 : before.reference[s], 0);
  const bool listed = before.reference[s] < kNoSurface;
  seen->behind.see(after.behind[s],
                   expected.what == Shown::nothing ? before.reference[s]
                   : listed                        ? kNoSurface
                                                   : before.behind[s],
                   0);
  if (expected.what == Shown::nothing) return seen->depth.see(after.depth[s], kNoSurface, 0);
  if (expected.what == Shown::as_before) {
    seen->depth.see(after.depth[s], before.depth[s], 0);
    seen->normal.see(length(after.normal_at(s) - before.normal_at(s)), 0, 0, 1);
    return see_kind(false);
  }
  seen->depth.see(after.depth[s], expected.depth, expected.depth_error);
  if (!(after.depth[s] < kNoSurface)) return;
  Vec3d normal = expected.normal;
  double normal_error = expected.normal_error;
  if (expected.what == Shown::field) {  // the field's own where it was found
    const reference::Crossing there = reference::normal_at(ray, after.depth[s]);
    normal = there.normal;
    normal_error = there.normal_error;
    reference::face_eye(ray.direction, &normal, &normal_error);
  }
  seen->normal.see(length(after.normal_at(s) - normal), 0, normal_error, 1);
  if (expected.kind_sure) see_kind(expected.splash);
}

void see_samples(Device& device, const FieldScene& scene, const Layer& before, bool only_gaps,
                 Seen* seen) {
  const Layer after = settled(device, scene, before, only_gaps);
  for (std::size_t s = 0; s < before.size(); ++s) {
    const reference::FieldOnRay ray = scene.ray(s);
    see(before, after, s, ray,
        reference::settled(ray, before.sample(s), scene.limits(only_gaps), only_gaps), seen);
  }
}

void see_points(Device& device, const FieldScene& scene, Layer before, Seen* seen) {
  const std::size_t n = before.size();
  before.triangle.assign(n, kNoSurface);
  before.behind.assign(n, kNoSurface);
  Layer after = settled_at_points(device, scene, before);
  for (std::size_t s = 0; s < n; ++s) {
    const reference::FieldOnRay ray = scene.ray(s);
    const Shown expected =
        reference::settled(ray, before.sample(s), scene.limits_at_points(), /*only_gaps=*/false);
    // What lies behind is not asked for.
    if (expected.what == Shown::nothing) after.behind[s] = before.reference[s];
    see(before, after, s, ray, expected, seen);
  }
}

// Splash: the first crossing within an extent, in front of the surface.
void see_splash(Device& device, const FieldScene& scene, Seen* seen) {
  const std::size_t n = scene.grid.size();
  Random random(static_cast<unsigned>(n));
  Layer before(n);
  std::vector<float> from(n, kNoSurface), to(n, kNoSurface);
  for (std::size_t s = 0; s < n; ++s) {
    const double start = random(12, 22);
    to[s] = static_cast<float>(start + random(-1, 20));
    if (random(0, 1) < 0.9) from[s] = static_cast<float>(start);
    if (random(0, 1) < 0.5) before.depth[s] = static_cast<float>(start + random(0, 12));
  }
  const SurfaceBuffers surface = upload(device, scene.grid, before);
  const Extent extent{upload(device, from), upload(device, to), any_blocks(device, scene.grid)};
  draw_splash(device, scene.view, list_gaps(device, scene.grid, extent.from, 0).lists,
              scene.levelled, extent, surface, scene.params);
  const Layer after = download(device, before, surface);
  for (std::size_t s = 0; s < n; ++s) {
    const reference::FieldOnRay ray = scene.ray(s);
    const double end = std::min(to[s], before.depth[s]);
    Shown expected;
    if (from[s] < end) {
      const reference::Crossing c =
          reference::first_crossing(ray, from[s], end, scene.params.blob_density);
      expected.sure = c.sure && std::abs(c.depth - end) > c.error;
      if (c.depth < end) expected.what = Shown::field;
      expected.depth = c.depth;
      expected.depth_error = c.error;
      expected.splash = true;
    }
    see(before, after, s, ray, expected, seen);
  }
}

// The difference to .45 adds 2 epsilon to what the density is off, the factor takes it 2.25 times
// and rounds once, smoothstep's slope is at most 1.5 and it rounds six times; the quotient follows
// by at most .45 / level - 1 and rounds six times more. A lone particle's factor follows its share
// of the density, which rounds three times, and rounds three times more.
void see_weights(const Projected& particles, double mass, double level, double lone,
                 const std::vector<double>& weight, Worst* worst) {
  const double own = mass * reference::share(0);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vec3d x = particles.eye(i);
    const double density = mass * reference::density(particles, x);
    const double off = mass * reference::density_error(particles, x, density / mass) +
                       2 * kEpsilon * (density + 0.45);
    const double expected = mass * reference::level_weight(density, own, level, lone);
    const double quotient = (0.45 / level - 1) * (1.5 * 2.25 * off + 8 * kEpsilon) + 6 * kEpsilon;
    const double factor = (lone - 0.3) * own / density * (off / density + 3 * kEpsilon);
    worst->see(weight[i], expected, expected * (quotient * 0.45 / level + factor + 5 * kEpsilon),
               mass);
  }
}

}  // namespace

ReferenceErrors weight_errors(Device& device, int size, const Disorder& disorder) {
  const View view = make_view(perspective_camera(size, size), 0.5, {0, 0, 0});
  const Projected particles = blob_and_lone(view, 0.5 * size, 0.5 * size);
  const Cells cells = make_cells(particles.x, particles.y, particles.z, kDensitySupport);
  const RegionParams params = for_disorder(RegionParams{}, disorder);
  const double lone = lone_factor({}, disorder);
  const DeviceCells levelled =
      level_cells(device, upload_cells(device, cells, disorder.mass()), params, lone);
  const std::vector<double> weight = by_particle(cells, download(device, levelled.weight));
  Worst worst("measure_gradients", "weight");
  see_weights(particles, disorder.mass(), params.blob_density, lone, weight, &worst);
  return {worst.error()};
}

ReferenceErrors settle_case(Device& device, int size) {
  Worst weights("measure_gradients", "weight");
  Seen samples("follow_field"), points("settle_points"), splash("draw_splash");
  for (const bool crowded : {false, true}) {
    if (crowded && size < 30) continue;
    const int width = crowded ? 9 : size;
    const FieldScene scene(device, width, (width * 4 + 6) / 7, crowded);
    const Layer layer = random_layer(scene, static_cast<unsigned>(size));
    see_weights(scene.field.particles, 1, scene.params.blob_density, 1, scene.field.weight,
                &weights);
    see_samples(device, scene, layer, false, &samples);
    see_samples(device, scene, layer, true, &samples);
    see_points(device, scene, layer, &points);
    see_splash(device, scene, &splash);
  }
  ReferenceErrors errors{weights.error()};
  samples.add_to(errors);
  points.add_to(errors);
  splash.add_to(errors);
  return errors;
}

}  // namespace meniscus::verify
