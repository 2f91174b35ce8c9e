#include "kernels/frame.hpp"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <tuple>

#include "base/elapsed.hpp"
#include "frame/input.hpp"
#include "stages/frame/density.hpp"
#include "stages/sheet/smooth_normals.hpp"
#include "stages/sheet/surface.hpp"

namespace meniscus::bench {
namespace {

// Milliseconds of all launches of each kernel.
std::map<std::string, double> sums_of(const std::vector<StageTime>& stages) {
  std::map<std::string, double> sums;
  for (const StageTime& stage : stages)
    for (const auto& [kernel, ms] : stage.kernels) sums[kernel] += ms;
  return sums;
}

}  // namespace

Frame::Frame(Device& device_, long long particles_, int width, int height)
    : device(device_), particles(particles_) {
  device.state().discs = DiscForm::bins;  // what draws by minima has rows of its own
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
  for (const std::size_t k : order)
    add_position(world, {positions.x[k], positions.y[k], positions.z[k]});
}

const Projected& Frame::projected() {
  const double margin =
      std::max(params.region.reference, params.visible.footprint) + kDensitySupport;
  if (!projected_) projected_ = project_particles(view, world, margin);
  return *projected_;
}

const SplashSplit& Frame::split() {
  if (!split_) split_ = split_splash(projected(), cells(), params.splash);
  return *split_;
}

const Visible& Frame::seen() {
  if (!seen_)
    seen_ = find_visible(device, view, projected(), split().body, params.visible, kLeastFitted);
  return *seen_;
}

const Triangulation& Frame::mesh() {
  if (!mesh_)
    mesh_ =
        triangulate(view, projected(), more_visible(seen(), params.visible.owned), params.triangle);
  return *mesh_;
}

const std::vector<Vec3d>& Frame::normals() {
  if (!normals_) {
    const NormalSources sources =
        normal_sources(projected(), seen(), mesh(), without_descent(seen(), found()));
    normals_ = first_normals(view, projected(), seen(), mesh(),
                             smooth_normals(mesh(), params.merge.smoothing_rounds, sources.vertex),
                             sources);
  }
  return *normals_;
}

const Cells& Frame::cells() {
  if (!cells_) cells_ = make_cells(projected().x, projected().y, projected().z, kDensitySupport);
  return *cells_;
}

const FieldSurface& Frame::found() {
  if (!found_) {
    const Buffer<float> field =
        measure_gradients(device, upload_cells(device, cells()), Measured::near_air);
    found_ = find_surface(seen(), cells(), download(device, field));
  }
  return *found_;
}

const SurfaceParticles& Frame::surface() {
  if (!surface_) surface_ = with_normals(found(), seen(), normals());
  return *surface_;
}

const Visible& Frame::rim() {
  if (!rim_) rim_ = with_rim(projected(), seen(), found());
  return *rim_;
}

const ParticleFits& Frame::fits() {
  if (!fits_) fits_ = fit_particles(device, projected(), rim(), surface(), params.fit);
  return *fits_;
}

Extraction Frame::make_frame(Method method, std::vector<StageTime>* timings) {
  Parameters own = params;
  own.method = method;
  own.mesh = false;
  return run_pipeline(device, view, world, own, timings);
}

const Frame::Frames& Frame::frames(Method method) {
  if (const auto found = frames_.find(method); found != frames_.end()) return found->second;
  Frames& frames = frames_[method];
  frames.image = download(device, make_frame(method, nullptr).image);  // not timed
  const auto begin = std::chrono::steady_clock::now();
  const auto passed = [&](double s) { return seconds_since(begin) > s; };
  for (int k = 0; k < 3 || (k < repetitions && !passed(10 * seconds)); ++k) {
    std::vector<StageTime> stages;
    make_frame(method, &stages);
    for (const auto& [kernel, ms] : sums_of(stages)) frames.kernels[kernel].push_back(ms);
  }
  return frames;
}

const std::vector<double>& Frame::frame_ms(Method method, const std::string& kernel) {
  const Frames& all = frames(method);
  const auto found = all.kernels.find(kernel);
  if (found == all.kernels.end()) throw DeviceError("its method did not launch it");
  return found->second;
}

double Frame::next_frame_ms(Method method, const std::string& kernel) {
  std::vector<StageTime> stages;
  make_frame(method, &stages);
  return sums_of(stages)[kernel];
}

}  // namespace meniscus::bench
