// Analytic solids to measure against: signed distances, bounds and a camera each. The unit of
// length is s, the particle spacing; one world unit is one s, and a particle's radius is 0.5.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "accuracy/splash.hpp"
#include "meniscus/types.hpp"
#include "stages/vec.hpp"

namespace meniscus::accuracy {

inline constexpr double kParticleRadius = 0.5;  // s

/// What a scene is for. Calm scenes are for both, apart by their seeds; of the violent ones some
/// had a say in the choice of constants, and the others none.
enum class Use { calm, tuning, reporting };

struct Scene {
  std::string name;
  Use use = Use::calm;
  std::function<double(const Vec3d&)> distance;  // s; to the surface, negative inside
  double safe_step = 1;           // this share of `distance` never reaches beyond the surface
  std::vector<Piece> splash;      // particles that hover about the solid and are no part of it
  Vec3d low, high;                // s; the solid lies in this box
  Vec3d eye, target;              // s; the camera, z is up
  double focal = 0;               // pixels
  bool smooth = false;            // no crease worth measuring
  int width = 640, height = 480;  // pixels
};

/// Smooth ones: sphere, ellipsoid, torus, bowl (half a shell), waves (bent), longwaves, shortwaves,
/// mixedwaves and splash (a blob with spray about it). With creases: plane (a tilted slab), dam (a
/// broken dam's front), box (rotated), notch (a cube without one octant: corners of three sheets),
/// prism (convex creases of 30 to 90 degrees), capsules (concave ones of 30 to 105, with corners),
/// boxpool (a box in a pool), twolayer (a plate over a pool) and sheet (one or two layers thick,
/// before a pool).
const std::vector<Scene>& scenes();

/// See violent.hpp.
const std::vector<Scene>& violent_scenes();

/// Solids with sharp edges that had no say in any constant: cylinder, cone, octahedron,
/// tetrahedron, ring, stairs, slab (four s thick), drilled (a block with a round hole), lens (two
/// balls' intersection), pit (a block without a part of a ball) and ballslab (a ball in a slab).
const std::vector<Scene>& held_out_scenes();

/// Of any kind. Throws InvalidArgument, with the names there are.
const Scene& find_scene(std::string_view name);

/// Names of scenes, where a word may also be calm (scenes()), held-out, violent,
/// violent-tuning or violent-reporting. Throws InvalidArgument, with the names there are.
std::vector<std::string> scenes_named(const std::vector<std::string>& words);

/// The scene from where seed `seed` sees it: the eye turns about the vertical through the target by
/// up to 30 degrees and rises or sinks by up to 5. Seed 1 has the scene's own camera.
Scene posed(Scene scene, std::uint64_t seed);

/// The scene with a focal length that shows one s at the target as `scale` pixels. The image grows
/// and shrinks with it, but stays within 960 x 720: fine scales show the middle.
Scene scaled(Scene scene, double scale);

/// The scene from `factor` times as far, the target as large as before.
Scene moved_back(Scene scene, double factor);

/// Outward unit normal at a point near the surface that `distance` is zero on.
Vec3d outward(const std::function<double(const Vec3d&)>& distance, const Vec3d& point);

/// Volume of the solid, s^3. The error is about (h / 2R)^2 of it at a radius of curvature R, with
/// h = 1/8 s.
double volume(const Scene& scene);

/// The scene's camera, written out so that the truth shares no code with the library's cameras.
/// Pixel (i, j) has its centre at (i + 0.5, j + 0.5), row 0 on top. Depth is the distance along
/// the camera axis, as in Surface.
struct Lens {
  int width = 0, height = 0;
  bool orthographic = false;
  double focal = 0;  // pixels; for an orthographic camera pixels per s
  Vec3d eye, right, down, forward;

  /// Pixels that a length of one s spans at `depth`.
  double scale(double depth) const { return orthographic ? focal : focal / depth; }
  Vec3d origin(int i, int j) const;
  /// d(point) / d(depth); not of unit length.
  Vec3d direction(int i, int j) const;
  Vec3d point(int i, int j, double depth) const { return origin(i, j) + depth * direction(i, j); }
  /// The same of pixel j * width + i.
  Vec3d direction(std::size_t pixel) const { return direction(column_of(pixel), row_of(pixel)); }
  Vec3d point(std::size_t pixel, double depth) const {
    return point(column_of(pixel), row_of(pixel), depth);
  }
  int column_of(std::size_t pixel) const { return static_cast<int>(pixel) % width; }
  int row_of(std::size_t pixel) const { return static_cast<int>(pixel) / width; }
  /// Where the image shows the point: columns and rows from the first pixel's centre, and its
  /// depth.
  Vec3d project(const Vec3d& point) const;
  /// Index of the pixel that shows the point; none: it is outside the image or behind the eye.
  std::optional<std::size_t> pixel(const Vec3d& point) const;
};

/// The camera of `scene`, its eye moved to the right by `shift` (s), its axes unchanged.
/// Orthographic cameras show the target at the same scale as perspective ones.
Lens lens_of(const Scene& scene, bool orthographic = false, double shift = 0);

/// The same camera as the library takes it.
Camera camera_of(const Lens& lens);

}  // namespace meniscus::accuracy
