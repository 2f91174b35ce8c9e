// Which particles stand for the surface: against loops in double precision, and on blocks and
// sheets whose surface is known, on every device.
#include "stages/sheet/surface.hpp"

#include <algorithm>
#include <cmath>

#include "stages/sheet/surface_by_hand.hpp"
#include "stages/sheet/surface_reference.hpp"

namespace meniscus {
namespace {

using OnSurface = OnDevice;

// Errors of measure_density and measure_gradients (verify/reference/density.hpp), the latter's with
// room to spare; every sum and the norm round once more.
double density_error(const reference::Gradient& g, double density) {
  return kEpsilon * (24 / std::numbers::pi * g.near + (g.near + 2) * density);
}
double gradient_error(const reference::Gradient& g) {
  return kEpsilon * (60 / std::numbers::pi * g.near + (g.near + 4) * g.size);
}

TEST_P(OnSurface, WeightsAndNormalsMatchTheirFormulas) {
  // A block so rough that its inside opens in places, and a single layer, whose density is flat;
  // every third particle is seen.
  std::size_t inner = 0, partly = 0, mixed = 0, level = 0, told = 0;
  for (const Projected& p : {block(10, 10, 9, 0.7, 3), block(30, 30, 1, 0.3, 4)}) {
    Random random(4);
    Visible seen;
    std::vector<Vec3d> normals;
    for (std::int32_t i = 0; i < 900; i += 3) {
      seen.index.push_back(i);
      seen.owned.push_back(0.3f);
      normals.push_back(normalized({random(-0.5, 0.5), random(-0.5, 0.5), 1}));
    }
    const Cells cells = make_cells(p.x, p.y, p.z, kDensitySupport);
    const FieldSurface field = find_surface(
        seen, cells, download(device_, measure_gradients(device_, upload_cells(device_, cells))));
    const SurfaceParticles surface = with_normals(field, seen, normals);
    std::vector<Vec3d> asked(normals.size());
    for (const std::int32_t k : without_descent(seen, field)) asked[k] = normals[k];
    told += static_cast<std::size_t>(std::count(asked.begin(), asked.end(), Vec3d{}));
    EXPECT_EQ(with_normals(field, seen, asked).normal, surface.normal);
    ASSERT_TRUE(std::is_sorted(surface.index.begin(), surface.index.end()));
    std::size_t next = 0;
    for (std::int32_t i = 0; i < 900; ++i) {
      const Vec3d at = p.eye(static_cast<std::size_t>(i));
      const auto g = reference::gradient(p, at);
      const double density = reference::density(p, at), steep = 2 * length(g.value);
      const double open = reference::openness(steep, density);
      const double steep_error = 2 * 2 * gradient_error(g);
      // smoothstep's slope, 1.5 over the width of its ramp.
      const double open_error = 7.5 * (steep_error + 1.5 * density_error(g, density));
      const bool is_seen = i % 3 == 0;
      const bool listed = next < surface.index.size() && surface.index[next] == i;
      ASSERT_TRUE(listed || !is_seen) << "every seen particle is one of the surface";
      if (std::abs(open - 0.01) > open_error && std::abs(steep - 0.1) > steep_error) {
        EXPECT_EQ(listed, is_seen || (open > 0.01 && steep > 0.1)) << i;
      }
      inner += !listed;
      level += !listed && open > 0.5;
      if (!listed) continue;
      EXPECT_NEAR(surface.weight[next], std::max(open, 1e-4), open_error);
      partly += open > 0.05 && open < 0.95;
      const Vec3d down = normalized(-g.value);
      Vec3d mean = down;
      double error = steep_error / steep;  // of the direction
      if (is_seen) {
        const Vec3d own = normals[static_cast<std::size_t>(i) / 3];
        const double sure = smooth_step(0.15, 0.35, steep);
        mean = down * sure + own * (1 - sure);
        error = sure * error + 7.5 * steep_error * 2;
        mixed += sure > 0.05 && sure < 0.95;
      }
      if (length(mean) > 0.1) {  // else the two normals oppose each other
        EXPECT_NEAR(length(surface.normal[next] - normalized(mean)), 0,
                    2 * error / length(mean) + 1e-12);
      }
      ++next;
    }
    EXPECT_EQ(next, surface.index.size());
  }
  EXPECT_GT(inner, 50u);
  EXPECT_GT(partly, 50u);
  EXPECT_GT(mixed, 20u);
  EXPECT_GT(level, 20u);  // hidden and without a direction
  EXPECT_GT(told, 20u);   // told by the field alone
}

TEST_P(OnSurface, TheFacesOfABlockAreFoundWhetherTheyAreSeenOrNot) {
  constexpr int kSide = 16, kLayers = 7;
  const std::int32_t layer = kSide * kSide;
  for (const double rough : {0.0, 0.2}) {
    const FoundSurface found =
        surface_of(device_, block(kSide, kSide, kLayers, rough), static_cast<std::size_t>(layer));
    std::vector<double> weight(kLayers * layer, 0.0);
    std::vector<Vec3d> normal(kLayers * layer);
    for (std::size_t k = 0; k < found.surface.index.size(); ++k) {
      weight[found.surface.index[k]] = found.surface.weight[k];
      normal[found.surface.index[k]] = found.surface.normal[k];
    }
    // A lattice's gradient points straight out. Moved particles turn it, but not to another side,
    // and not all to one: the mean of a hundred within 30 degrees lies within a tenth of that.
    const double degree = std::acos(-1) / 180;
    const double cosine = rough > 0 ? std::cos(30 * degree) : 1 - 1e-9;
    const double mean_cosine = rough > 0 ? std::cos(3 * degree) : 1 - 1e-9;
    for (std::int32_t k = 0; k < kLayers; ++k) {
      // The camera looks along -z: the seen face turns to it, the hidden one away.
      const double out = k == 0 ? 1 : -1;
      Vec3d mean;
      for (std::int32_t j = 3; j < kSide - 3; ++j)
        for (std::int32_t i = 3; i < kSide - 3; ++i) {
          const std::int32_t at = k * layer + j * kSide + i;
          if (k > 0 && k + 1 < kLayers) {
            EXPECT_LT(weight[at], rough > 0 ? 0.5 : 1e-9) << "layer " << k;
            continue;
          }
          EXPECT_EQ(weight[at], 1) << "layer " << k;
          EXPECT_GE(normal[at].z * out, cosine) << "layer " << k;
          mean += normal[at];
        }
      if (k == 0 || k + 1 == kLayers) {
        EXPECT_GE(normalized(mean).z * out, mean_cosine);
      }
    }
    // The sides are surface as well, with normals of their own.
    const std::int32_t side = 3 * layer + 8 * kSide;
    EXPECT_EQ(weight[side], 1);
    EXPECT_LE(normal[side].x, -cosine);
  }
}

TEST_P(OnSurface, ALatticeHasTheStatedGradients) {
  // surface.hpp: |grad C| s = .51 and C = .85 on a face, 0 and .70 in a single layer.
  for (const int layers : {1, 7}) {
    const FoundSurface found = surface_of(device_, block(16, 16, layers), 256);
    const std::size_t n = found.cells.x.size();
    for (std::size_t p = 0; p < n; ++p) {
      if (found.cells.item[p] != 8 * 16 + 8) continue;
      const Vec3d g{found.gradients[p], found.gradients[n + p], found.gradients[2 * n + p]};
      EXPECT_NEAR(2 * length(g), layers == 1 ? 0 : 0.51, 0.005);
      EXPECT_NEAR(found.gradients[3 * n + p], layers == 1 ? 0.70 : 0.85, 0.005);
    }
  }
}

TEST_P(OnSurface, ASingleLayerIsSurfaceWithTheNormalsOfItsTriangles) {
  const FoundSurface found = surface_of(device_, block(16, 16, 1), 256);
  ASSERT_EQ(found.surface.index.size(), 256u);
  for (int j = 3; j < 13; ++j)
    for (int i = 3; i < 13; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * 16 + i;
      EXPECT_GT(found.surface.weight[k], 0.95);
      EXPECT_EQ(found.surface.normal[k], found.normals[k]);
      EXPECT_NEAR(found.normals[k].z, 1, 1e-9);
    }
}

TEST_P(OnSurface, TheRimIsTheHiddenSurfaceNearSeenParticles) {
  // A block and, out of reach, another that nothing sees.
  Projected p = block(12, 10, 6, 0.3);
  const std::size_t n = p.size();
  std::vector<Vec3d> uvt;
  for (std::size_t i = 0; i < n; ++i) uvt.push_back({p.u[i], p.v[i], -p.z[i]});
  for (std::size_t i = 0; i < n; ++i) uvt.push_back({p.u[i] + 50, p.v[i], -p.z[i]});
  p = place(uvt);
  const FoundSurface found = surface_of(device_, p, 120);
  const Visible rim = with_rim(p, found.seen, found.field);
  ASSERT_TRUE(std::is_sorted(rim.index.begin(), rim.index.end()));
  std::size_t next = 0, hidden = 0, far = 0, inner = 0;
  for (std::size_t k = 0; k < found.surface.index.size(); ++k) {
    const std::int32_t i = found.surface.index[k];
    const bool seen = i < 120;
    double nearest = 1e9;
    for (const std::int32_t j : found.seen.index)
      nearest = std::min(
          nearest, length(p.eye(static_cast<std::size_t>(i)) - p.eye(static_cast<std::size_t>(j))));
    ASSERT_GT(std::abs(nearest - 6), 1e-5);  // floats decide alike
    const bool open = found.surface.weight[k] >= 0.5;
    far += !seen && open && nearest > 6;
    inner += !seen && !open && nearest < 6;
    if (!seen && !(open && nearest < 6)) continue;
    ASSERT_LT(next, rim.index.size());
    EXPECT_EQ(rim.index[next], i);
    EXPECT_EQ(rim.owned[next], seen ? 0.3f : 0.0f);
    const double fades = smooth_step(kRimReach - kRimFade, kRimReach, nearest);
    EXPECT_NEAR(rim.influence[next], 1 - fades, 1e-5);
    hidden += !seen;
    ++next;
  }
  EXPECT_EQ(next, rim.index.size());
  EXPECT_GT(hidden, 20u);
  EXPECT_GT(far, 100u);
  EXPECT_GT(inner, 0u);
  EXPECT_TRUE(with_rim(p, {}, found.field).index.empty());
}

// Some of the seen ones hardly are: what they bring in tells its neighbours as little.
TEST_P(OnSurface, TheRimFadesWithTheSeenAndWithTheDistance) {
  const Projected p = block(12, 10, 6, 0.3);
  FoundSurface found = surface_of(device_, p, 120);
  Random random(7);
  for (float& owned : found.seen.owned)
    owned = static_cast<float>(random(0, 1) < 0.9 ? random(0.02, 0.03) : random(0.03, 0.12));
  const Visible rim = with_rim(p, found.seen, found.field);
  std::size_t fading = 0, full = 0;
  for (std::size_t k = 0; k < rim.index.size(); ++k) {
    const Vec3d at = p.eye(static_cast<std::size_t>(rim.index[k]));
    double influence = 0;
    for (std::size_t s = 0; s < found.seen.index.size(); ++s) {
      const double distance = length(p.eye(static_cast<std::size_t>(found.seen.index[s])) - at);
      influence =
          std::max(influence, smooth_step(kLeastFitted, kFullyVisible, found.seen.owned[s]) *
                                  (1 - smooth_step(kRimReach - kRimFade, kRimReach, distance)));
    }
    EXPECT_NEAR(rim.influence[k], influence, 1e-5) << "particle " << rim.index[k];
    fading += influence > 0 && influence < 1;
    full += influence == 1;
  }
  EXPECT_GT(fading, 20u);
  EXPECT_GT(full, 20u);
  // One that begins to be seen changes nobody else.
  found.seen.owned[60] = static_cast<float>(kLeastFitted);
  const Visible at_least = with_rim(p, found.seen, found.field);
  found.seen.index.erase(found.seen.index.begin() + 60);
  found.seen.owned.erase(found.seen.owned.begin() + 60);
  const Visible without = with_rim(p, found.seen, found.field);
  for (std::size_t k = 0; k < without.index.size(); ++k) {
    const auto place =
        std::lower_bound(at_least.index.begin(), at_least.index.end(), without.index[k]);
    ASSERT_EQ(*place, without.index[k]);
    EXPECT_EQ(at_least.influence[static_cast<std::size_t>(place - at_least.index.begin())],
              without.influence[k]);
  }
}

TEST(Visibility, FadesInBetweenTheTwoShares) {
  EXPECT_EQ(visibility(0), 1e-4);
  EXPECT_EQ(visibility(kLeastFitted), 1e-4);
  EXPECT_NEAR(visibility((kLeastFitted + kFullyVisible) / 2), 0.5, 1e-12);
  EXPECT_EQ(visibility(kFullyVisible), 1);
  EXPECT_EQ(visibility(0.9), 1);
  for (double owned = 0.02; owned < 0.085; owned += 0.01)
    EXPECT_LT(visibility(owned), visibility(owned + 0.01));
}

TEST(MoreVisible, KeepsThoseThatOwnEnough) {
  const Visible seen{{2, 5, 9}, {0.01f, 0.06f, 0.5f}, {}};
  const Visible more = more_visible(seen, 0.06f);
  EXPECT_EQ(more.index, (std::vector<std::int32_t>{5, 9}));
  EXPECT_EQ(more.owned, (std::vector<float>{0.06f, 0.5f}));
  EXPECT_TRUE(more.influence.empty());
  const Visible rim{seen.index, seen.owned, {0.3f, 0.6f, 1}};
  EXPECT_EQ(more_visible(rim, 0.06f).influence, (std::vector<float>{0.6f, 1}));
  EXPECT_EQ(places_in(seen.index, {2, 9}), (std::vector<std::int32_t>{0, 2}));
}

TEST(FirstNormals, AreTheTrianglesOrTheNeighboursOrTowardsTheCamera) {
  Projected p = field(
      7, 1, [](double u, double v) { return 25 + 1.5 * std::sin(0.35 * u) + std::cos(0.5 * v); });
  std::vector<Vec3d> uvt;
  for (std::size_t i = 0; i < p.size(); ++i) uvt.push_back({p.u[i], p.v[i], -p.z[i]});
  const std::int32_t near = static_cast<std::int32_t>(uvt.size());
  uvt.push_back({16, 16, 25 + 1.5 * std::sin(0.35 * 16) + std::cos(8.0) + 1});  // not in the mesh
  uvt.push_back({70, 70, 25});                                                  // far from all
  p = place(uvt);
  const Visible seen = all_visible(p);
  Visible meshed = seen;
  meshed.index.resize(static_cast<std::size_t>(near));
  meshed.owned.resize(static_cast<std::size_t>(near));
  const Triangulation mesh = triangulate(plain_view(), p, meshed, {});
  std::vector<Vec3d> sum(p.size());
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::kept)
      for (const std::int32_t v : mesh.triangle[t])
        sum[mesh.particle[v]] += mesh.normal[t] * mesh.area[t];
  const std::vector<Vec3d> normals = first_normals(plain_view(), p, seen, mesh, mesh.normal);
  Vec3d mean;
  for (std::int32_t i = 0; i < near; ++i) {
    EXPECT_NEAR(length(normals[i] - normalized(sum[i])), 0, 1e-12);
    const double l =
        length(p.eye(static_cast<std::size_t>(i)) - p.eye(static_cast<std::size_t>(near)));
    if (l < 4) mean += normalized(sum[i]) * (1 - l / 4);
  }
  EXPECT_GT(length(mean), 1);
  EXPECT_NEAR(length(normals[near] - normalized(mean)), 0, 1e-12);
  EXPECT_NEAR(length(normals[near + 1] - Vec3d{0, 0, 1}), 0, 1e-12);

  // Some of them are the same.
  const NormalSources sources = normal_sources(p, seen, mesh, {3, near, near + 1});
  const std::vector<Vec3d> some = first_normals(plain_view(), p, seen, mesh, mesh.normal, sources);
  for (std::size_t k = 0; k < some.size(); ++k) {
    const std::int32_t i = static_cast<std::int32_t>(k);
    EXPECT_EQ(some[k], i == 3 || i >= near ? normals[k] : Vec3d{}) << k;
  }
}

MENISCUS_ON_EVERY_DEVICE(OnSurface);

}  // namespace
}  // namespace meniscus
