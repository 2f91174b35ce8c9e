#include "device/shared_context.hpp"

#include <map>
#include <mutex>

namespace meniscus {
namespace {

struct SharedContexts {
  std::mutex mutex;
  std::map<cl_device_id, std::weak_ptr<cl::Context>> of_device;
};

SharedContexts& shared_contexts() {
  static SharedContexts contexts;
  return contexts;
}

}  // namespace

std::shared_ptr<cl::Context> shared_context(const cl::Device& device) {
  auto& [mutex, of_device] = shared_contexts();
  const std::lock_guard lock(mutex);
  std::weak_ptr<cl::Context>& known = of_device[device()];
  std::shared_ptr<cl::Context> context = known.lock();
  if (!context) known = context = std::make_shared<cl::Context>(device);
  return context;
}

void forget_shared_context(const cl::Device& device) {
  auto& [mutex, of_device] = shared_contexts();
  const std::lock_guard lock(mutex);
  of_device.erase(device());
}

}  // namespace meniscus
