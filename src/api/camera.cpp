#include "meniscus/camera.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "api/framing.hpp"
#include "base/exact_math.hpp"
#include "base/printed.hpp"
#include "meniscus/error.hpp"
#include "prepare/survey.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

std::string number(double value) { return printed("%g", value); }

std::string entry(const char* matrix, int k) {
  return std::string("camera: ") + matrix + "[" + std::to_string(k / 4) + "][" +
         std::to_string(k % 4) + "]";
}

}  // namespace

Camera look_at(const std::array<double, 3>& eye, const std::array<double, 3>& target,
               const std::array<double, 3>& up, double fov_degrees, int width, int height) {
  require(width >= 1 && height >= 1, "camera: size is " + std::to_string(width) + "x" +
                                         std::to_string(height) + ", both must be >= 1 pixel");
  require(fov_degrees > 0 && fov_degrees < 180, "camera: field of view is " + number(fov_degrees) +
                                                    " degrees, must be above 0 and below 180");
  const Vec3d e{eye[0], eye[1], eye[2]}, t{target[0], target[1], target[2]}, u{up[0], up[1], up[2]};
  for (double x : {e.x, e.y, e.z, t.x, t.y, t.z, u.x, u.y, u.z})
    require(std::isfinite(x), "camera: eye, target and up must be finite numbers");
  const double distance = length(t - e);
  require(distance > 0, "camera: eye and target are the same point");
  const Vec3d forward = (t - e) / distance;
  const Vec3d side_raw = cross(forward, u);
  require(length(side_raw) > 1e-9 * length(u) && length(u) > 0,
          "camera: up is zero or parallel to the direction of view (give another " + setting("up") +
              ")");
  const Vec3d side = normalized(side_raw), top = cross(side, forward);

  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.view = {side.x,     side.y,     side.z,     -dot(side, e),    //
                 top.x,      top.y,      top.z,      -dot(top, e),     //
                 -forward.x, -forward.y, -forward.z, dot(forward, e),  //
                 0,          0,          0,          1};
  const double near = 0.02 * distance, far = 50 * distance;
  const double focal = 1 / std::tan(fov_degrees * std::numbers::pi / 360);
  camera.projection = {focal * height / width,
                       0,
                       0,
                       0,  //
                       0,
                       focal,
                       0,
                       0,  //
                       0,
                       0,
                       (far + near) / (near - far),
                       2 * far * near / (near - far),  //
                       0,
                       0,
                       -1,
                       0};
  return camera;
}

namespace {

struct Bounds {
  std::array<float, 3> low, high;

  void include(const std::array<float, 3>& p) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
};

// The direction from the particles to the camera: from the right, from above, from the front, where
// `up` is up and the x-axis points right unless it is up itself.
Vec3d from_where(const std::array<double, 3>& up) {
  const Vec3d above = normalized({up[0], up[1], up[2]});
  Vec3d x{1, 0, 0};
  if (std::abs(above.x) > 0.9) x = {0, 1, 0};
  const Vec3d right = normalized(x - above * dot(x, above));
  return normalized(right * 0.55 + above * 0.45 + cross(right, above) * 0.8);
}

constexpr Bounds kNoBounds{{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};

// The bounds without particles that a simulation threw away: those farther from the middle than 20
// times what 98 % of a sample reach. Where there are none, all that were given.
Bounds without_strays(const Bounds& all, std::vector<std::array<float, 3>> sample) {
  constexpr std::size_t kTelling = 100;  // particles
  constexpr double kFar = 20;
  if (sample.size() < kTelling) return all;
  std::array<double, 3> middle{};
  double reach = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto at = [&](std::size_t percent) {
      const auto place =
          sample.begin() + static_cast<std::ptrdiff_t>(sample.size() * percent / 100);
      std::nth_element(sample.begin(), place, sample.end(),
                       [k](const auto& a, const auto& b) { return a[k] < b[k]; });
      return double{(*place)[k]};
    };
    const double low = at(1), high = at(99);
    middle[k] = (low + high) / 2;
    reach = std::max(reach, (high - low) / 2);
  }
  const auto near = [&](const std::array<float, 3>& p) {
    for (std::size_t k = 0; k < 3; ++k)
      if (!(std::abs(p[k] - middle[k]) <= kFar * reach)) return false;
    return true;
  };
  if (!(reach > 0) || (near(all.low) && near(all.high))) return all;
  Bounds bounds = kNoBounds;
  for (const std::array<float, 3>& p : sample)
    if (near(p)) bounds.include(p);
  return bounds;
}

// What one source's particles need to be seen.
struct Extent {
  Bounds bounds = kNoBounds;
  double particle = 0;  // radius, world units; 0: unknown
};

Vec3d vector_of(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

// About the radius of `count` particles that fill the bounds: they lie s apart where a box that is
// larger by s has room for them. Larger than it is where they fill a part of the bounds alone.
double guessed_radius(const Bounds& bounds, std::int64_t count) {
  constexpr int kSteps =
      40;  // a third of the error goes in each at least, of sheets and lines, too
  const Vec3d sides = vector_of(bounds.high) - vector_of(bounds.low);
  double spacing = std::max({sides.x, sides.y, sides.z});
  for (int k = 0; k < kSteps; ++k)
    spacing = cube_root((sides.x + spacing) * (sides.y + spacing) * (sides.z + spacing) /
                        static_cast<double>(count));
  return spacing / 2;
}

// A sphere seen along one axis of the image: where its centre is across, and how deep.
struct Across {
  double at, deep;
};

// How deep an eye may lie at most, so that spheres of `radius` are between two planes through it
// whose slopes are -slope and slope: for each, at + deep * slope >= radius' + eye + eye_deep *
// slope and at - deep * slope <= -radius' + eye - eye_deep * slope, where radius' is along the
// axis.
double deepest_eye(const std::array<Across, 8>& spheres, double radius, double slope) {
  double least = DBL_MAX, most = -DBL_MAX;
  for (const Across& sphere : spheres) {
    least = std::min(least, sphere.at + sphere.deep * slope);
    most = std::max(most, sphere.at - sphere.deep * slope);
  }
  return (least - most) / (2 * slope) - radius * std::sqrt(1 + slope * slope) / slope;
}

// Where across an eye sees as much to both sides: of all pairs the one that is farthest apart
// tells.
double middle_of(const std::array<Across, 8>& spheres, double radius, double eye_deep) {
  double farthest = -1, middle = 0;
  for (const Across& a : spheres)
    for (const Across& b : spheres) {
      const double deep_a = a.deep - eye_deep, deep_b = b.deep - eye_deep;
      const double apart = (a.at - b.at + 2 * radius) / (deep_a + deep_b);
      if (apart <= farthest) continue;
      farthest = apart;
      middle = ((a.at + radius) * deep_b + (b.at - radius) * deep_a) / (deep_a + deep_b);
    }
  return middle;
}

// Shows the bounds, in which particles of radius `particle` (0: unknown) lie, as large as the image
// allows and in its middle.
Camera frame_bounds(const Bounds& bounds, double particle, const Framing& framing) {
  constexpr double kFilled = 0.92;      // of the image's width or height
  constexpr double kNearest = 1.0 / 9;  // of half the depth of what is shown: beyond the near plane
  const Vec3d low = vector_of(bounds.low), high = vector_of(bounds.high);
  const Vec3d centre = (low + high) / 2, half = (high - low) / 2;
  // Particles have a size; where nothing tells it, 1 is what extract() assumes of a single point.
  if (low == high && !(particle > 0)) particle = 1;
  const double radius = std::max(particle, length(centre) * 1e-6);
  const Vec3d forward = -from_where(framing.up);
  const Vec3d side = normalized(cross(forward, {framing.up[0], framing.up[1], framing.up[2]}));
  const Vec3d top = cross(side, forward);
  std::array<Across, 8> wide, high_up;  // of the box's corners, from its centre
  double nearest = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    const Vec3d corner{k & 1 ? half.x : -half.x, k & 2 ? half.y : -half.y,
                       k & 4 ? half.z : -half.z};
    const double deep = dot(corner, forward);
    wide[k] = {dot(corner, side), deep};
    high_up[k] = {dot(corner, top), deep};
    nearest = std::min(nearest, deep);
  }
  const double steep = kFilled * std::tan(framing.fov * std::numbers::pi / 360);
  const double flat = steep * framing.width / framing.height;
  const double deep =
      std::min({deepest_eye(wide, radius, flat), deepest_eye(high_up, radius, steep),
                (nearest - radius) * (1 + kNearest)});
  const auto length_across = [&](double slope) { return radius * std::sqrt(1 + slope * slope); };
  const Vec3d target = centre + side * middle_of(wide, length_across(flat), deep) +
                       top * middle_of(high_up, length_across(steep), deep);
  const Vec3d eye = target + forward * deep;
  return look_at({eye.x, eye.y, eye.z}, {target.x, target.y, target.z}, framing.up, framing.fov,
                 framing.width, framing.height);
}

Camera frame_nothing(const Framing& framing) {
  const Vec3d eye = from_where(framing.up);
  return look_at({eye.x, eye.y, eye.z}, {0, 0, 0}, framing.up, framing.fov, framing.width,
                 framing.height);
}

void check(const Framing& framing) {
  require(framing.fov > 0 && framing.fov < 180, "camera: field of view is " + number(framing.fov) +
                                                    " degrees, must be above 0 and below 180");
  require(framing.width >= 1 && framing.height >= 1,
          "camera: size is " + std::to_string(framing.width) + "x" +
              std::to_string(framing.height) + ", both must be >= 1 pixel");
  const Vec3d up{framing.up[0], framing.up[1], framing.up[2]};
  require(std::isfinite(up.x) && std::isfinite(up.y) && std::isfinite(up.z) && length(up) > 0,
          "camera: up must be three finite numbers, not all 0");
}

// Of `count` particles in the bounds `all`, of which there is a sample.
Extent extent_of(const Bounds& all, std::vector<std::array<float, 3>> sample, double particle,
                 std::int64_t count) {
  const Bounds bounds = without_strays(all, std::move(sample));
  return {bounds, particle > 0 ? particle : guessed_radius(bounds, count)};
}

Extent extent_of(const BorrowedParticles& particles) {
  check(particles);
  Bounds bounds = kNoBounds;
  std::vector<std::array<float, 3>> finite;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const std::array<float, 3> p{particles.x[i], particles.y[i], particles.z[i]};
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
    bounds.include(p);
    finite.push_back(p);
  }
  if (finite.empty()) return {};
  const auto count = static_cast<std::int64_t>(finite.size());
  double particle = particles.particle_radius;
  for (std::size_t i = 0; i < particles.radius.size(); ++i) {
    const float own = particles.radius[i];
    if (std::isfinite(own)) particle = std::max(particle, static_cast<double>(own));
  }
  return extent_of(bounds, std::move(finite), particle, count);
}

Extent extent_of(const ParticleSource& source) {
  if (const BorrowedParticles* all = source.in_memory()) return extent_of(*all);
  const Survey& survey = survey_of(source);
  if (survey.finite == 0) return {};
  return extent_of({survey.low, survey.high}, survey.sample,
                   std::max(source.particle_radius(), double{survey.largest_radius}),
                   survey.finite);
}

Camera frame_extents(const std::vector<Extent>& extents, const Framing& framing) {
  check(framing);
  Extent all;
  for (const Extent& extent : extents) {
    if (extent.bounds.low[0] > extent.bounds.high[0]) continue;
    all.bounds.include(extent.bounds.low);
    all.bounds.include(extent.bounds.high);
    all.particle = std::max(all.particle, extent.particle);
  }
  if (all.bounds.low[0] > all.bounds.high[0]) return frame_nothing(framing);
  return frame_bounds(all.bounds, all.particle, framing);
}

}  // namespace

Camera frame_particles(const BorrowedParticles& particles, const Framing& framing) {
  return frame_extents({extent_of(particles)}, framing);
}

Camera frame_particles(const Particles& particles, const Framing& framing) {
  check(particles);
  return frame_particles(BorrowedParticles(particles), framing);
}

Camera frame_particles(const ParticleSource& source, const Framing& framing) {
  return frame_sources({&source}, framing);
}

Camera frame_sources(const std::vector<const ParticleSource*>& sources, const Framing& framing) {
  std::vector<Extent> extents;
  for (const ParticleSource* source : sources) extents.push_back(extent_of(*source));
  return frame_extents(extents, framing);
}

void check(const Camera& camera) {
  require(camera.width >= 1 && camera.height >= 1 && camera.width <= kLargestSide &&
              camera.height <= kLargestSide,
          "camera: size is " + std::to_string(camera.width) + "x" + std::to_string(camera.height) +
              " pixels, each side must be 1 to " + std::to_string(kLargestSide));
  for (int k = 0; k < 16; ++k) {
    require(std::isfinite(camera.view[k]),
            entry("view", k) + " is " + number(camera.view[k]) + ", must be a finite number");
    require(std::isfinite(camera.projection[k]), entry("projection", k) + " is " +
                                                     number(camera.projection[k]) +
                                                     ", must be a finite number");
  }
  const auto& v = camera.view;  // the sums with 0 below leave out the sign of zeros
  require(v[3] != 0 || v[7] != 0 || v[11] != 0 || v[15] != 1 ||
              (v[12] == 0 && v[13] == 0 && v[14] == 0),
          "camera: view is transposed: its last row is " + number(v[12] + 0) + " " +
              number(v[13] + 0) + " " + number(v[14] + 0) +
              " 1 and its last column 0 0 0 1; the last row must be 0 0 0 1 (write the matrix row "
              "by row, for column vectors)");
  for (int k = 12; k < 16; ++k)
    require(camera.view[k] == (k == 15 ? 1 : 0),
            entry("view", k) + " is " + number(camera.view[k]) + ", the last row must be 0 0 0 1");
  using Matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  const Eigen::Matrix3d rotation =
      Eigen::Map<const Matrix>(camera.view.data()).topLeftCorner<3, 3>();
  require(
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3,
      "camera: view is singular or scales: its upper left 3x3 must be a rotation");
  require(rotation.determinant() > 0,
          "camera: view mirrors: its upper left 3x3 must be a rotation with determinant 1");

  const auto& p = camera.projection;
  // Against the entries that it is made of alone: depths in p[11] may be a billion times as large.
  const double scale =
      Eigen::Map<const Matrix>(p.data()).topLeftCorner<2, 2>().cwiseAbs().maxCoeff();
  require(std::abs(p[0] * p[5] - p[1] * p[4]) > 1e-12 * scale * scale &&
              std::abs(Eigen::Map<const Matrix>(p.data()).determinant()) > 0,
          "camera: projection is singular");
  const bool perspective = p[12] == 0 && p[13] == 0 && p[14] < 0 && p[15] == 0;
  const bool orthographic = p[12] == 0 && p[13] == 0 && p[14] == 0 && p[15] > 0;
  require(perspective || orthographic,
          "camera: the last row of projection is " + number(p[12]) + " " + number(p[13]) + " " +
              number(p[14]) + " " + number(p[15]) +
              ", must be 0 0 -1 0 (perspective) or 0 0 0 1 (orthographic)");
  require(!(perspective && p[11] == -1 && p[14] != -1),
          "camera: projection is transposed: its last row is 0 0 " + number(p[14]) +
              " 0 and its last column ends in -1 0; the last row must be 0 0 -1 0 (write the "
              "matrix row by row, for column vectors)");
}

double pixel_aspect_ratio(const Camera& camera) {
  constexpr double kRounded = 0.02;
  const auto& p = camera.projection;
  const double across = std::hypot(p[0], p[1]) * camera.width,
               down = std::hypot(p[4], p[5]) * camera.height;
  return std::abs(across / down - 1) < kRounded ? 1 : down / across;
}

}  // namespace meniscus
