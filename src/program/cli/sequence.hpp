// `extract` of a sequence of frames.
#pragma once

#include "program/batch/pattern.hpp"
#include "program/cli/extract_options.hpp"

namespace meniscus::cli {

/// Exit codes of a sequence beside those of a frame. 33 stays unused: render farms take it for a
/// lack of memory.
inline constexpr int kSomeFailed = 3;         // frames failed; all others are done
inline constexpr int kStoppedBySignal = 128;  // plus the signal; the frames begun are done

/// Extracts the frames of `input`; under mpirun each process its part of them. Returns the exit
/// code. Throws what ends a sequence before or between frames: bad usage, a missing frame, a full
/// disk.
int run_sequence(const ExtractOptions& options, const FramePattern& input);

}  // namespace meniscus::cli
