#include "program/batch/room.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <limits>

#include "base/grouped.hpp"
#include "meniscus/error.hpp"

namespace meniscus {

std::size_t room_left() {
  constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();
  rlimit limit{};
  std::size_t pages = 0;
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY ||
      !(std::ifstream("/proc/self/statm") >> pages))
    return kUnlimited;
  const std::size_t used = pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return limit.rlim_cur > used ? limit.rlim_cur - used : 0;
}

std::size_t room_for(const Crew& crew, std::size_t pixels) {
  // PoCL's compiler; threads with their stacks and heaps; maps on both sides.
  constexpr std::size_t kOnce = std::size_t{128} << 20, kEach = std::size_t{96} << 20, kPixel = 200;
  const auto frames = static_cast<std::size_t>(crew.extracting + crew.writing);
  return kOnce + frames * (kEach + kPixel * pixels);
}

Crew crew_within(Crew crew, std::size_t pixels, std::size_t room) {
  while (room_for(crew, pixels) > room) {
    if (crew.extracting <= 1 && crew.writing <= 1) return {};
    --(crew.writing >= crew.extracting ? crew.writing : crew.extracting);
  }
  return crew;
}

void require_room_for_frame(std::size_t pixels) {
  const std::size_t room = room_left(), wanted = room_for({1, 0}, pixels);
  if (wanted <= room) return;
  throw Error("the limit on memory leaves " + grouped(room >> 20) + " MB and a frame of " +
              grouped(pixels) + " pixels takes about " + grouped(wanted >> 20) +
              " MB (raise ulimit -v, or use a smaller image)");
}

}  // namespace meniscus
