#include "kernels/capture.hpp"

#include <cstring>

namespace meniscus::bench {
namespace {

constexpr std::size_t kMargin = 64;  // bytes that may be read behind a buffer, as on the device

}  // namespace

class Capture : public LaunchObserver {
 public:
  Capture(Device& device, const std::string& kernel, const std::vector<std::size_t>& written)
      : device_(device), kernel_(kernel), written_(written) {
    device_.state().observer = this;
  }
  ~Capture() override { device_.state().observer = nullptr; }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  void before(const KernelLaunch& launch) override {
    if (launch.kernel != kernel_) return;
    CapturedLaunch captured;
    for (std::size_t k = 0; k < launch.arguments.size(); ++k)
      captured.before_.push_back(contents(launch, k));
    captured.after_.resize(launch.arguments.size());
    captured.own_.resize(launch.arguments.size());
    launches.push_back(std::move(captured));
  }
  void after(const KernelLaunch& launch) override {
    if (launch.kernel != kernel_) return;
    for (const std::size_t k : written_) launches.back().after_[k] = contents(launch, k);
  }

  std::vector<CapturedLaunch> launches;

 private:
  using Bytes = CapturedLaunch::Bytes;

  // What many launches are given is kept once.
  std::shared_ptr<const Bytes> contents(const KernelLaunch& launch, std::size_t argument) {
    const KernelLaunch::Argument& seen = launch.arguments[argument];
    Bytes bytes(seen.bytes + seen.scalar_bytes + kMargin);
    if (seen.scalar) std::memcpy(bytes.data(), seen.scalar, seen.scalar_bytes);
    if (seen.bytes) device_.state().read_bytes(*seen.buffer, bytes.data(), seen.bytes);
    if (!launches.empty())
      if (const auto& last = launches.back().before_; argument < last.size())
        if (const auto& known = last[argument]; known && *known == bytes) return known;
    return std::make_shared<const Bytes>(std::move(bytes));
  }

  Device& device_;
  const std::string& kernel_;
  const std::vector<std::size_t>& written_;
};

void CapturedLaunch::reset() {
  for (std::size_t k = 0; k < after_.size(); ++k)
    if (after_[k]) own_[k] = *before_[k];
}

std::size_t CapturedLaunch::differing() const {
  std::size_t words = 0;
  for (std::size_t k = 0; k < after_.size(); ++k) {
    if (!after_[k]) continue;
    for (std::size_t at = 0; at + 4 <= own_[k].size(); at += 4)
      words += std::memcmp(own_[k].data() + at, after_[k]->data() + at, 4) != 0;
  }
  return words;
}

std::vector<CapturedLaunch> capture_launches(Device& device, const std::string& kernel,
                                             const std::vector<std::size_t>& written,
                                             const std::function<void()>& run) {
  Capture capture(device, kernel, written);
  run();
  return std::move(capture.launches);
}

void add_native(Case& result, std::vector<CapturedLaunch> captured,
                const std::function<void(CapturedLaunch& launch, Workers& workers)>& run) {
  const auto launches = std::make_shared<std::vector<CapturedLaunch>>(std::move(captured));
  result.reset_native = [launches] {
    for (CapturedLaunch& launch : *launches) launch.reset();
  };
  result.native = [launches, run](Workers& workers) {
    for (CapturedLaunch& launch : *launches) run(launch, workers);
  };
  result.differing = [launches] {
    std::size_t differing = 0;
    for (const CapturedLaunch& launch : *launches) differing += launch.differing();
    return differing;
  };
}

}  // namespace meniscus::bench
