#include "accuracy/ray_cast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "accuracy/parallel.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kLeaf = 4;  // triangles

using Triple = std::array<double, 3>;

Triple triple(const Vec3d& v) { return {v.x, v.y, v.z}; }

struct Box {
  Triple low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  void add(const Triple& p) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
};

struct Ray {
  Vec3d origin, direction;
  Triple from, inverse;  // of the direction
};

struct Hit {
  double depth = kInfinity;
  std::uint32_t triangle = 0;
  double u = 0, v = 0;  // barycentric coordinates of the second and the third corner
};

/// A bounding volume hierarchy: halves by the middle of the longest axis.
class Hierarchy {
 public:
  explicit Hierarchy(const Mesh& mesh) : mesh_(mesh) {
    order_.resize(mesh.triangle.size());
    for (std::size_t k = 0; k < order_.size(); ++k) order_[k] = static_cast<std::uint32_t>(k);
    if (!order_.empty()) build(0, static_cast<int>(order_.size()));
  }

  Hit nearest(const Ray& ray) const {
    Hit hit;
    std::array<int, 64> open;
    int count = 0;
    if (!nodes_.empty()) open[count++] = 0;
    while (count > 0) {
      const Node& node = nodes_[open[--count]];
      if (entry(node.box, ray) >= hit.depth) continue;
      if (node.right > 0) {
        const int left = static_cast<int>(&node - nodes_.data()) + 1;
        const bool left_first = entry(nodes_[left].box, ray) < entry(nodes_[node.right].box, ray);
        open[count++] = left_first ? node.right : left;
        open[count++] = left_first ? left : node.right;
        continue;
      }
      for (int k = node.first; k < node.first + node.count; ++k) meet(order_[k], ray, hit);
    }
    return hit;
  }

 private:
  struct Node {
    Box box;
    int first = 0, count = 0;  // of a leaf
    int right = 0;             // of an inner node, whose left child is the next node; 0: a leaf
  };

  Vec3d corner(std::uint32_t triangle, int k) const {
    return Vec3d(mesh_.position[mesh_.triangle[triangle][k]]);
  }
  double middle(std::uint32_t triangle, int axis) const {
    return triple(corner(triangle, 0))[axis] + triple(corner(triangle, 1))[axis] +
           triple(corner(triangle, 2))[axis];
  }

  int build(int first, int last) {
    const int here = static_cast<int>(nodes_.size());
    nodes_.emplace_back();
    Box box;
    for (int k = first; k < last; ++k)
      for (int c = 0; c < 3; ++c) box.add(triple(corner(order_[k], c)));
    int right = 0;
    if (last - first > kLeaf) {
      int axis = 0;
      for (int k = 1; k < 3; ++k)
        if (box.high[k] - box.low[k] > box.high[axis] - box.low[axis]) axis = k;
      const int half = (first + last) / 2;
      std::nth_element(order_.begin() + first, order_.begin() + half, order_.begin() + last,
                       [&](std::uint32_t a, std::uint32_t b) {
                         const double x = middle(a, axis), y = middle(b, axis);
                         return x < y || (x == y && a < b);
                       });
      build(first, half);
      right = build(half, last);
    }
    nodes_[here] = {box, first, last - first, right};
    return here;
  }

  /// Depth at which the ray enters the box; infinity: it does not.
  static double entry(const Box& box, const Ray& ray) {
    double in = 0, out = kInfinity;
    for (int k = 0; k < 3; ++k) {
      const double a = (box.low[k] - ray.from[k]) * ray.inverse[k];
      const double b = (box.high[k] - ray.from[k]) * ray.inverse[k];
      if (std::isnan(a) || std::isnan(b)) continue;  // along the face of the box
      in = std::max(in, std::min(a, b));
      out = std::min(out, std::max(a, b));
    }
    return in <= out ? in : kInfinity;
  }

  /// Moeller and Trumbore 1997. The slack closes the seams between neighbours.
  void meet(std::uint32_t triangle, const Ray& ray, Hit& hit) const {
    constexpr double kSlack = 1e-9;
    const Vec3d a = corner(triangle, 0), ab = corner(triangle, 1) - a, ac = corner(triangle, 2) - a;
    const Vec3d p = cross(ray.direction, ac);
    const double determinant = dot(ab, p);
    if (determinant == 0) return;
    const Vec3d s = ray.origin - a;
    const double u = dot(s, p) / determinant;
    if (u < -kSlack || u > 1 + kSlack) return;
    const Vec3d q = cross(s, ab);
    const double v = dot(ray.direction, q) / determinant;
    if (v < -kSlack || u + v > 1 + kSlack) return;
    const double depth = dot(ac, q) / determinant;
    if (depth > 0 && depth < hit.depth) hit = {depth, triangle, u, v};
  }

  const Mesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

Vec3 normal_at(const Mesh& mesh, const Hit& hit) {
  const auto& [a, b, c] = mesh.triangle[hit.triangle];
  if (!mesh.normal.empty())
    return static_cast<Vec3>(normalized((1 - hit.u - hit.v) * Vec3d(mesh.normal[a]) +
                                        hit.u * Vec3d(mesh.normal[b]) +
                                        hit.v * Vec3d(mesh.normal[c])));
  const Vec3d first(mesh.position[a]);
  return static_cast<Vec3>(
      normalized(cross(Vec3d(mesh.position[b]) - first, Vec3d(mesh.position[c]) - first)));
}

}  // namespace

Map ray_cast(const Mesh& mesh, const Lens& lens) {
  const Hierarchy hierarchy(mesh);
  const std::size_t pixels = static_cast<std::size_t>(lens.width) * lens.height;
  Map map{std::vector<float>(pixels, static_cast<float>(kInfinity)), std::vector<Vec3>(pixels)};
  for_each_index(lens.height, [&](int j) {
    for (int i = 0; i < lens.width; ++i) {
      const Vec3d origin = lens.origin(i, j), direction = lens.direction(i, j);
      const Hit hit = hierarchy.nearest(
          {origin, direction, triple(origin), {1 / direction.x, 1 / direction.y, 1 / direction.z}});
      if (hit.depth == kInfinity) continue;
      const std::size_t p = static_cast<std::size_t>(j) * lens.width + i;
      map.depth[p] = static_cast<float>(hit.depth);
      map.normal[p] = normal_at(mesh, hit);
    }
  });
  return map;
}

Mesh visible_vertices(const Mesh& mesh, const Lens& lens, const Map& map, double slack) {
  Mesh seen;
  for (std::size_t k = 0; k < mesh.position.size(); ++k) {
    const auto pixel = lens.pixel(Vec3d(mesh.position[k]));
    if (!pixel) continue;
    const double depth = dot(Vec3d(mesh.position[k]) - lens.eye, lens.forward);
    if (depth > map.depth[*pixel] + slack) continue;
    seen.position.push_back(mesh.position[k]);
    if (!mesh.normal.empty()) seen.normal.push_back(mesh.normal[k]);
  }
  return seen;
}

}  // namespace meniscus::accuracy
