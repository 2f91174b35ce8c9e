// The cameras of a sequence.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "meniscus/error.hpp"
#include "meniscus/notice.hpp"
#include "meniscus/types.hpp"
#include "program/batch/pattern.hpp"

namespace meniscus {

/// What `read` returns; where the camera's file is missing, its error says how to get one.
template <class Read>
auto reading_camera(const Read& read) -> decltype(read()) {
  try {
    return read();
  } catch (const InputError& error) {
    if (error.notice.code != Code::missing_file) throw;
    Notice notice = error.notice;
    notice.text += " (without " + setting("camera") + " the program chooses a camera, and " +
                   setting("write-camera") + " FILE keeps it)";
    throw InputError(notice);
  }
}

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
