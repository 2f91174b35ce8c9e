// Closed meshes whose truth is known: rings with a section of any shape.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "meniscus/types.hpp"
#include "stages/vec.hpp"

namespace meniscus {

inline constexpr double kUnit = 0.01;  // world units; edges of these meshes are about as long

// A ring of `around` copies of a section, of points (outward, up) in units and in order. Each
// vertex is off by up to `noise` units; `values`: with velocities and an attribute.
inline Mesh ring_of(int around, const std::vector<std::array<double, 2>>& section,
                    const std::vector<double>& noise, bool values) {
  const int across = static_cast<int>(section.size());
  const double radius = around / (2 * std::numbers::pi);
  std::mt19937 random(5);
  Mesh mesh;
  for (int i = 0; i < around; ++i)
    for (std::size_t j = 0; j < section.size(); ++j) {
      const double angle = 2 * std::numbers::pi * i / around;
      const auto off = [&] {
        return noise[j] * (static_cast<double>(random()) / 2147483648.0 - 1);
      };
      const double r = radius + section[j][0] + off();
      mesh.position.push_back(
          static_cast<Vec3>(Vec3d{7 + kUnit * r * std::cos(angle), kUnit * r * std::sin(angle),
                                  kUnit * (section[j][1] + off())}));
    }
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>(i % around * across + j % across);
  };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      mesh.triangle.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangle.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  std::vector<Vec3d> normal(mesh.position.size());
  for (const auto& t : mesh.triangle) {
    const Vec3d a(mesh.position[t[0]]);
    const Vec3d area = cross(Vec3d(mesh.position[t[1]]) - a, Vec3d(mesh.position[t[2]]) - a);
    for (const std::uint32_t v : t) normal[v] += area;
  }
  for (const Vec3d& n : normal) mesh.normal.push_back(static_cast<Vec3>(normalized(n)));
  if (!values) return mesh;
  for (const Vec3& p : mesh.position) mesh.velocity.push_back({p.x, 2 * p.y, 0});
  mesh.attributes.push_back({"heat", std::vector<float>(mesh.position.size(), 3.0f)});
  return mesh;
}

// A square with sides of `side` units, which begin at its corners.
inline std::vector<std::array<double, 2>> square(int side) {
  std::vector<std::array<double, 2>> section;
  const double half = 0.5 * side;
  for (int j = 0; j < 4 * side; ++j) {
    const double on = j % side;
    switch (j / side) {
      case 0:
        section.push_back({half, on - half});
        break;
      case 1:
        section.push_back({half - on, half});
        break;
      case 2:
        section.push_back({-half, half - on});
        break;
      default:
        section.push_back({on - half, -half});
    }
  }
  return section;
}

// A ring of square section has flat faces, four creases and, of 240, more vertices than one tile
// holds.
inline Mesh square_ring(int around, int side, double noise) {
  return ring_of(around, square(side),
                 std::vector<double>(4 * static_cast<std::size_t>(side), noise), true);
}

}  // namespace meniscus
