// The frame that the kernels are measured on, and what the pipeline's stages make of it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "api/pipeline.hpp"
#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/project.hpp"
#include "stages/frame/splash.hpp"
#include "stages/frame/visible.hpp"
#include "stages/sheet/surface.hpp"
#include "stages/sheet/triangulate.hpp"
#include "stages/stage_data.hpp"

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
  const Visible& seen();  // the particles that may be fitted
  const Triangulation& mesh();
  const std::vector<Vec3d>& normals();  // first normals of those seen where the field is flat
  const Cells& cells();                 // of the projected particles
  const FieldSurface& found();
  const SurfaceParticles& surface();
  const Visible& rim();  // the particles that are fitted
  const ParticleFits& fits();

  /// What whole frames of a method take: of each kernel, the milliseconds of all its launches
  /// together in each frame. `repetitions` frames, or as many as ten times `seconds` allow, and
  /// at least three.
  struct Frames {
    std::map<std::string, std::vector<double>> kernels;
    SurfaceMap image;
  };
  const Frames& frames(Method method);
  /// Of one kernel. Throws DeviceError when the method does not launch it.
  const std::vector<double>& frame_ms(Method method, const std::string& kernel);
  /// The same in one more frame.
  double next_frame_ms(Method method, const std::string& kernel);
  /// Makes one more frame, with times where they are asked for.
  Extraction make_frame(Method method, std::vector<StageTime>* timings);
  int repetitions = 20;
  double seconds = 0.3;

 private:
  std::optional<Projected> projected_;
  std::optional<SplashSplit> split_;
  std::optional<Visible> seen_, rim_;
  std::optional<Triangulation> mesh_;
  std::optional<std::vector<Vec3d>> normals_;
  std::optional<Cells> cells_;
  std::optional<FieldSurface> found_;
  std::optional<SurfaceParticles> surface_;
  std::optional<ParticleFits> fits_;
  std::map<Method, Frames> frames_;
};

}  // namespace meniscus::bench
