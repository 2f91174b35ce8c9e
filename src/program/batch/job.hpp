// The job that a frame's outputs carry: by it a batch that resumes knows its own.
#pragma once

#include <string>

#include "program/batch/run.hpp"

namespace meniscus {

/// What a frame's outputs depend on, as the 64 hex digits that they carry, 16 each of: the program;
/// the parameters and how outputs are written; the frame's camera and the next one's; and of each
/// file of the input and of its whitewater the name, size, time and content, of which 16 MiB are
/// looked at. Throws InputError where one cannot be read.
std::string job_of(const FrameJob& job, const Camera& camera, const Camera& next_camera,
                   const BatchSettings& settings);

/// What is wrong with an output, as flaw_of(); of another job also what of it differs. Empty:
/// nothing is.
std::string flaw_in_detail(const std::string& path, const std::string& job);

}  // namespace meniscus
