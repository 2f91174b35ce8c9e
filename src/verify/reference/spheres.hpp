// Spheres along rays, in double precision.
#pragma once

#include <cmath>

#include "stages/frame/project.hpp"
#include "stages/stage_data.hpp"

namespace meniscus::reference {

struct SphereHit {
  double depth = kNoSurface;
  Vec3d normal;
  double margin = 1e9;  // how near any ray came to a sphere's rim: |1 - distance / radius|
};

/// The nearest point of |X - c| = radius on the ray of pixel (u, v), of all particles.
inline SphereHit cast_ray(const View& view, const Projected& particles, double footprint, double u,
                          double v) {
  SphereHit hit;
  const Vec3d from = point_at(view, u, v, 0), along = ray_direction(view, u, v);
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const Vec3d c = particles.eye(p);
    const double radius = footprint * particles.scale[p];
    // The foot of the centre on the ray, and the distance back to the sphere.
    const double foot = dot(c - from, along) / dot(along, along);
    const double distance = length(from + foot * along - c);
    hit.margin = std::min(hit.margin, std::abs(1 - distance / radius));
    if (distance > radius) continue;
    const double half = std::sqrt((radius * radius - distance * distance) / dot(along, along));
    const double t = foot - half;
    if (t > 0 && t < hit.depth) {
      hit.depth = t;
      hit.normal = (from + t * along - c) / radius;
    }
  }
  return hit;
}

}  // namespace meniscus::reference
