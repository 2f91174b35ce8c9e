#include "accuracy/figures/mesh_distance.hpp"

namespace meniscus::accuracy {

MeshDistance mesh_distance(const Scene& scene, const Truth& truth, const Mesh& mesh) {
  const Lens& lens = truth.lens;
  Moments inside, outline;
  std::vector<double> sizes;
  for (const Vec3& vertex : mesh.position) {
    const Vec3d point(vertex), from_eye = point - lens.eye;
    const double depth = dot(from_eye, lens.forward);
    if (!(depth > 0)) continue;
    const double x = std::floor(0.5 * lens.width + dot(from_eye, lens.right) * lens.scale(depth));
    const double y = std::floor(0.5 * lens.height + dot(from_eye, lens.down) * lens.scale(depth));
    if (!(x >= 0 && y >= 0 && x < lens.width && y < lens.height)) continue;
    const double distance = clamped(scene.distance(point));
    const auto pixel = static_cast<std::size_t>(y) * lens.width + static_cast<std::size_t>(x);
    switch (truth.class_of[pixel]) {
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
