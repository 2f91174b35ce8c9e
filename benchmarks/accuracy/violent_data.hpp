// Simulated frames that violent scenes are made of.
#pragma once

#include <string_view>

namespace meniscus {

/// The files that the benchmark carries: frame_012.ply (a cube that fell into a pool),
/// frame_015.ply and dam_break_frame_9_6859_particles.bgeo (breaking dams).
std::string_view violent_file(std::string_view name);

}  // namespace meniscus
