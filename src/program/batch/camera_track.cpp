#include "program/batch/camera_track.hpp"

#include <algorithm>
#include <cmath>

#include "meniscus/error.hpp"
#include "meniscus/io.hpp"

namespace meniscus {

Camera resized(Camera camera, double share) {
  for (int* const side : {&camera.width, &camera.height})
    *side = std::max(1, static_cast<int>(std::lround(share * *side)));
  return camera;
}

CameraTrack::CameraTrack(const std::string& path, double share) : origin_(path), share_(share) {
  if (const auto pattern = FramePattern::in(path)) {
    files_ = pattern->existing();
    if (files_.empty()) throw InputError(pattern->absence());
    return;
  }
  listed_ = reading_camera([&] { return read_cameras(path); });
  for (auto& [frame, camera] : listed_) camera = resized(camera, share);
  const auto single = listed_.find(kEveryFrame);
  if (single != listed_.end()) fixed_ = single->second;
}

bool CameraTrack::has(std::int64_t frame) const {
  return fixed_ || listed_.contains(frame) || files_.contains(frame);
}

std::vector<std::string> CameraTrack::files() const {
  std::vector<std::string> names;
  for (const auto& [frame, file] : files_) names.push_back(file.path);
  if (names.empty() && !origin_.empty()) names.push_back(origin_);
  return names;
}

Camera CameraTrack::at(std::int64_t frame) const {
  if (fixed_) return *fixed_;
  if (const auto listed = listed_.find(frame); listed != listed_.end()) return listed->second;
  if (const auto file = files_.find(frame); file != files_.end())
    return resized(read_camera(file->second.path), share_);
  throw InputError(origin_ + ": has no camera for frame " + std::to_string(frame));
}

}  // namespace meniscus
