// fair_normals, along rows and along columns, on the frame's surface.
#include <cmath>
#include <memory>

#include "kernels/cases.hpp"
#include "stages/sample/fairing.hpp"

namespace meniscus::bench {
namespace {

// Neighbours that samples look at in both directions, all together, there or not.
double count_neighbours(const View& view, const SurfaceMap& image, double sigma) {
  double count = 0;
  for (int j = 0; j < image.grid.ny; ++j)
    for (int i = 0; i < image.grid.nx; ++i) {
      const double t = image.depth[static_cast<std::size_t>(j) * image.grid.nx + i];
      if (!(t < kNoSurface)) continue;
      const Vec3d at = point_at(view, i + 0.5, j + 0.5, t);
      for (const auto& [u, v] : {std::pair{1.5, 0.5}, std::pair{0.5, 1.5}}) {
        const double apart = length(point_at(view, i + u, j + v, t) - at) / sigma;
        const double step = std::exp2(std::floor(std::max(0.0, std::log2(1.4 / apart))));
        count += 2 * std::min(3.0, std::floor(2.65 / (step * apart)));
      }
    }
  return count;
}

}  // namespace

Case prepare_fairing(Frame& frame) {
  const SurfaceMap& image = frame.frames(Method::fit).image;
  const double sigma = frame.params.fairing;
  const auto surface = std::make_shared<SurfaceBuffers>(upload(frame.device, image));
  Case result{.unit = "pixels"};
  for (const float t : image.depth) result.items += t < kNoSurface;
  // Twice: all depths, the surface's normals read, and as many written.
  result.bytes = 2 * (4.0 * static_cast<double>(image.depth.size()) + 24 * result.items);
  // A neighbour: place 9, height and distance 16, weight 20, sums 20. A sample, twice: its steps
  // 5, the parabola 50, its length 11.
  result.operations = 65 * count_neighbours(frame.view, image, sigma) + 2 * 66 * result.items;
  result.launch = [&frame, surface, sigma] {
    fair_normals(frame.device, frame.view, *surface, sigma);
  };
  return result;
}

}  // namespace meniscus::bench
