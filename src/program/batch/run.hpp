// Frames one after the other and side by side: while some are extracted, others are read and
// written.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "meniscus/closed.hpp"
#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "program/batch/camera_track.hpp"
#include "program/batch/outputs.hpp"
#include "program/batch/plan.hpp"
#include "program/batch/record.hpp"
#include "program/program_identity.hpp"

namespace meniscus {

struct BatchSettings {
  Parameters parameters;
  std::optional<ClosedParams> closed;  // closed meshes are wanted, and no camera is looked at
  WriteOptions writing;                // its job is made for each frame
  double particle_radius = 0;          // world units; 0: the files'
  double others_radius = 0;            // of frames whose files state none; 0: it is estimated
  std::string others_file;             // which states it
  ReadOptions reading{};               // of the files, but for the radius
  double frames_per_second = 24;       // of the sequence
  std::vector<DeviceInfo> devices;     // at least one
  int in_flight = 2;                   // frames that are extracted at once on each device
  int writers = 1;                     // frames that are written at once
  std::size_t memory = kStreamMemory;
  bool stage_times = false;  // into the records; the device waits for the host after each stage
  bool resume = false;       // skip frames whose outputs are whole and of the same job
  bool fail_fast = false;    // the first failed frame ends the batch
  std::string host, shard;   // for the records
  /// Is called by several threads before a device builds a program that no cache has, with how many
  /// there were on that device.
  std::function<void(int programs)> on_building;
  /// Is called by several threads with what a frame's record will have as a warning, as soon as it
  /// is known; again where the frame is extracted again.
  std::function<void(const FrameJob& job, const std::string& warning)> on_warning;
  std::string program = program_identity();
};

struct BatchOutcome {
  std::size_t done = 0, failed = 0, skipped = 0;
  std::string broken;  // the error that ended the batch, e.g. a full disk; empty: none did
};

/// Extracts all jobs. At most devices * in_flight * 2 + writers * 3 frames are in memory.
///
///   stop      becomes non-zero when no more frames are to be begun; those under way are finished
///   finished  called once for each frame that is over, in the order in which they are, by one
///             thread at a time; what it throws ends the batch
///
/// A frame for which a device has no memory is extracted again, alone and in smaller chunks; one
/// whose device fails, on another device; its warnings say so. A device that fails frame after
/// frame gets no more. A frame that cannot be read or extracted fails by itself. One that cannot be
/// written ends the batch and is not over. Throws DeviceError when a device cannot be opened.
BatchOutcome run_batch(const std::vector<FrameJob>& jobs, const CameraTrack& cameras,
                       const BatchSettings& settings, const std::atomic<int>& stop,
                       const std::function<void(const FrameRecord&)>& finished);

}  // namespace meniscus
