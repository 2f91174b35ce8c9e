// The plain data that goes in and comes out: particles, camera, surface maps, mesh.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "meniscus/export.hpp"
#include "meniscus/notice.hpp"

namespace meniscus MENISCUS_API {

struct Vec3 {
  float x = 0, y = 0, z = 0;
  bool operator==(const Vec3&) const = default;
};

/// One number of each particle, pixel or vertex beside those that have arrays of their own, such as
/// a temperature. The components of a vector are several: force.X, force.Y, force.Z.
struct Attribute {
  std::string name;
  std::vector<float> values;  // [particles, pixels or vertices]
};

/// One frame of a particle simulation, as structure of arrays. Every optional array is empty or
/// has one entry a particle.
struct Particles {
  std::vector<float> x, y, z;           // [n] position, world units
  std::vector<float> vx, vy, vz;        // [n] velocity, world units per second; optional
  std::vector<float> density;           // [n] mass density as the file has it; optional
  std::vector<float> radius;            // [n] particle radius, world units; optional
  std::vector<std::int64_t> id;         // [n] identity over time; optional
  double particle_radius = 0;           // world units, as the file states it; 0: the file does not
  double time = 0;                      // seconds, as the file states it; 0: the file does not
  std::vector<Attribute> attributes{};  // interpolated on the surface; NaN: not known

  std::size_t size() const { return x.size(); }
};

/// A camera in the OpenGL convention: clip = projection * view * x, column vectors, the eye looks
/// down -z, clip z in [-w, w]. Perspective or orthographic. Matrices are row-major.
struct Camera {
  int width = 0;                        // pixels
  int height = 0;                       // pixels
  std::array<double, 16> view{};        // world -> eye space, rigid
  std::array<double, 16> projection{};  // eye -> clip space
};

/// Triangles with a normal at each vertex, in world space.
struct Mesh {
  std::vector<Vec3> position;                          // [vertices] world units
  std::vector<Vec3> normal;                            // [vertices] unit, outward
  std::vector<Vec3> velocity;                          // [vertices] world units per second; empty
                                                       // where the particles carry none
  std::vector<std::array<std::uint32_t, 3>> triangle;  // counter-clockwise seen from outside
  std::vector<Attribute> attributes{};                 // [vertices] those of the particles
};

/// How far what a pixel shows moves on the screen until the next frame.
struct ScreenMotion {
  std::vector<std::array<float, 2>> pixels;  // to the right and down; zero where is no surface
  double frames_per_second = 0;
};

/// How many there were of what; -1: the method has none of these.
struct Counts {
  std::int64_t particles = -1;        // with finite coordinates; of frames that stream: all
  std::int64_t in_view = -1;          // where `streamed`: those that the front is made of
  std::int64_t splash = -1;           // particles in small connected components
  std::int64_t visible = -1;          // particles that own a share of the image
  std::int64_t triangles = -1;        // between visible particles, on the screen
  std::int64_t groups = -1;           // of merged particles
  std::int64_t fits = -1;             // quadrics
  std::int64_t representatives = -1;  // that stand for the particles of a thinned frame
  std::int64_t spray = -1;            // drops of a thinned frame that are too small for its surface
  std::int64_t pixels = -1;           // that show something
  std::int64_t whitewater = -1;       // particles of foam, spray and bubbles, seen or not
  bool streamed = false;              // extract() was given 2^18 particles or more
  bool operator==(const Counts&) const = default;
};

/// Those that a method has, by name, in order: {"in view", 4913} ...
std::vector<std::pair<std::string, std::int64_t>> named(const Counts& counts);

/// What a pixel shows.
enum class Kind : std::uint8_t { none = 0, surface = 1, splash = 2 };

/// Where the ray of each pixel enters and leaves the bodies of fluid along it (Parameters::layers).
/// An interval lies behind the one before it, and is never empty.
struct Layers {
  int most = 0;                      // intervals that are kept of a pixel; 0: not asked for
  std::vector<std::uint32_t> count;  // [pixels] of all bodies along the ray, kept or not; 0 where
                                     // there is no surface
  std::vector<float> thickness;      // [pixels] fluid along the ray, of all bodies, world units; 0
                                     // where there is no surface
  std::vector<float> entry, exit;    // [most][pixels] planar distance along the camera axis, world
                                     // units; +infinity where there are fewer. The first entry is
                                     // the surface's depth, bit for bit
  std::vector<Vec3> back_normal;     // [pixels] at the first exit: unit, outward, world axes; 0
                                     // where there is no surface
};

/// Particles that water carries: foam on it, spray above it, bubbles in it.
enum class WhitewaterType : std::uint8_t { foam = 0, spray = 1, bubble = 2 };
// All types, in order. Not inline: a shared library would show its name.
[[maybe_unused]] constexpr std::array kWhitewaterTypes{WhitewaterType::foam, WhitewaterType::spray,
                                                       WhitewaterType::bubble};

/// What pixels show of one type of whitewater. Water hides it, other whitewater does not: each type
/// is drawn by itself. See draw_whitewater() (whitewater.hpp).
struct WhitewaterMaps {
  WhitewaterType type = WhitewaterType::foam;
  std::vector<float> coverage{};  // [pixels] share of the pixel that is covered, 0 to 1, where
                                  // discs lie over each other by chance: 1 less the product of what
                                  // each leaves free
  std::vector<float> density{};   // [pixels] sum of the shares that discs cover
  std::vector<float> depth{};  // [pixels] of the nearest disc, as Surface::depth; +infinity: none
  std::vector<Vec3>
      velocity{};  // [pixels] mean over the discs, weighed by their shares, world axes,
                   // world units per second; 0: none; empty where they carry none
  std::vector<float> behind{};  // [pixels] of bubbles: mean depth behind the surface's, weighed as
                                // velocity is, world units; 0: none; empty of foam and spray
};

/// The surface seen by the camera: maps of width x height sampled at pixel centres, row 0 on top,
/// stored at row * width + column, and the mesh.
struct Surface {
  Camera camera;
  std::vector<float> depth;          // planar distance along the camera axis, world units, > 0;
                                     // +infinity where there is no surface
  std::vector<Vec3> normal;          // unit, outward, world axes; zero where there is no surface
  std::vector<Vec3> position;        // world units; zero where there is no surface
  std::vector<std::uint32_t> group;  // the group that weighs most, counted from 1; 0: none
  std::vector<Kind> kind;            // none, surface or splash
  std::vector<float> residual;       // the group's RMS fit residual, in particle radii; 0: none
  std::vector<Vec3> velocity;        // world axes, world units per second; zero where there is no
                                     // surface; empty where the particles carry none
  ScreenMotion forward;              // empty unless asked for (motion.hpp)
  Layers layers;                     // empty unless asked for
  Mesh mesh;

  double particle_radius = 0;  // world units, as it was used
  Counts counts;
  std::vector<Notice> notices;  // what was dropped or estimated, or looks wrong

  std::vector<Attribute> attributes{};  // [pixels] those of the particles; zero where there is no
                                        // surface
  std::vector<WhitewaterMaps> whitewater{};  // by type; empty unless asked for (whitewater.hpp)
  double disorder = 0;  // how irregularly the particles lay, as Parameters::disorder; 0 where the
                        // method does not relax them
};

}  // namespace MENISCUS_API
