// Counts sub-buffers of this test program that overlap others which are alive: NVIDIA's driver
// crashes when they are released.
#pragma once

namespace meniscus::test {

/// Those made so far.
int overlapping_sub_buffers();

}  // namespace meniscus::test
