// The water of simulated frames as solids. The frame's particles give a density, whose surface is
// smoothed over their spacing; the solid is filled with other, finer particles.
#include <algorithm>
#include <cmath>

#include "accuracy/splash.hpp"
#include "accuracy/violent.hpp"
#include "accuracy/violent_data.hpp"
#include "io/readers.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kLevel = 0.4;   // of the density inside
constexpr double kSmooth = 0.5;  // spacings of the frame
constexpr double kRoom = 4;      // s around the frame's particles

struct Box {
  Vec3d low, high;
};

/// The frame's particles in s, z up, the middle of their box at the origin; `spacing` of them is
/// one particle spacing of the frame.
std::vector<Vec3d> points_of(const Particles& particles, double frame_spacing, double spacing) {
  const double unit = frame_spacing / spacing;  // world units in one s
  std::vector<Vec3d> points;
  Vec3d low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const Vec3d p = Vec3d{particles.x[k], -particles.z[k], particles.y[k]} / unit;  // y was up
    points.push_back(p);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  for (Vec3d& p : points) p = p - (low + high) / 2;
  return points;
}

Box box_of(const std::vector<Vec3d>& points) {
  Box box{{}, {}};  // it holds the origin
  for (const Vec3d& p : points) {
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
  }
  const Vec3d room{kRoom, kRoom, kRoom};
  return {box.low - room, box.high + room};
}

/// kLevel less the density of points that are one `spacing` apart.
Field thinness(const std::vector<Vec3d>& points, double spacing, const Box& box) {
  Field field = sampled([](const Vec3d&) { return kLevel; }, box.low, box.high);
  const double reach = 2 * spacing;
  for (const Vec3d& p : points) {
    const Vec3d first = (p - field.low - Vec3d{reach, reach, reach}) / kGridStep;
    const Vec3d last = (p - field.low + Vec3d{reach, reach, reach}) / kGridStep;
    const auto from = [](double x) { return std::max(static_cast<int>(std::ceil(x)), 0); };
    const auto to = [](double x, int n) { return std::min(static_cast<int>(x), n - 1); };
    for (int k = from(first.z); k <= to(last.z, field.count[2]); ++k)
      for (int j = from(first.y); j <= to(last.y, field.count[1]); ++j)
        for (int i = from(first.x); i <= to(last.x, field.count[0]); ++i)
          field.value[field.index(i, j, k)] -=
              static_cast<float>(density({p / spacing}, field.node(i, j, k) / spacing));
  }
  return field;
}

}  // namespace

std::vector<Scene> make_frame_scenes() {
  struct Frame {
    const char *name, *file;
    double spacing;  // of its particles, s
  };
  std::vector<Scene> all;
  for (const Frame& frame :
       {Frame{"impact", "frame_012.ply", 2}, Frame{"wall", "frame_015.ply", 1.25},
        Frame{"gate", "dam_break_frame_9_6859_particles.bgeo", 2}}) {
    constexpr double kSpacing = 0.05;  // of all three, world units
    const Particles particles =
        particles_of({frame.file, std::string(violent_file(frame.file))}, kSpacing / 2);
    const std::vector<Vec3d> points = points_of(particles, kSpacing, frame.spacing);
    const Box box = box_of(points);
    Scene& scene = all.emplace_back();
    scene.name = frame.name;
    scene.use = Use::reporting;
    scene.distance = rounded([=] {
      const Field surface = distances(thinness(points, frame.spacing, box));
      return blurred(surface, kSmooth * frame.spacing);
    });
    scene.low = box.low;
    scene.high = box.high;
    scene.eye = length(box.high - box.low) * Vec3d{0.75, -0.9, 0.62};
    scene.target = {0, 0, -4};
    scene.focal = 1350;
  }
  return all;
}

}  // namespace meniscus::accuracy
