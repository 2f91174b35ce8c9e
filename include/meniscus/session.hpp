// A device, and what goes with it from frame to frame: for programs that extract many, show
// progress and let people cancel.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "meniscus/closed.hpp"
#include "meniscus/device.hpp"
#include "meniscus/export.hpp"
#include "meniscus/extract.hpp"
#include "meniscus/whitewater.hpp"

namespace meniscus MENISCUS_API {

/// Session::cancel() was called.
struct Cancelled : Error {
  using Error::Error;
};

struct SessionSettings {
  std::size_t memory = kStreamMemory;  // see extract(); bytes
  /// Called at the beginning of each stage with its name, by the thread that extracts. What it
  /// throws ends the extraction and comes out of extract(); the session can be used on. It must not
  /// extract on the same session.
  std::function<void(const std::string& stage)> progress{};
  /// Called with each notice as soon as it is known: see Device::on_notice.
  std::function<void(const Notice& notice)> on_notice{};
};

class Session {
 public:
  using Settings = SessionSettings;

  /// Opens the device that `selector` names (see select_device). Throws DeviceError.
  explicit Session(const std::string& selector = "");
  explicit Session(Device device);
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  /// As extract() of extract.hpp, with a second chance where the device runs out of memory:
  /// nothing is kept from earlier frames, and a frame that streams does so in an eighth of the
  /// memory. The result is the same; a notice tells of it. Several threads may call this; they take
  /// turns.
  ///
  ///   timings  when given, receives an entry each time a stage runs, in order
  ///
  /// Throws as extract(), and Cancelled.
  Surface extract(const ParticleSource& particles, const Camera& camera,
                  const Parameters& parameters = {}, const Settings& settings = {},
                  std::vector<StageTime>* timings = nullptr);
  Surface extract(const BorrowedParticles& particles, const Camera& camera,
                  const Parameters& parameters = {}, const Settings& settings = {},
                  std::vector<StageTime>* timings = nullptr);

  /// As extract_closed() of closed.hpp. settings.memory has no effect. Threads take turns. Throws
  /// as extract_closed(), and Cancelled.
  Surface extract_closed(const ParticleSource& particles, const ClosedParams& closed = {},
                         const Parameters& parameters = {}, const Settings& settings = {},
                         std::vector<StageTime>* timings = nullptr);
  Surface extract_closed(const BorrowedParticles& particles, const ClosedParams& closed = {},
                         const Parameters& parameters = {}, const Settings& settings = {},
                         std::vector<StageTime>* timings = nullptr);

  /// As draw_whitewater() of whitewater.hpp. Threads take turns. Throws as that, and Cancelled.
  void draw_whitewater(const std::vector<WhitewaterSource>& sources, const Parameters& parameters,
                       Surface& surface, const Settings& settings = {},
                       std::vector<StageTime>* timings = nullptr);

  /// Ends the extraction that is under way at its next stage; without one nothing happens. From any
  /// thread.
  void cancel();

  const DeviceInfo& device() const;

 private:
  struct MENISCUS_INTERNAL State;
  std::unique_ptr<State> state_;
};

}  // namespace MENISCUS_API
