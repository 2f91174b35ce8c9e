#include "accuracy/figures/mesh_distance.hpp"

#include <algorithm>

namespace meniscus::accuracy {
namespace {

bool is_spray(const Scene& scene, const Vec3d& vertex) {
  return std::any_of(scene.splash.begin(), scene.splash.end(),
                     [&](const Piece& piece) { return density(piece, vertex) > 0; });
}

}  // namespace

MeshDistance mesh_distance(const Scene& scene, const Truth& truth, const Mesh& mesh) {
  Moments inside, outline;
  std::vector<double> sizes;
  for (const Vec3& vertex : mesh.position) {
    const auto pixel = truth.lens.pixel(Vec3d(vertex));
    if (!pixel || is_spray(scene, Vec3d(vertex))) continue;
    const double distance = clamped(scene.distance(Vec3d(vertex)));
    switch (truth.class_of[*pixel]) {
      case PixelClass::interior:
      case PixelClass::crease:
      case PixelClass::splash:
        inside.add(distance);
        sizes.push_back(std::abs(distance));
        break;
      case PixelClass::silhouette:
      case PixelClass::none:
        outline.add(distance);
        break;
    }
  }
  MeshDistance result;
  result.rms = inside.rms();
  result.p95 = percentile(sizes, 0.95);
  result.p999 = percentile(sizes, 0.999);
  result.outline_rms = outline.rms();
  return result;
}

}  // namespace meniscus::accuracy
