// Lets one OpenCL call of a whole extraction fail, then the next one, and so on: each must come
// back as one DeviceError that names the call, the device and the stage, or change nothing; and the
// device must then extract as before. Under the address sanitizer nothing may leak either.
//   every_call [STEP]   every STEP-th call, default all
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "base/content_hash.hpp"
#include "device/device.hpp"
#include "faults/failing_call.hpp"
#include "meniscus/extract.hpp"
#include "stages/vec.hpp"

namespace {

using namespace meniscus;

// A jittered block of 6 x 6 x 2 moving particles.
Particles tiny_frame() {
  Particles particles;
  particles.particle_radius = 0.5;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 6; ++i) {
        add_position(particles,
                     {i + 0.11 * std::sin(3 * i + 7 * j + k), j + 0.13 * std::cos(5 * i + j - k),
                      -k + 0.2 * std::sin(i + 2 * j)});
        particles.vx.push_back(0);
        particles.vy.push_back(1);
        particles.vz.push_back(0.5f);
      }
  return particles;
}

struct Outcome {
  std::string error;       // empty: none
  std::uint64_t hash = 0;  // of the surface, without an error
  bool in_stages = false;  // the device was open when the call failed
};

// An extraction on `device`, or on one that is opened for it, with programs from disk or built
// anew.
Outcome run(Device* device, bool from_disk, const Particles& particles, const Camera& camera) {
  Outcome outcome;
  try {
    std::optional<Device> opened;
    if (!device) device = &opened.emplace();
    device->state().keeps = from_disk ? Keeps::binaries : Keeps::nothing;
    outcome.in_stages = test::failed_call().empty();
    std::vector<StageTime> timings;
    outcome.hash = content_hash(extract(*device, particles, camera, {}, &timings));
  } catch (const DeviceError& error) {
    outcome.error = error.what();
  }
  return outcome;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::size_t step = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 1;
  const Particles particles = tiny_frame();
  const Camera camera = look_at({9, 10, 11}, {2.5, 2.5, -0.5}, {0, 1, 0}, 42, 24, 17);

  Device kept;
  const Outcome whole = run(&kept, true, particles, camera);
  if (!whole.error.empty()) throw std::runtime_error(whole.error);
  const auto calls_of = [&](Device* device, bool from_disk) {
    test::fail_call("");
    run(device, from_disk, particles, camera);
    return test::calls_made();
  };
  const std::vector<std::string> again = calls_of(&kept, true);

  long tried = 0, errors = 0, wrong = 0;
  const auto try_call = [&](std::size_t k, Device* device, bool from_disk) {
    test::fail_call(std::to_string(k + 1));
    const Outcome outcome = run(device, from_disk, particles, camera);
    const std::string call = test::failed_call();
    const auto complain = [&](const char* what) {
      std::printf("call %zu, %s: %s: %s\n", k + 1, call.c_str(), what, outcome.error.c_str());
      ++wrong;
    };
    const auto says = [&](const std::string& part) {
      return outcome.error.find(part) != std::string::npos;
    };
    ++tried;
    if (call.empty()) complain("was not reached");
    if (outcome.error.empty()) {
      if (outcome.hash != whole.hash) complain("no error, but another result");
      return;
    }
    ++errors;
    if (!says(call)) complain("the call is not named");
    if (says("\n")) complain("more than a line");
    if (!outcome.in_stages) return;
    if (!says('"' + kept.info().name + '"')) complain("the device is not named");
    if (!says(" in stage ")) complain("the stage is not named");
  };
  // On one device, which must bear it, and on a new one the calls that only its first frame makes.
  for (std::size_t k = 0; k < again.size(); k += step) try_call(k, &kept, true);
  std::size_t first_frame = 0;
  for (const bool from_disk : {true, false}) {
    const std::vector<std::string> anew = calls_of(nullptr, from_disk);
    for (std::size_t k = 0; k < anew.size(); ++k)
      if (std::find(again.begin(), again.end(), anew[k]) == again.end() &&
          first_frame++ % step == 0)
        try_call(k, nullptr, from_disk);
  }
  test::fail_call("");
  if (run(&kept, true, particles, camera).hash != whole.hash) {
    std::printf("after all failures the device gives another result\n");
    ++wrong;
  }
  std::printf(
      "%zu calls of a frame, %zu of opening and building: %ld tried, %ld errors, %ld wrong\n",
      again.size(), first_frame, tried, errors, wrong);
  return wrong == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::printf("%s\n", error.what());
  return 1;
}
