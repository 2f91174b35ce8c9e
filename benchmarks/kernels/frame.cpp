#include "kernels/frame.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "frame/input.hpp"
#include "stages/density.hpp"
#include "stages/group.hpp"

namespace meniscus::bench {

Frame::Frame(Device& device_, long long particles_, int width, int height)
    : device(device_), particles(particles_) {
  const FrameInput input = synthetic_frame(particles, width, height);
  const Particles& positions = input.particles;
  // Around the middle of the tank.
  view = make_view(input.camera, positions.particle_radius, {1.5, 0.5, 0.75});
  std::vector<std::size_t> order(positions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto place = [&](std::size_t k) {
    return std::tie(positions.x[k], positions.y[k], positions.z[k]);
  };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return place(a) < place(b); });
  for (const std::size_t k : order) {
    world.x.push_back(positions.x[k]);
    world.y.push_back(positions.y[k]);
    world.z.push_back(positions.z[k]);
  }
}

const Projected& Frame::projected() {
  const double margin =
      std::max(params.region.reference, params.visible.footprint) + kDensitySupport;
  if (!projected_) projected_ = project_particles(device, view, world, margin);
  return *projected_;
}

const SplashSplit& Frame::split() {
  if (!split_) split_ = split_splash(projected(), params.splash);
  return *split_;
}

const Visible& Frame::visible() {
  if (!visible_)
    visible_ =
        find_visible(device, view, projected(), split().body, params.visible, params.visible.owned);
  return *visible_;
}

const Triangulation& Frame::mesh() {
  if (!mesh_) mesh_ = triangulate(view, projected(), visible(), params.triangle);
  return *mesh_;
}

const std::vector<Vec3d>& Frame::normals() {
  if (!normals_)
    normals_ = first_normals(view, projected(), visible(), mesh(),
                             smooth_normals(mesh(), params.merge.smoothing_rounds));
  return *normals_;
}

}  // namespace meniscus::bench
