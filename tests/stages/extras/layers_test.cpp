// Where rays leave a closed mesh, against plain loops over its triangles, and how that goes with
// fronts.
#include "stages/extras/layers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "meniscus/camera.hpp"
#include "same_bits.hpp"
#include "stages/extras/layer_rows.hpp"

namespace meniscus {
namespace {

// The sides of a box, outward.
void add_box(DualMesh& mesh, const Vec3d& low, const Vec3d& high) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  const Vec3d middle = (low + high) / 2;
  for (int k = 0; k < 8; ++k) {
    const Vec3d at{k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z};
    mesh.position.push_back(at);
    mesh.normal.push_back(normalized(at - middle));
  }
  for (const auto& t : {std::array{0u, 2u, 1u},
                        {1u, 2u, 3u},
                        {4u, 5u, 6u},
                        {5u, 7u, 6u},
                        {0u, 1u, 4u},
                        {1u, 5u, 4u},
                        {2u, 6u, 3u},
                        {3u, 6u, 7u},
                        {0u, 4u, 2u},
                        {2u, 4u, 6u},
                        {1u, 3u, 5u},
                        {3u, 7u, 5u}})
    mesh.triangle.push_back({first + t[0], first + t[1], first + t[2]});
}

// A ball of rings, each vertex moved outward or inward by up to `rough` of the radius.
void add_ball(DualMesh& mesh, const Vec3d& centre, double radius, double rough = 0) {
  constexpr int kRings = 24, kAround = 40;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> moved(1 - rough, 1 + rough);
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  const auto add = [&](const Vec3d& towards) {
    mesh.position.push_back(centre + towards * (radius * moved(random)));
    mesh.normal.push_back(towards);
  };
  add({0, 0, 1});
  add({0, 0, -1});
  for (int r = 1; r < kRings; ++r)
    for (int a = 0; a < kAround; ++a) {
      const double polar = M_PI * r / kRings, angle = 2 * M_PI * a / kAround;
      add({std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle), std::cos(polar)});
    }
  const auto at = [&](int r, int a) {
    if (r == 0) return first;
    if (r == kRings) return first + 1;
    return first + 2 + static_cast<std::uint32_t>((r - 1) * kAround + a % kAround);
  };
  for (int r = 0; r < kRings; ++r)
    for (int a = 0; a < kAround; ++a) {
      if (r > 0) mesh.triangle.push_back({at(r, a), at(r + 1, a), at(r, a + 1)});
      if (r + 1 < kRings) mesh.triangle.push_back({at(r, a + 1), at(r + 1, a), at(r + 1, a + 1)});
    }
}

// World units are particle radii times 0.5.
constexpr double kRadius = 0.5;

View perspective(int width = 61, int height = 47) {
  return make_view(look_at({0, 0, 20}, {0, 0, 0}, {0, 1, 0}, 40, width, height), kRadius,
                   {0, 0, 0});
}

// A pixel is 1/4 particle radii wide; the eye is at depth 0, its axis at pixel (width / 2, height /
// 2).
View orthographic(int width = 64, int height = 48) {
  Camera camera{width, height, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, {}};
  const double half = 0.5 * 0.25 * kRadius;
  camera.projection = {
      1 / (half * width), 0, 0, 0, 0, 1 / (half * height), 0, 0, 0, 0, -0.01, -1.01, 0, 0, 0, 1};
  return make_view(camera, kRadius, {0, 0, 0});
}

std::size_t pixels_of(const View& view) {
  return static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
}

// A crossing of a ray: depth, and 1 where it enters.
struct Met {
  double depth;
  int enters;
};

// Of the ray of a pixel, by each triangle's plane. `clear`: how far the ray keeps from all edges,
// over the triangles' sides.
std::vector<Met> met_by_loop(const View& view, const DualMesh& mesh, double u, double v,
                             double& clear) {
  std::vector<Met> met;
  const Vec3d from = point_at(view, u, v, 0), along = ray_direction(view, u, v);
  for (const auto& t : mesh.triangle) {
    const Vec3d a = mesh.position[t[0]], ab = mesh.position[t[1]] - a, ac = mesh.position[t[2]] - a;
    const Vec3d p = cross(along, ac);
    const double det = dot(ab, p);
    const Vec3d s = from - a, q = cross(s, ab);
    const double x = dot(s, p) / det, y = dot(along, q) / det;
    clear = std::min({clear, std::abs(x), std::abs(y), std::abs(1 - x - y)});
    if (x >= 0 && y >= 0 && x + y <= 1) met.push_back({dot(ac, q) / det, det > 0 ? 1 : -1});
  }
  std::sort(met.begin(), met.end(), [](const Met& a, const Met& b) { return a.depth < b.depth; });
  return met;
}

// The mesh's own front.
std::vector<float> front_by_loop(const View& view, const DualMesh& mesh) {
  std::vector<float> front;
  for (int j = 0; j < view.height; ++j)
    for (int i = 0; i < view.width; ++i) {
      double clear = 1;
      const std::vector<Met> met = met_by_loop(view, mesh, i + 0.5, j + 0.5, clear);
      front.push_back(met.empty() ? kNoSurface
                                  : world_depth(view, static_cast<float>(met[0].depth)));
    }
  return front;
}

void expect_as_by_loop(const View& view, const DualMesh& mesh) {
  constexpr int kMost = 8;
  const std::vector<float> front = front_by_loop(view, mesh);
  const Layers layers = trace_layers(view, mesh, front, kMost);
  const std::size_t pixels = pixels_of(view);
  std::size_t compared = 0, several = 0;
  for (int j = 0; j < view.height; ++j)
    for (int i = 0; i < view.width; ++i) {
      const std::size_t p = static_cast<std::size_t>(j * view.width + i);
      double clear = 1;
      const std::vector<Met> met = met_by_loop(view, mesh, i + 0.5, j + 0.5, clear);
      ASSERT_EQ(layers.count[p] > 0, front[p] < kNoSurface);
      if (met.empty() || clear < 1e-3) continue;  // vertices move by up to 1/8192 of a pixel
      ++compared;
      const double stretch = length(ray_direction(view, i + 0.5, j + 0.5));
      std::vector<std::array<double, 2>> bodies;
      int within = 0;
      double begins = 0;
      for (const Met& m : met) {
        if (within == 0) begins = m.depth;
        within += m.enters;
        if (within != 0) continue;
        const double air = bodies.empty() ? 1 : (begins - bodies.back()[1]) * stretch;
        if (std::abs(air - 0.5) < 1e-2) clear = 0;  // may be either
        if (air < 0.5)
          bodies.back()[1] = m.depth;
        else
          bodies.push_back({begins, m.depth});
      }
      if (bodies.size() > 1) {  // the first is a fold behind the front?
        const double thin = (bodies[0][1] - bodies[0][0]) * stretch,
                     behind = (bodies[1][0] - bodies[0][0]) * stretch;
        if (std::abs(thin - 0.5) < 1e-2 || std::abs(behind - 2) < 1e-2) clear = 0;
        if (thin < 0.5 && behind < 2) {
          bodies[1][0] = bodies[0][0];
          bodies.erase(bodies.begin());
        }
      }
      if (clear < 1e-3) continue;
      double thickness = 0;
      std::size_t k = 0;
      for (const auto& [from, to] : bodies) {
        ASSERT_LT(k, layers.count[p]);
        // Rays at up to 87 degrees to the mesh: 1/8192 of a pixel, some 1/30000 radii, by 20.
        constexpr double kNear = 2e-3;
        EXPECT_NEAR(layers.entry[k * pixels + p] / kRadius, from, kNear) << i << ' ' << j;
        EXPECT_NEAR(layers.exit[k * pixels + p] / kRadius, to, kNear) << i << ' ' << j;
        thickness += (to - from) * kRadius * stretch;
        ++k;
      }
      EXPECT_EQ(layers.count[p], k);
      several += k > 1;
      EXPECT_NEAR(layers.thickness[p], thickness, 2e-3 * kRadius * static_cast<double>(k));
    }
  EXPECT_GT(compared, 200u);
  EXPECT_GT(several, 10u);
}

TEST(Layers, AreThoseOfALoopOverTriangles) {
  DualMesh mesh;
  add_ball(mesh, {0, 0, 0}, 7, 0.1);
  add_ball(mesh, {4, 1, -17}, 6, 0.1);
  add_box(mesh, {-9, -5, -14}, {3, 2, -11});
  for (Vec3d& at : mesh.position) at = at + Vec3d{0.01, 0.02, -40};
  expect_as_by_loop(perspective(), mesh);
  expect_as_by_loop(orthographic(), mesh);
}

// Vertices and edges on pixel centres: each ray meets one triangle, not none or two.
TEST(Layers, OfABoxOnPixelCentresHaveNoHoles) {
  const View view = orthographic();
  DualMesh mesh;
  // Its sides run through centres: pixel (16, 12) to (48, 36), a pixel is 1/4.
  add_box(mesh, {-4 + 0.125, -3 + 0.125, -30}, {4 + 0.125, 3 + 0.125, -20});
  const std::vector<float> front(pixels_of(view), static_cast<float>(20 * kRadius));
  const Layers layers = trace_layers(view, mesh, front, 1);
  std::size_t thick = 0;
  for (std::size_t p = 0; p < front.size(); ++p) {
    ASSERT_EQ(layers.count[p], 1u);
    if (layers.thickness[p] < 1) continue;
    ++thick;
    EXPECT_NEAR(layers.thickness[p], 10 * kRadius, 1e-5);
    EXPECT_EQ(layers.back_normal[p], (Vec3{0, 0, -1}));
  }
  EXPECT_EQ(thick, 32u * 24u);  // of two opposite sides one has the pixels on it
}

TEST(Layers, BeginAtTheFront) {
  const View view = orthographic();
  DualMesh mesh;
  add_box(mesh, {-100, -100, -12}, {100, 100, -10});
  add_box(mesh, {-100, -100, -30}, {100, 100, -20});
  const auto intervals = [&](double front) {
    const Layers layers = trace_layers(
        view, mesh, std::vector<float>(pixels_of(view), static_cast<float>(front * kRadius)), 3);
    std::vector<double> found;
    for (std::size_t k = 0; k < std::min(3u, layers.count[5]); ++k)
      for (const auto* of : {&layers.entry, &layers.exit})
        found.push_back((*of)[k * pixels_of(view) + 5] / kRadius);
    double all = 0;
    for (std::size_t k = 0; k + 1 < found.size(); k += 2) all += found[k + 1] - found[k];
    EXPECT_NEAR(layers.thickness[5], all * kRadius, 1e-5);
    return found;
  };
  const auto expect_near = [](const std::vector<double>& found, const std::vector<double>& wanted) {
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t k = 0; k < found.size(); ++k) EXPECT_NEAR(found[k], wanted[k], 1e-5) << k;
  };
  expect_near(intervals(10), {10, 12, 20, 30});
  expect_near(intervals(10.5), {10.5, 12, 20, 30});
  expect_near(intervals(6.5), {6.5, 12, 20, 30});        // the mesh is less than four radii behind
  expect_near(intervals(5), {5, 5.02, 10, 12, 20, 30});  // a film
  expect_near(intervals(15), {15, 15.02, 20, 30});       // what the mesh has before is left out
  expect_near(intervals(25), {25, 30});
  expect_near(intervals(31), {31, 31.02});
}

// The front tells where rays enter: the mesh need not.
TEST(Layers, OfAMeshWithoutItsFrontAreTheSame) {
  const View view = perspective();
  DualMesh mesh;
  add_box(mesh, {-20, -20, -62}, {20, 20, -60});
  add_box(mesh, {-90, -90, -80}, {90, 90, -70});
  const std::vector<float> front = front_by_loop(view, mesh);
  DualMesh open = mesh;
  std::erase_if(open.triangle, [](const auto& t) { return t[0] == 4 || t[0] == 5; });
  ASSERT_LT(open.triangle.size(), mesh.triangle.size());
  const Layers all = trace_layers(view, mesh, front, 2), same = trace_layers(view, open, front, 2);
  EXPECT_EQ(*std::max_element(all.count.begin(), all.count.end()), 2u);
  EXPECT_TRUE(same_bits(same.count, all.count));
  EXPECT_TRUE(same_bits(same.thickness, all.thickness));
  EXPECT_TRUE(same_bits(same.back_normal, all.back_normal));
  EXPECT_TRUE(same_bits(same.entry, all.entry));
  EXPECT_TRUE(same_bits(same.exit, all.exit));
}

TEST(Layers, AirThatIsTooThinIsNone) {
  const View view = orthographic();
  // Wherever the front is: entries that lie just behind it are not looked at.
  for (const double first : {10.0, 11.45})
    for (const double gap : {0.4, 0.6}) {
      DualMesh mesh;
      add_box(mesh, {-100, -100, -12}, {100, 100, -10});
      add_box(mesh, {-100, -100, -14}, {100, 100, -12 - gap});
      const Layers layers = trace_layers(
          view, mesh, std::vector<float>(pixels_of(view), static_cast<float>(first * kRadius)), 2);
      EXPECT_EQ(layers.count[7], gap < 0.5 ? 1u : 2u);
      EXPECT_NEAR(layers.exit[7], (gap < 0.5 ? 14 : 12) * kRadius, 1e-5);
      EXPECT_NEAR(layers.thickness[7], (14 - first - (gap < 0.5 ? 0 : gap)) * kRadius, 1e-5);
    }
}

// The front bulges before a fold of the mesh. Without the fold's other side there is a film.
TEST(Layers, WaterThatIsTooThinAtTheFrontIsNone) {
  const View view = orthographic();
  for (const double thin : {0.4, 0.6})
    for (const double next : {1.9, 2.1}) {
      DualMesh mesh;
      add_box(mesh, {-100, -100, -12}, {100, 100, -10});
      add_box(mesh, {-100, -100, -30}, {100, 100, -12 + thin - next});
      const Layers layers = trace_layers(
          view, mesh,
          std::vector<float>(pixels_of(view), static_cast<float>((12 - thin) * kRadius)), 2);
      const bool folds = thin < 0.5 && next < 2;
      EXPECT_EQ(layers.count[7], folds ? 1u : 2u);
      EXPECT_NEAR(layers.exit[7], (folds ? 30 : 12) * kRadius, 1e-5);
      const double air = folds ? 0 : next - thin;
      EXPECT_NEAR(layers.thickness[7], (18 + thin - air) * kRadius, 1e-5);
    }
}

TEST(Layers, CountAllAndKeepSome) {
  const View view = perspective();
  DualMesh mesh;
  for (int k = 0; k < 4; ++k) add_box(mesh, {-90, -90, -60 - 10.0 * k}, {90, 90, -55 - 10.0 * k});
  const std::vector<float> front = front_by_loop(view, mesh);
  const Layers all = trace_layers(view, mesh, front, 8), some = trace_layers(view, mesh, front, 2);
  EXPECT_EQ(some.most, 2);
  EXPECT_TRUE(same_bits(some.count, all.count));
  EXPECT_TRUE(same_bits(some.thickness, all.thickness));
  EXPECT_TRUE(same_bits(some.back_normal, all.back_normal));
  const std::size_t pixels = pixels_of(view);
  ASSERT_EQ(some.entry.size(), 2 * pixels);
  for (std::size_t p = 0; p < 2 * pixels; ++p) {
    EXPECT_EQ(some.entry[p], all.entry[p]);
    EXPECT_EQ(some.exit[p], all.exit[p]);
  }
  EXPECT_EQ(*std::max_element(all.count.begin(), all.count.end()), 4u);
}

// A triangle of random corners, in `steps` of a pixel, in a band of this size.
FaceRows random_face(std::mt19937& random, int width, int rows, std::int64_t steps) {
  std::uniform_int_distribution<std::int64_t> u(-4 * steps, (width + 4) * steps),
      v(-4 * steps, (rows + 4) * steps);
  std::array<std::array<std::int64_t, 2>, 3> corner{
      {{u(random), v(random)}, {u(random), v(random)}, {u(random), v(random)}}};
  FaceRows face{};
  std::uniform_int_distribution<int> column(0, width - 1), row(0, rows - 1);
  face.column = column(random);
  face.columns = width - face.column;
  face.row = row(random);
  face.rows = rows - face.row;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto &from = corner[k], &to = corner[(k + 1) % 3];
    face.to_right[k] = from[1] - to[1];
    face.down[k] = to[0] - from[0];
    const std::int64_t side = (to[0] - from[0]) * (face.row * steps + steps / 2 - from[1]) -
                              (to[1] - from[1]) * (face.column * steps + steps / 2 - from[0]);
    face.within[k] = side / steps;
  }
  std::uniform_real_distribution<double> any(-0.02, 0.02);
  const auto some = [&] { return static_cast<float>(any(random)); };
  face.depth = 3;
  face.least = 2.6f;
  face.most = 3.4f;
  face.at = {some(), 1, some(), some(), some()};
  face.by_column = {some(), 0.1f * some(), some(), some(), some()};
  face.by_row = {some(), 0.1f * some(), some(), some(), some()};
  face.nearest = 0.25f;
  face.enters = random() % 3 == 0;
  return face;
}

// Each way of drawing and filling that this processor can run has the same bits.
TEST(Layers, AreTheSameByEachLoop) {
  constexpr int kWidth = 75, kRows = 5, kFaces = 150;
  const View view = perspective(kWidth, kRows);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> depth(2.5f, 3.0f);
  std::vector<float> front(kWidth * kRows);
  for (float& each : front) each = random() % 5 == 0 ? kNoSurface : depth(random);
  std::vector<FaceRows> faces;
  for (int k = 0; k < kFaces; ++k)  // of numbers that fit in 32 bits, and of those that do not
    faces.push_back(random_face(random, kWidth, kRows, k % 2 == 0 ? 4096 : 1 << 24));
  std::vector<BandCrossings> drawn;
  std::vector<Layers> filled;
  std::vector<std::vector<std::uint32_t>> rest;
  std::vector<std::vector<std::array<float, 5>>> listed;
  for (const LayerLoops& loops : layer_loops()) {
    BandCrossings& band = drawn.emplace_back(kRows, kWidth);
    for (const FaceRows& face : faces) {
      band.make_room(kWidth * kRows);
      loops.draw(face, front.data(), kWidth, band);
    }
    std::vector<std::uint32_t> others(band.exit.size(), kNoOther);
    for (std::size_t p = 0; p < others.size(); p += 7) others[p] = 0;
    Layers& layers = filled.emplace_back();
    layers.entry = front;
    layers.exit.assign(front.size(), kNoSurface);
    layers.count.assign(front.size(), 0);
    layers.thickness.assign(front.size(), 0);
    layers.back_normal.resize(front.size());
    std::vector<std::uint32_t>& left = rest.emplace_back();
    for (int row = 0; row < kRows; ++row)
      for (int column = 0; column < kWidth; column += 32)
        left.push_back(loops.fill(
            view,
            {column, row, std::min(32, kWidth - column),
             static_cast<std::size_t>(row * kWidth + column),
             static_cast<std::size_t>(row) * band.stride + static_cast<std::size_t>(column)},
            band, others.data(), layers));
    // In whatever order the pixels of one face were drawn.
    std::vector<std::size_t> order(band.others);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t k) { return band.other_pixel[k]; });
    std::vector<std::array<float, 5>>& of_pixels = listed.emplace_back();
    for (const std::size_t k : order) {
      const bool enters = (band.other_pixel[k] & 1) != 0;  // and has no normal
      const auto normal = [&](std::size_t axis) { return enters ? 0 : band.other_normal[axis][k]; };
      of_pixels.push_back({static_cast<float>(band.other_pixel[k]), band.other_depth[k], normal(0),
                           normal(1), normal(2)});
    }
    EXPECT_GT(band.others, 100u);
    EXPECT_GT(std::count(layers.count.begin(), layers.count.end(), 1u), 100);
    EXPECT_TRUE(same_bits(band.exit, drawn[0].exit));
    EXPECT_TRUE(same_bits(of_pixels, listed[0]));
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_TRUE(same_bits(band.normal[axis], drawn[0].normal[axis]));
    EXPECT_EQ(left, rest[0]);
    EXPECT_TRUE(same_bits(layers.exit, filled[0].exit));
    EXPECT_TRUE(same_bits(layers.thickness, filled[0].thickness));
    EXPECT_TRUE(same_bits(layers.count, filled[0].count));
    EXPECT_TRUE(same_bits(layers.back_normal, filled[0].back_normal));
  }
}

TEST(Layers, AreNoneWithoutAFront) {
  const View view = perspective();
  DualMesh mesh;
  add_ball(mesh, {0, 0, 0}, 7);
  const Layers layers =
      trace_layers(view, mesh, std::vector<float>(pixels_of(view), kNoSurface), 2);
  for (std::size_t p = 0; p < pixels_of(view); ++p) {
    EXPECT_EQ(layers.count[p], 0u);
    EXPECT_EQ(layers.thickness[p], 0);
    EXPECT_EQ(layers.entry[p], kNoSurface);
    EXPECT_EQ(layers.back_normal[p], (Vec3{}));
  }
}

// The eye is in the fluid: the mesh begins behind it, and its front is what the pixels show.
TEST(Layers, OfAMeshAroundTheEyeEndWhereItEnds) {
  const View view = perspective();
  DualMesh mesh;
  add_box(mesh, {-60, -60, -30}, {60, 60, 30});  // the sides' corners before the eye are not drawn
  const Layers layers = trace_layers(view, mesh, std::vector<float>(pixels_of(view), 2.0f), 1);
  const std::size_t middle = pixels_of(view) / 2;
  EXPECT_NEAR(layers.exit[middle], 30 * kRadius, 1e-4);
}

}  // namespace
}  // namespace meniscus
