#include "program/batch/plan.hpp"

#include <algorithm>
#include <iterator>
#include <map>

#include "base/grouped.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

// The pattern of an output, which has a place for the frame's number, or every frame and every
// process that does a part of the sequence would write the same file.
FramePattern pattern_of_output(const std::string& output) {
  if (const auto pattern = FramePattern::in(output)) return *pattern;
  const std::size_t ending = std::min(output.rfind('.'), output.size());
  throw InvalidArgument("output " + output +
                        " has no place for the frame's number, but the input is a sequence: name "
                        "it " +
                        output.substr(0, ending) + ".####" + output.substr(ending));
}

// Two outputs that would write one file, in the same frame or in two.
void check_outputs(const std::vector<FrameJob>& jobs, const std::vector<std::string>& outputs) {
  std::map<std::string, std::size_t> writer;
  for (const FrameJob& job : jobs)
    for (std::size_t k = 0; k < job.outputs.size(); ++k) {
      const auto [place, is_new] = writer.try_emplace(job.outputs[k], k);
      if (!is_new)
        throw InvalidArgument("outputs " + outputs[place->second] + " and " + outputs[k] +
                              " both name " + job.outputs[k] + ", give each output its own name");
    }
}

// Gives each job its files of one type of whitewater.
void add_whitewater(const WhitewaterInput& input, bool skip_missing, std::vector<FrameJob>& jobs,
                    std::vector<std::string>& warnings) {
  const std::string path = sequence_in_folder(input.path);
  const auto pattern = FramePattern::in(path);
  if (!pattern)
    throw InvalidArgument("whitewater " + path +
                          " has no place for the frame's number, e.g. name.####.ply, but the water "
                          "is a sequence");
  const auto existing = pattern->existing();
  if (existing.empty()) throw InputError(pattern->absence());
  std::vector<std::int64_t> missing;
  for (FrameJob& job : jobs) {
    WhitewaterInput own = input;
    const auto found = existing.find(job.frame);
    own.path = found == existing.end() ? std::string() : found->second.path;
    if (own.path.empty()) missing.push_back(job.frame);
    job.whitewater.push_back(std::move(own));
  }
  if (missing.empty()) return;
  const std::string what = path + ": " + named_frames(missing) + " missing";
  if (!skip_missing)
    throw InputError(what + " (give --missing skip to make the water without them)");
  warnings.push_back(what + ", and the water made without");
}

using Existing = std::map<std::int64_t, FramePattern::Found>;

// Frames of `where` that are not there: an error, or a warning where they may be skipped.
void miss(const SequenceRequest& request, const std::string& where,
          const std::vector<std::int64_t>& frames, Plan& plan) {
  if (frames.empty()) return;
  const std::string what = where + ": " + named_frames(frames) + " missing";
  if (!request.skip_missing) throw InputError(what + " (give --missing skip to go on without)");
  plan.warnings.push_back(what + " and skipped");
}

// All frames that exist; those between them that do not are missing, which is no error.
std::vector<std::int64_t> all_frames(const SequenceRequest& request, const Existing& existing,
                                     Plan& plan) {
  std::vector<std::int64_t> wanted;
  for (const auto& [frame, file] : existing) wanted.push_back(frame);
  const std::vector<std::int64_t> all = whole_range(wanted);
  std::set_difference(all.begin(), all.end(), wanted.begin(), wanted.end(),
                      std::back_inserter(plan.missing));
  if (!plan.missing.empty())
    plan.warnings.push_back(request.input.text() + ": " + named_frames(plan.missing) +
                            (plan.missing.size() == 1 ? " is" : " are") + " missing");
  if (const auto below = request.input.below_zero(); !below.empty())
    plan.warnings.push_back(request.input.text() + ": " + counted(below.size(), "file") +
                            " with a number below 0 left out, such as " + below.front() +
                            " (frames count from 0)");
  return wanted;
}

// The frames of a list that exist.
std::vector<std::int64_t> listed_ones(const SequenceRequest& request, const Existing& existing,
                                      Plan& plan) {
  const std::int64_t last = existing.rbegin()->first;
  std::vector<std::int64_t> wanted, beyond;
  for (const std::int64_t frame : parse_frames(request.frames))
    (existing.contains(frame) ? wanted : frame > last ? beyond : plan.missing).push_back(frame);
  const std::string end = "the sequence ends with frame " + std::to_string(last);
  if (wanted.empty() && plan.missing.empty() && !request.skip_missing)
    throw InputError(request.input.text() + ": none of " + named_frames(beyond) + " is there, " +
                     end + " (give --missing skip to do nothing then)");
  if (!beyond.empty())
    plan.warnings.push_back(request.input.text() + ": " + named_frames(beyond) +
                            " left out: " + end);
  miss(request, request.input.text(), plan.missing, plan);
  return wanted;
}

// Leaves out the frames that have no camera.
void leave_out_blind(const SequenceRequest& request, const CameraTrack& cameras,
                     std::vector<std::int64_t>& wanted, Plan& plan) {
  std::vector<std::int64_t> blind;
  for (const std::int64_t frame : wanted)
    if (!cameras.has(frame)) blind.push_back(frame);
  miss(request, cameras.origin(), blind, plan);
  std::erase_if(wanted, [&](std::int64_t frame) { return !cameras.has(frame); });
  plan.missing.insert(plan.missing.end(), blind.begin(), blind.end());
}

}  // namespace

std::string listed_frames(const std::vector<std::int64_t>& frames) {
  constexpr std::size_t kLongest = 200;  // characters
  const std::string list = frame_list(frames);
  return list.size() > kLongest ? list.substr(0, list.rfind(',', kLongest)) + ",..." : list;
}

std::string named_frames(const std::vector<std::int64_t>& frames) {
  return (frames.size() == 1 ? "frame " : std::to_string(frames.size()) + " frames ") +
         listed_frames(frames);
}

std::vector<std::int64_t> Plan::frames() const {
  std::vector<std::int64_t> frames;
  for (const FrameJob& job : jobs) frames.push_back(job.frame);
  return frames;
}

Plan plan_sequence(const SequenceRequest& request, const CameraTrack* cameras) {
  const auto existing = request.input.existing();
  if (existing.empty()) throw InputError(request.input.absence());
  Plan plan;
  for (const auto& [frame, file] : existing) plan.inputs.push_back(file.path);
  std::vector<std::int64_t> wanted = request.frames.empty() ? all_frames(request, existing, plan)
                                                            : listed_ones(request, existing, plan);
  if (cameras) leave_out_blind(request, *cameras, wanted, plan);

  std::vector<FramePattern> outputs;
  for (const std::string& output : request.outputs) outputs.push_back(pattern_of_output(output));
  std::vector<FrameJob> jobs;
  for (const std::int64_t frame : wanted) {
    const FramePattern::Found& file = existing.at(frame);
    FrameJob job{frame, file.path, {}, {}};
    for (const FramePattern& output : outputs)
      job.outputs.push_back(output.name(frame, file.digits));
    jobs.push_back(std::move(job));
  }
  check_outputs(jobs, request.outputs);
  for (const WhitewaterInput& input : request.whitewater)
    add_whitewater(input, request.skip_missing, jobs, plan.warnings);
  plan.all_shards = jobs.size();
  plan.jobs = items_of(request.shard, jobs);
  return plan;
}

}  // namespace meniscus
