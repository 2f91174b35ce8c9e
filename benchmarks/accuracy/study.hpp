// Running the library on the scenes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "accuracy/contenders.hpp"
#include "accuracy/figures.hpp"
#include "accuracy/motion.hpp"
#include "accuracy/particles.hpp"
#include "accuracy/scene.hpp"
#include "accuracy/truth.hpp"
#include "meniscus/extract.hpp"

namespace meniscus::accuracy {

/// What all cases of a study share.
struct Setup {
  double noise = 0.05;  // s; standard deviation of each coordinate
  Filling filling = Filling::relaxed;
  bool orthographic = false;
  double scale = 0;     // pixels that one s spans at the target; 0: the scene's own, 8 to 20
  double distance = 1;  // times as far away as the scene has it, the target as large as before
  // Each of these adds three more frames, whose flicker is measured.
  bool moving = false;  // the camera moves by 0.3 pixels to the right from frame to frame
  std::size_t moving_seeds = SIZE_MAX;  // it does so with the first so many seeds
  double jitter = 0;  // s; standard deviation of what moves each coordinate, anew in each frame
  // The water moves as a whole, and once more bends: three more frames each, with the first
  // moving_seeds seeds.
  bool flowing = false;
};

/// Water that moves under a camera that stays: the frames after the case's first.
struct Flow {
  double Figures::*rms;  // where what is measured goes
  double Figures::*p999;
  Motion motion;
  std::vector<Particles> particles;
  std::vector<Truth> truths;
};

/// One scene, filled with particles and traced.
struct Case {
  const Scene* scene = nullptr;
  std::uint64_t seed = 0;
  Particles particles;
  std::vector<Truth> truths;  // one a frame
  double jitter = 0;          // s; of the particles in all frames but the first
  std::vector<Flow> flows;
};

/// The scene with the camera that the setup and the seed give it.
Scene posed_for(const Scene& scene, const Setup& setup, std::uint64_t seed);

/// All scenes with all seeds, scene by scene. The same on any number of processors.
std::vector<Case> make_cases(const std::vector<std::string>& scene_names,
                             const std::vector<std::uint64_t>& seeds, const Setup& setup);

struct Measurement {
  Figures figures;
  Surface surface;     // of the first frame
  double seconds = 0;  // wall time of extracting the first frame
};

/// Extracts every frame of the case and compares the first one with its truth; its mesh, too, when
/// it has one.
Measurement measure(const Extractor& extract, const Case& scene_case);

/// The same for a method of the library.
Measurement measure(Device& device, const Case& scene_case, const Parameters& parameters);

}  // namespace meniscus::accuracy
