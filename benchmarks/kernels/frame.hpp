// The frame that the kernels are measured on, and what the pipeline's stages make of it.
#pragma once

#include <optional>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/project.hpp"
#include "stages/splash.hpp"
#include "stages/stage_data.hpp"
#include "stages/surface.hpp"
#include "stages/triangulate.hpp"
#include "stages/visible.hpp"

namespace meniscus::bench {

/// A synthetic frame (frame/input.hpp) of any number of particles, in canonical order. Each stage
/// runs when its result is first asked for, with the default parameters of method fit.
class Frame {
 public:
  Frame(Device& device, long long particles, int width, int height);

  Device& device;
  const Parameters params;
  const long long particles;
  View view;
  WorldParticles world;

  const Projected& projected();
  const SplashSplit& split();
  const Visible& visible();
  const Triangulation& mesh();
  const std::vector<Vec3d>& normals();  // first normals of the visible particles

 private:
  std::optional<Projected> projected_;
  std::optional<SplashSplit> split_;
  std::optional<Visible> visible_;
  std::optional<Triangulation> mesh_;
  std::optional<std::vector<Vec3d>> normals_;
};

}  // namespace meniscus::bench
