// What samples show, against plain loops in double precision, on every device.
#include "verify/reference/settle.hpp"

#include <algorithm>
#include <bit>

#include "device/kernels.hpp"
#include "stages/settle.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

constexpr int kWidth = 37, kHeight = 21;
constexpr float kStart = 5, kEnd = 40;  // all particles lie between these depths
const RegionParams kParams;

// Sixty particles two radii apart, moved by up to 0.3, and a lone one beside them.
Projected blob_and_lone(const View& view) {
  Random random(11);
  Projected p;
  const auto add = [&](const Vec3d& at) {
    p.x.push_back(static_cast<float>(at.x));
    p.y.push_back(static_cast<float>(at.y));
    p.z.push_back(static_cast<float>(at.z));
  };
  const Vec3d corner = point_at(view, 10.5, 6.5, 21) - Vec3d{3, 4, 0};
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 4; ++i)
        add(corner + Vec3d{2 * i + random(-0.3, 0.3), 2 * j + random(-0.3, 0.3),
                           -2 * k + random(-0.3, 0.3)});
  add(point_at(view, 28.3, 8.2, 18));
  return p;
}

// Bound of the rounding of a point of a ray in float: coefficients, two products and two sums each
// for origin and direction, then a product and a sum.
double ray_rounding(const View& view, double u, double v, double t) {
  double sum = 0;
  for (int axis = 0; axis < 2; ++axis) {
    const double* o = &view.ray[3 * axis];
    const double* d = &view.ray[6 + 3 * axis];
    sum += std::abs(o[0]) + std::abs(o[1] * u) + std::abs(o[2] * v) +
           t * (std::abs(d[0]) + std::abs(d[1] * u) + std::abs(d[2] * v));
  }
  return 7 * kEpsilon * sum;
}

class Settle : public OnDevice {
 protected:
  void SetUp() override {
    host_cells_ =
        make_cells(field_.particles.x, field_.particles.y, field_.particles.z, kDensitySupport);
    cells_ = upload_cells(device_, host_cells_);
    levelled_ = level_cells(device_, cells_, measure_gradients(device_, cells_), kParams);
    // The weights are checked by a test of their own; the others start from the device's.
    const auto weight = download(device_, levelled_.weight);
    field_.weight.resize(weight.size());
    for (std::size_t k = 0; k < weight.size(); ++k) field_.weight[host_cells_.item[k]] = weight[k];
  }

  Vec3d at(std::size_t s, double t) const { return point_at(view_, u(s), v(s), t); }
  double u(std::size_t s) const { return grid_.first + static_cast<double>(s % kWidth); }
  double v(std::size_t s) const { return grid_.first + static_cast<double>(s / kWidth); }
  double speed(std::size_t s) const { return length(ray_direction(view_, u(s), v(s))); }

  double in_reach(const Vec3d& x) const {
    double near = 0;
    for (std::size_t i = 0; i < field_.particles.size(); ++i)
      near += length(x - field_.particles.eye(i)) < 4.001;
    return near;
  }

  // Rounding of the field at depth t: that of density_test.cpp with one more for the weight, and
  // the point's, which each share passes on by its slope, 1 / (2 pi) at most.
  double field_rounding(std::size_t s, double t) const {
    const double near = in_reach(at(s, t)), moved = ray_rounding(view_, u(s), v(s), t);
    return kEpsilon * (17 / std::numbers::pi * near + (near + 2) * field_(at(s, t))) +
           near * moved / (2 * std::numbers::pi);
  }

  // The march's step in radii at depth t: 1, 0.6 and 0.3 below 0.1, 0.35 and 1 level.
  double march_step(std::size_t s, double t) const {
    // A thousandth of the level for thresholds that rounding decides.
    const double c = field_(at(s, t)) / kParams.blob_density - 1e-3;
    return c < 0.1 ? 1 : c < 0.35 ? 0.6 : 0.3;
  }

  // Whether the march may step over a chord: it cannot where no step from before ends behind it.
  bool may_be_missed(std::size_t s, const reference::Chord& chord) const {
    const double width = (chord.leave - chord.enter) * speed(s);
    for (double back = 0; back <= 1; back += 1.0 / 256)
      // One sample of this search more, which the march may start between.
      if (march_step(s, chord.enter - back / speed(s)) - back + 1.0 / 256 > width) return true;
    return false;
  }

  // How far a crossing may be off, in depth: the 1/1024 radii along the ray that the kernel
  // promises; the field's rounding moves the crossing on top.
  double depth_tolerance(std::size_t s, double t) const {
    const double slope = -dot(field_.gradient(at(s, t)), ray_direction(view_, u(s), v(s)));
    return 1.0 / 1024 / speed(s) + 2 * field_rounding(s, t) / std::abs(slope) + 2 * kEpsilon * t;
  }

  // The steepest the field gets on the way between two depths, per depth.
  double steepest(std::size_t s, double a, double b) const {
    double most = 0;
    for (int k = 0; k <= 16; ++k)
      most = std::max(most, std::abs(dot(field_.gradient(at(s, a + (b - a) * k / 16)),
                                         ray_direction(view_, u(s), v(s)))));
    return most;
  }

  void expect_on_level(std::size_t s, double t) const {
    const double span = depth_tolerance(s, t);
    EXPECT_NEAR(field_(at(s, t)), kParams.blob_density,
                span * steepest(s, t - span, t + span) + 2 * field_rounding(s, t))
        << "sample " << s;
  }

  // The gradient's terms round eight times and are at most 1 / (2 pi) each; the field bends by
  // 3 / (4 pi) at most for each particle.
  void expect_outward(std::size_t s, double t, const Vec3d& normal) const {
    const Vec3d g = field_.gradient(at(s, t));
    const double near = in_reach(at(s, t));
    const double off = near * ((near + 8) * kEpsilon / (2 * std::numbers::pi) +
                               0.75 / std::numbers::pi * (ray_rounding(view_, u(s), v(s), t)));
    EXPECT_NEAR(length(normal - normalized(-g)), 0, 2 * off / length(g) + 4 * kEpsilon);
    EXPECT_NEAR(length(normal), 1, 4 * kEpsilon);
  }

  // For make_layer.
  auto depth_of() const {
    return [this](std::size_t s, double density) {
      double low = kStart, high = sure_crossing(s);
      for (int k = 0; k < 40; ++k) {
        const double middle = (low + high) / 2;
        (reference::density(field_.particles, at(s, middle)) < density ? low : high) = middle;
      }
      return high;
    };
  }

  // The first crossing from kStart; nowhere too where the march may pass over a chord of the ray.
  double sure_crossing(std::size_t s) const {
    const auto all =
        reference::chords(field_, view_, u(s), v(s), kStart, kEnd, kParams.blob_density);
    if (all.empty() || may_be_missed(s, all[0])) return reference::kNowhere;
    return all[0].enter;
  }

  const View view_ = make_view(perspective_camera(kWidth, kHeight), 0.5, {0, 0, 0});
  const SampleGrid grid_ = pixel_grid(view_);
  const std::size_t n_ = grid_.size();
  reference::Field field_{blob_and_lone(view_), {}};
  Cells host_cells_;
  DeviceCells cells_, levelled_;
};

TEST_P(Settle, LevelWeightsMatchTheReference) {
  std::size_t between = 0;
  for (std::size_t i = 0; i < field_.particles.size(); ++i) {
    const Vec3d x = field_.particles.eye(i);
    const double density = reference::density(field_.particles, x), near = in_reach(x);
    const double expected = reference::level_weight(density, kParams.blob_density);
    between += expected < 0.99 && expected > 0.52;
    // density_test.cpp bounds the density's error. The difference to 0.35 adds 2 epsilon, the
    // quotient doubles it, smoothstep's slope is at most 1.5 and it rounds six times; the weight
    // follows by at most 0.45 / level - 1 and rounds six times more.
    const double off =
        kEpsilon * (16 / std::numbers::pi * near + (near + 2) * density + 2 * (density + 0.35));
    const double smooth = 1.5 * 2 * off + 6 * kEpsilon;
    EXPECT_NEAR(field_.weight[i], expected,
                (0.45 / kParams.blob_density - 1) * smooth + 6 * kEpsilon);
  }
  EXPECT_GT(between, 10u);
  EXPECT_EQ(field_.weight.back(), 1) << "the lone particle";
}

TEST_P(Settle, SplashIsTheFirstCrossingInFrontOfTheSurface) {
  std::vector<float> from(n_, kStart), to(n_, kEnd), depth(n_, kNoSurface);
  std::vector<double> crossing(n_);
  for (std::size_t s = 0; s < n_; ++s) {
    crossing[s] = sure_crossing(s);
    if (s % 5 == 1) from[s] = kNoSurface;
    if (s % 5 == 2 && crossing[s] < kEnd) depth[s] = static_cast<float>(crossing[s] + 1);
    if (s % 5 == 3 && crossing[s] < kEnd) depth[s] = static_cast<float>(crossing[s] - 0.5);
    if (s % 5 == 4 && crossing[s] < kEnd) to[s] = static_cast<float>(crossing[s] - 0.5);
  }
  SurfaceBuffers surface = empty_surface(device_, grid_);
  surface.depth = upload(device_, depth);
  const Extent extent{upload(device_, from), upload(device_, to), any_blocks(device_, grid_)};
  draw_splash(device_, view_, list_samples(device_, grid_, extent.from), levelled_, extent, surface,
              kParams);
  const SurfaceMap map = download(device_, surface);
  std::size_t drawn = 0;
  for (std::size_t s = 0; s < n_; ++s) {
    SCOPED_TRACE("sample " + std::to_string(s));
    const bool shown = map.depth[s] < kNoSurface && map.depth[s] != depth[s];
    if (shown) {
      EXPECT_EQ(map.kind[s], Kind::splash);
      EXPECT_EQ(map.group[s], -1);
      expect_on_level(s, map.depth[s]);
      expect_outward(s, map.depth[s], Vec3d(map.normal[s]));
    }
    if (s % 5 == 1) {
      EXPECT_EQ(map.depth[s], kNoSurface);
    } else if (crossing[s] < kEnd && s % 5 >= 3) {
      EXPECT_EQ(map.depth[s], depth[s]) << "the surface, or the end, lies in front";
    } else if (crossing[s] < kEnd) {
      ++drawn;
      EXPECT_NEAR(map.depth[s], crossing[s], depth_tolerance(s, crossing[s]));
    } else if (reference::chords(field_, view_, u(s), v(s), kStart, kEnd,
                                 kParams.blob_density - 1e-4)
                   .empty()) {
      EXPECT_EQ(map.depth[s], kNoSurface);
    }
  }
  EXPECT_GT(drawn, 40u);
}

// The samples of a layer before the kernel and after it.
struct Layer {
  explicit Layer(std::size_t n)
      : triangle(n, kNoSurface),
        reference(n, kNoSurface),
        trust(n),
        depth(n, kNoSurface),
        normal(3 * n),
        behind(n),
        group(n, 7),
        kind(n, static_cast<cl_uchar>(Kind::surface)) {}
  std::vector<float> triangle, reference, trust, depth, normal, behind;
  std::vector<cl_int> group;
  std::vector<cl_uchar> kind;
  Vec3d normal_at(std::size_t s) const {
    const std::size_t n = depth.size();
    return {normal[s], normal[n + s], normal[2 * n + s]};
  }
  bool same_sample(const Layer& other, std::size_t s) const {
    return std::bit_cast<std::uint32_t>(depth[s]) == std::bit_cast<std::uint32_t>(other.depth[s]) &&
           normal_at(s) == other.normal_at(s) && group[s] == other.group[s] &&
           kind[s] == other.kind[s];
  }
};

SurfaceBuffers upload(Device& device, const SampleGrid& grid, const Layer& layer) {
  return {grid,
          upload(device, layer.depth),
          upload(device, layer.normal),
          upload(device, layer.group),
          upload(device, layer.trust),
          upload(device, layer.kind)};
}

Layer download(Device& device, const Layer& before, const SurfaceBuffers& surface) {
  Layer after = before;
  after.depth = download(device, surface.depth);
  after.normal = download(device, surface.normal);
  after.group = download(device, surface.group);
  after.kind = download(device, surface.kind);
  return after;
}

Layer settled(Device& device, const View& view, const DeviceCells& cells,
              const DeviceCells& levelled, const SampleGrid& grid, const Layer& before,
              bool only_gaps) {
  const SurfaceBuffers surface = upload(device, grid, before);
  const auto reference = upload(device, before.reference);
  const auto behind = filled<float>(device, grid.size(), kNoSurface);
  settle_samples(device, view, list_samples(device, grid, reference), cells, levelled,
                 upload(device, before.triangle), reference, surface, behind, kParams, only_gaps);
  Layer after = download(device, before, surface);
  after.behind = download(device, behind);
  return after;
}

enum Case : std::size_t {
  on_triangle,
  in_fluid,
  outside,
  untrusted,
  mostly_trusted,
  little_trusted,
  apart,
  too_far_apart,
  unmet,
  unmet_far,
  no_reference,
  shallow,
  shallow_on_edge,
  outside_on_edge,
  little_trusted_on_edge,
  beyond_edge,
  beyond_edge_on_triangle,
  cases
};

// What the blend adds to the trust (blend.cl).
constexpr double kOnEdge = 2, kEnded = 4;

// Where a ray meets the field, every case in turn; elsewhere samples with no particle near.
// depth_of(s, density) is the depth before the crossing at which the density is so much.
template <class DepthOf>
Layer make_layer(const std::vector<double>& crossing, DepthOf&& depth_of) {
  const std::size_t n = crossing.size();
  Layer layer(n);
  std::size_t next = 0;
  for (std::size_t s = 0; s < n; ++s) {
    const double c = crossing[s];
    layer.normal[2 * n + s] = 1;
    if (!(c < kEnd)) continue;
    const auto set = [&](double trust, double t) {
      layer.trust[s] = static_cast<float>(trust);
      layer.depth[s] = static_cast<float>(t);
      layer.reference[s] = static_cast<float>(c - 0.25);
    };
    switch (next++ % cases) {
      case on_triangle:
        set(1, c - 2.5);
        layer.triangle[s] = static_cast<float>(c - 0.5);
        break;
      case in_fluid:
        set(1, c + 0.25);
        break;
      case outside:
        set(1, c - 2.5);
        break;
      case untrusted:
        set(0, c + 0.25);
        break;
      case mostly_trusted:
        set(0.9375, c + 0.25);
        break;
      case little_trusted:
        set(0.375, c + 0.25);
        break;
      case apart:
        set(0.75, c + 0.75);
        break;
      case too_far_apart:
        set(0.25, c + 1.25);
        break;
      case unmet:
        set(0, kNoSurface);
        break;
      case unmet_far:
        set(0, kNoSurface);
        layer.reference[s] = static_cast<float>(c - 6.5);
        break;
      case no_reference:
        set(0, c);
        layer.reference[s] = kNoSurface;
        break;
      case shallow:
        set(1, depth_of(s, 0.5 * kParams.contour_density));
        break;
      case shallow_on_edge:
        set(kOnEdge + 1, depth_of(s, 0.5 * kParams.contour_density));
        break;
      case outside_on_edge:
        set(kOnEdge + 1, depth_of(s, 0.2 * kParams.contour_density));
        break;
      case little_trusted_on_edge:
        set(kOnEdge + 0.875, depth_of(s, 0.8 * kParams.contour_density));
        break;
      case beyond_edge:
        set(kEnded + 1, c + 0.25);
        break;
      case beyond_edge_on_triangle:
        set(kEnded + 1, c + 0.25);
        layer.triangle[s] = static_cast<float>(c - 0.5);
        break;
    }
  }
  return layer;
}

TEST_P(Settle, SamplesShowTheBlendTheFieldOrTheirMixture) {
  std::vector<double> crossing(n_);
  for (std::size_t s = 0; s < n_; ++s) crossing[s] = sure_crossing(s);
  const Layer before = make_layer(crossing, depth_of());
  const Layer after = settled(device_, view_, cells_, levelled_, grid_, before, false);
  const Layer filled = settled(device_, view_, cells_, levelled_, grid_, before, true);
  std::size_t next = 0;
  for (std::size_t s = 0; s < n_; ++s) {
    SCOPED_TRACE("sample " + std::to_string(s) + " case " + std::to_string(next % cases));
    const double c = crossing[s], t = before.depth[s];
    const auto expect_field = [&](const Layer& layer) {
      EXPECT_NEAR(layer.depth[s], c, depth_tolerance(s, c));
      expect_on_level(s, layer.depth[s]);
      expect_outward(s, layer.depth[s], layer.normal_at(s));
      EXPECT_EQ(layer.group[s], -1);
      EXPECT_EQ(layer.kind[s], static_cast<cl_uchar>(Kind::splash));
      EXPECT_EQ(layer.behind[s], kNoSurface);
    };
    if (t < kNoSurface || !(before.reference[s] < kNoSurface)) {
      EXPECT_TRUE(filled.same_sample(before, s)) << "not a gap";
      EXPECT_EQ(filled.behind[s], kNoSurface);
    } else {
      expect_field(filled);
    }
    if (!(c < kEnd)) continue;
    const std::size_t which = next++ % cases;
    if (which == on_triangle || which == in_fluid || which == no_reference ||
        which == shallow_on_edge || which == beyond_edge_on_triangle) {
      EXPECT_TRUE(after.same_sample(before, s));
      EXPECT_EQ(after.behind[s], kNoSurface);
    } else if (which == outside || which == unmet_far || which == shallow ||
               which == outside_on_edge || which == beyond_edge) {
      EXPECT_EQ(after.depth[s], kNoSurface);
      EXPECT_EQ(after.behind[s], before.reference[s]);
    } else if (which == untrusted || which == unmet || which == too_far_apart) {
      expect_field(after);
    } else {
      const double density = reference::density(field_.particles, at(s, t));
      const bool on_edge = which == little_trusted_on_edge;
      const Vec3d g = field_.gradient(at(s, c)), blended = before.normal_at(s);
      const double facing = std::abs(dot(blended, ray_direction(view_, u(s), v(s))));
      const double agreement =
          on_edge ? 1
                  : reference::agreement(std::abs(c - t) * facing, dot(blended, normalized(-g)));
      const double share =
          agreement * reference::blend_share(before.trust[s] - (on_edge ? kOnEdge : 0), false,
                                             on_edge, density, kParams.contour_density);
      // The field's normal turns by its bend, 3 / (4 pi) at most a particle, over its slope on the
      // way that the crossing is off.
      const double off = depth_tolerance(s, c);
      const double moved = off * speed(s) + ray_rounding(view_, u(s), v(s), c);
      const double turned = 2 * in_reach(at(s, c)) * 0.75 / std::numbers::pi * moved / length(g);
      // The crossing's error counts by the rest, and once more through the agreement, whose slopes
      // are at most 3 a radius and 4.7. The contour's ramp passes on 20 of the density's rounding.
      const double share_off = (on_edge ? 0 : 3 * off * facing + 4.7 * turned) +
                               20 * field_rounding(s, t) + 8 * kEpsilon;
      EXPECT_NEAR(after.depth[s], share * t + (1 - share) * c,
                  (1 - share) * off + share_off * std::abs(c - t) + 4 * kEpsilon * t);
      EXPECT_EQ(after.behind[s], kNoSurface);
      // The share's error counts by the normals' difference.
      const Vec3d mixed = share * blended + (1 - share) * normalized(-g);
      EXPECT_NEAR(length(after.normal_at(s) - normalized(mixed)), 0,
                  2 * ((1 - share) * turned + 2 * share_off) / length(mixed) + 8 * kEpsilon);
      EXPECT_NEAR(length(after.normal_at(s)), 1, 4 * kEpsilon);
      if (std::abs(share - 0.5) <= share_off) continue;
      EXPECT_EQ(after.group[s], share > 0.5 ? 7 : -1);
      EXPECT_EQ(after.kind[s], static_cast<cl_uchar>(share > 0.5 ? Kind::surface : Kind::splash));
    }
  }
  EXPECT_GT(next, 5 * cases);
}

TEST_P(Settle, PointsGiveTheBitsOfSamples) {
  std::vector<double> crossing(n_);
  for (std::size_t s = 0; s < n_; ++s) crossing[s] = sure_crossing(s);
  Layer before = make_layer(crossing, depth_of());
  before.triangle.assign(n_, kNoSurface);
  for (std::size_t s = 0; s < n_; ++s)
    if (!(crossing[s] < kEnd)) before.reference[s] = 19;
  // The points are searched two radii behind, samples four: the kernel by itself takes the same.
  const SurfaceBuffers samples = upload(device_, grid_, before);
  const auto reference = upload(device_, before.reference);
  const SampleLists lists = list_samples(device_, grid_, reference);
  const auto behind = allocate<float>(device_, n_);
  const auto left = allocate<cl_int>(device_, lists.sample.size);
  const cl_float4 limits{{static_cast<float>(kParams.contour_density),
                          static_cast<float>(kParams.blob_density), 3, 2}};
  launch(device_, kernels::settle_samples, 1, range_of(lists, 1), lists.sample, lists.count,
         upload(device_, before.triangle), reference, samples.trust, samples.depth, behind, left,
         cells_.x, cells_.y, cells_.z, cells_.tag, cells_.start, cells_.inverse_cell, cells_.mask,
         cells_.weight, cl_int2{{kWidth, kHeight}}, grid_.first, grid_.step, kernel_rays(view_),
         limits, cl_int{0});
  launch(device_, kernels::follow_field, 1, range_of(lists, 1), left, lists.count, reference,
         samples.trust, samples.depth, samples.normal, samples.group, samples.kind, behind,
         cells_.x, cells_.y, cells_.z, cells_.tag, cells_.start, cells_.inverse_cell, cells_.mask,
         cells_.weight, levelled_.weight, cl_int2{{kWidth, kHeight}}, grid_.first, grid_.step,
         kernel_rays(view_), limits, 2.0f);
  const Layer expected = download(device_, before, samples);

  std::vector<float> points(2 * n_);
  for (std::size_t s = 0; s < n_; ++s) {
    points[s] = static_cast<float>(u(s));
    points[n_ + s] = static_cast<float>(v(s));
  }
  const SurfaceBuffers list = upload(device_, SampleGrid{static_cast<int>(n_), 1, 0, 1}, before);
  settle_points(device_, view_, cells_, levelled_, upload(device_, points),
                upload(device_, before.reference), list, kParams);
  const Layer actual = download(device_, before, list);
  std::size_t changed = 0;
  for (std::size_t s = 0; s < n_; ++s) {
    EXPECT_TRUE(actual.same_sample(expected, s)) << "point " << s;
    changed += !actual.same_sample(before, s);
  }
  EXPECT_GT(changed, 30u);
}

MENISCUS_ON_EVERY_DEVICE(Settle);

}  // namespace
}  // namespace meniscus
