// The cameras of a sequence.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "meniscus/types.hpp"
#include "program/batch/pattern.hpp"

namespace meniscus {

/// The same camera with an image of this share of its width and height, rounded.
Camera resized(Camera camera, double share);

/// One camera for all frames, or one for each.
class CameraTrack {
 public:
  /// The same camera for all frames.
  explicit CameraTrack(const Camera& camera) : fixed_(camera) {}

  /// Of a pattern with a file for each frame, a file with a list (see read_cameras), or a file with
  /// one camera; images of this share of their sizes. Throws InputError.
  explicit CameraTrack(const std::string& path, double share = 1);

  bool moves() const { return !fixed_; }
  bool has(std::int64_t frame) const;

  /// Throws InputError when there is none or its file cannot be read.
  Camera at(std::int64_t frame) const;

  /// The frame's after this one, or this one's where the track ends.
  Camera after(std::int64_t frame) const { return at(has(frame + 1) ? frame + 1 : frame); }

  /// Those it is read from; none where the camera was given.
  std::vector<std::string> files() const;

  /// "cameras.json" or the pattern, for messages.
  const std::string& origin() const { return origin_; }

 private:
  std::string origin_;
  double share_ = 1;
  std::optional<Camera> fixed_;
  std::map<std::int64_t, Camera> listed_;
  std::map<std::int64_t, FramePattern::Found> files_;
};

}  // namespace meniscus
