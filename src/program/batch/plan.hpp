// Which files of a sequence are read and written, settled before work begins.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "program/batch/camera_track.hpp"
#include "program/batch/frames.hpp"
#include "program/batch/pattern.hpp"
#include "program/batch/whitewater.hpp"

namespace meniscus {

/// One frame's files.
struct FrameJob {
  std::int64_t frame = 0;
  std::string input;
  std::vector<std::string> outputs;
  std::vector<WhitewaterInput> whitewater{};  // a path is empty where the frame has no such file
};

/// What the user asks for.
struct SequenceRequest {
  FramePattern input;
  std::vector<std::string> outputs;  // with places for the number
  std::string frames;                // parse_frames; empty: all there are
  bool skip_missing = false;         // else a missing frame is an error
  Shard shard;
  std::vector<WhitewaterInput> whitewater{};  // with places for the number
};

struct Plan {
  std::vector<FrameJob> jobs;         // this shard's, in the order asked for
  std::vector<std::int64_t> missing;  // of all shards' frames, and done by none
  std::vector<std::string> warnings;
  std::size_t all_shards = 0;       // frames of all shards
  std::vector<std::string> inputs;  // of all frames there are, asked for or not

  std::vector<std::int64_t> frames() const;  // of the jobs
};

/// "7,8" or "0-23", cut where it gets long: for messages.
std::string listed_frames(const std::vector<std::int64_t>& frames);

/// The same with how many they are: "frame 7" or "24 frames 0-23".
std::string named_frames(const std::vector<std::int64_t>& frames);

/// Resolves the frames to files. Frames beyond the last one there is are left out with a warning,
/// as farms hand in chunks that end past the sequence; where that leaves none, they are missing.
/// Where no frames are asked for, those that a sequence of its step lacks are named in a warning.
/// `cameras`, when given, must have one for each. A frame whose whitewater is missing is made
/// without it where missing frames are to be skipped.
///
/// Throws InputError when there are no files at all, or missing frames unless they are to be
/// skipped, naming them; InvalidArgument when the list of frames is wrong, an output has no place
/// for the number, or two outputs would be one file.
Plan plan_sequence(const SequenceRequest& request, const CameraTrack* cameras = nullptr);

}  // namespace meniscus
