#include "kernels/results.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/printable.hpp"
#include "io/input_file.hpp"
#include "io/json_number.hpp"
#include "io/json_text.hpp"
#include "meniscus/error.hpp"

namespace meniscus::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;
constexpr std::size_t kLongestUnfinished = 200;  // characters

Json json_of(const Roofline& roofline) {
  Json copies = Json::array();
  for (const CopyRate& rate : roofline.copy)
    copies.push_back({{"bytes", rate.bytes}, {"gb_per_s", rate.gb_per_s}});
  return {{"copy", copies},
          {"fused_gflops", roofline.fused_gflops},
          {"plain_gflops", roofline.plain_gflops},
          {"launch_us", roofline.launch_us},
          {"batched_launch_us", roofline.batched_launch_us},
          {"empty_kernel_us", roofline.empty_kernel_us},
          {"spread_atomics_g_per_s", roofline.spread_atomics},
          {"contended_atomics_g_per_s", roofline.contended_atomics}};
}

Json json_of(const Result& result, const Session& session) {
  Json json{{"kernel", result.kernel},
            {"variant", result.variant},
            {"particles", result.particles},
            {"width", result.width},
            {"height", result.height},
            {"unit", result.unit},
            {"items", result.items},
            {"bytes", result.bytes},
            {"operations", result.operations},
            {"atomics", result.atomics},
            {"whole_stage", result.whole_stage},
            {"ms", result.ms},
            {"best_ms", result.best_ms()},
            {"noise_ms", result.noise_ms()},
            {"rate", result.rate()},
            {"gb_per_s", result.gb_per_s()},
            {"gflops", result.gflops()}};
  const Share share = share_of_roofline(result, session.roofline);
  if (share.counted()) {
    json["share_of_roofline"] = share.value;
    json["limit"] = share.limit;
    json["ceiling"] = share.ceiling;
  }
  if (const double against = session.against_native(result); against > 0)
    json["against_native"] = against;
  if (!result.note.empty()) json["note"] = result.note;
  return json;
}

Roofline roofline_of(const Json& json) {
  Roofline roofline;
  for (const Json& copy : json.at("copy"))
    roofline.copy.push_back({copy.at("bytes"), copy.at("gb_per_s")});
  roofline.fused_gflops = json.at("fused_gflops");
  roofline.plain_gflops = json.at("plain_gflops");
  roofline.launch_us = json.at("launch_us");
  roofline.batched_launch_us = json.at("batched_launch_us");
  roofline.empty_kernel_us = json.value("empty_kernel_us", 0.0);
  roofline.spread_atomics = json.at("spread_atomics_g_per_s");
  roofline.contended_atomics = json.at("contended_atomics_g_per_s");
  return roofline;
}

// The whole number under a key.
template <class Integer>
void take_whole(const Json& json, const char* key, Integer& number) {
  const auto whole = whole_number<Integer>(json.at(key));
  if (!whole)
    throw InputError(std::string(key) + " is " + json.at(key).dump() +
                     ", must be a whole number that fits");
  number = *whole;
}

Result result_of(const Json& json) {
  Result result;
  result.kernel = json.at("kernel");
  result.variant = json.at("variant");
  take_whole(json, "particles", result.particles);
  take_whole(json, "width", result.width);
  take_whole(json, "height", result.height);
  result.unit = json.at("unit");
  result.items = json.at("items");
  result.bytes = json.at("bytes");
  result.operations = json.at("operations");
  result.atomics = json.at("atomics");
  result.ms = json.at("ms").get<std::vector<double>>();
  result.whole_stage = json.value("whole_stage", false);
  result.note = json.value("note", "");
  const auto positive = [](double ms) { return ms > 0; };
  if (result.ms.empty() || !std::all_of(result.ms.begin(), result.ms.end(), positive))
    throw InputError(result.kernel + ": ms must be a list of times > 0");
  return result;
}

}  // namespace

double Result::best_ms() const { return *std::min_element(ms.begin(), ms.end()); }

double Result::noise_ms() const {
  std::vector<double> sorted = ms;
  std::sort(sorted.begin(), sorted.end());
  return sorted[sorted.size() / 4] - sorted.front();
}

Share share_of_roofline(const Result& result, const Roofline& roofline) {
  Share best;
  if (result.whole_stage || !(result.operations > 0)) return best;
  const auto consider = [&](double share, double ceiling, const char* name) {
    if (ceiling > 0 && share > best.value) best = {share, name, ceiling};
  };
  const double bandwidth = roofline.bandwidth(result.bytes);
  consider(result.gb_per_s() / bandwidth, bandwidth, "memory");
  consider(result.gflops() / roofline.peak_gflops(), roofline.peak_gflops(), "arithmetic");
  consider(1e-6 * result.atomics / result.best_ms() / roofline.spread_atomics,
           roofline.spread_atomics, "atomics");
  consider(1e-3 * roofline.empty_kernel_us / result.best_ms(), roofline.empty_kernel_us, "launch");
  return best;
}

const Result* Session::find(const std::string& kernel, const std::string& variant,
                            long long particles, int width, int height) const {
  for (const Result& result : results)
    if (result.kernel == kernel && result.variant == variant && result.particles == particles &&
        result.width == width && result.height == height)
      return &result;
  return nullptr;
}

const Result* Session::native_of(const Result& result) const {
  return result.variant == kDevice
             ? find(result.kernel, kNative, result.particles, result.width, result.height)
             : nullptr;
}

double Session::against_native(const Result& result) const {
  const Result* const native = native_flags ? native_of(result) : nullptr;
  return native ? native->best_ms() / result.best_ms() : 0;
}

double Verdict::against_native() const {
  if (!(against_one > 0)) return against_all;
  return against_all > 0 ? std::min(against_one, against_all) : against_one;
}

bool Verdict::near_limit() const {
  return share.value >= kGoodShare || against_native() >= kGoodAgainstNative;
}

const Session* one_thread_of(const BenchRun& run, const Session& session) {
  for (const Session& other : run.sessions)
    if (other.device == session.device && other.threads == 1) return &other;
  return nullptr;
}

std::vector<Verdict> judge(const BenchRun& run) {
  std::vector<Verdict> verdicts;
  for (const Session& session : run.sessions) {
    const bool most =
        std::none_of(run.sessions.begin(), run.sessions.end(), [&](const Session& other) {
          return other.device == session.device && other.threads > session.threads;
        });
    if (!most) continue;
    const Session* const single = one_thread_of(run, session);
    for (const Result& result : session.results) {
      if (result.variant != kDevice) continue;
      const bool larger =
          std::any_of(session.results.begin(), session.results.end(), [&](const Result& other) {
            return other.kernel == result.kernel && other.variant == kDevice &&
                   other.particles > result.particles;
          });
      if (larger) continue;
      Verdict verdict{&session, &result, share_of_roofline(result, session.roofline), 0, 0};
      verdict.against_all = session.against_native(result);
      if (single && session.native_flags)
        if (const Result* one =
                single->find(result.kernel, kDevice, result.particles, result.width, result.height))
          verdict.against_one = single->against_native(*one);
      verdicts.push_back(verdict);
    }
  }
  return verdicts;
}

std::string to_json(const BenchRun& run) {
  Json sessions = Json::array();
  for (const Session& session : run.sessions) {
    Json results = Json::array();
    for (const Result& result : session.results) results.push_back(json_of(result, session));
    Json entry = {{"device", session.device},
                  {"kind", session.kind},
                  {"platform", session.platform},
                  {"driver", session.driver},
                  {"compute_units", session.compute_units},
                  {"processors", session.processors},
                  {"threads", session.threads},
                  {"other_work", session.other_work},
                  {"native_benchmarks", session.native_flags},
                  {"roofline", json_of(session.roofline)},
                  {"results", results}};
    if (!session.unfinished.empty()) entry["unfinished"] = session.unfinished;
    sessions.push_back(entry);
  }
  const Json json{
      {"kernel_benchmarks", kFormat}, {"meniscus", run.version}, {"sessions", sessions}};
  return json.dump(1) + "\n";
}

BenchRun from_json(const std::string& text, const std::string& name) try {
  const Json json = parse_json<Json>(text);
  if (json.at("kernel_benchmarks") != kFormat)
    throw InputError("kernel_benchmarks is " + shown(json.at("kernel_benchmarks").dump()) +
                     ", must be " + std::to_string(kFormat));
  BenchRun run;
  run.version = json.at("meniscus");
  for (const Json& entry : json.at("sessions")) {
    Session session;
    session.device = entry.at("device");
    session.kind = entry.at("kind");
    session.platform = entry.at("platform");
    session.driver = entry.at("driver");
    take_whole(entry, "compute_units", session.compute_units);
    take_whole(entry, "threads", session.threads);
    session.processors = static_cast<int>(session.compute_units);
    if (entry.contains("processors")) take_whole(entry, "processors", session.processors);
    session.other_work = entry.at("other_work");
    session.native_flags = entry.value("native_benchmarks", false);
    session.unfinished = printable(entry.value("unfinished", ""), kLongestUnfinished);
    session.file = name;
    session.roofline = roofline_of(entry.at("roofline"));
    for (const Json& result : entry.at("results")) session.results.push_back(result_of(result));
    run.sessions.push_back(session);
  }
  return run;
} catch (const nlohmann::json::exception& error) {
  throw InputError(name + ": is not what meniscus bench --json writes: " + reason_of(error));
} catch (const InputError& error) {
  throw InputError(name + ": is not what meniscus bench --json writes: " + error.what());
}

}  // namespace meniscus::bench
