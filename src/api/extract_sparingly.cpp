#include "api/extract_sparingly.hpp"

#include "device/device.hpp"

namespace meniscus {

Surface extract_sparingly(Device& device, const ParticleSource& source, const Camera& camera,
                          const Parameters& parameters, std::vector<StageTime>* timings,
                          std::size_t memory, const OutOfDeviceMemory& first) {
  device.state().pool->drop_idle();
  if (timings) timings->clear();
  Surface surface;
  try {
    surface = extract_again(device, source, camera, parameters, timings, memory / 8);
  } catch (const InvalidArgument&) {
    throw first;
  }
  surface.notices.push_back(
      {.code = Code::extracted_again,
       .text = "extracted again in smaller chunks after: " + first.notice.text});
  device.state().tell(surface.notices.back());
  return surface;
}

}  // namespace meniscus
