// What all frames of a sequence are extracted with, settled before the first one begins.
#pragma once

#include <memory>

#include "program/batch/camera_track.hpp"
#include "program/batch/plan.hpp"
#include "program/batch/run.hpp"
#include "program/cli/extract_options.hpp"
#include "program/cli/report.hpp"

namespace meniscus::cli {

/// What the options say of a batch, and its devices.
BatchSettings settings_of(const ExtractOptions& options, const Shard& shard, const Talk& say);

/// What must be the same for all frames: the camera where none is given, and into `settings` the
/// particle radius where no file states one, or of those files that do not. One frame settles it
/// for all shards. Returns the cameras.
///
///   whole  this command does the whole sequence, and no other does a part of it
std::unique_ptr<CameraTrack> settle_for_all(const Plan& plan, const ExtractOptions& options,
                                            std::unique_ptr<CameraTrack> cameras, bool whole,
                                            BatchSettings& settings, const Talk& say);

/// Lowers the frames that are under way at once to what the limit on memory has room for: where
/// PoCL gets no memory, it hangs or aborts. Throws Error where there is no room for one a device.
void fit_into_memory(BatchSettings& settings, const Plan& plan, const CameraTrack& cameras);

}  // namespace meniscus::cli
