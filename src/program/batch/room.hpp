// How many frames fit into memory at once, where the process may not have all of it.
#pragma once

#include <cstddef>

namespace meniscus {

/// Frames that a batch extracts, and writes, at the same time.
struct Crew {
  int extracting = 0, writing = 0;

  bool operator==(const Crew&) const = default;
};

/// Address space, in bytes, that the limit of this process (ulimit -v) leaves; the largest number
/// where there is no limit.
std::size_t room_left();

/// What a batch of frames with so many pixels takes, bytes: what was measured, rounded up.
std::size_t room_for(const Crew& crew, std::size_t pixels);

/// The largest part of a crew, at least one of each, for which there is room; else none of either.
Crew crew_within(Crew crew, std::size_t pixels, std::size_t room);

/// Throws Error where the limit leaves less than a frame of so many pixels takes: under a limit PoCL
/// aborts where it gets no memory.
void require_room_for_frame(std::size_t pixels);

}  // namespace meniscus
