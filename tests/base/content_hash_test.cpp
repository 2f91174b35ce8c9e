#include "base/content_hash.hpp"

#include <gmock/gmock.h>

#include <set>

#include "io/sample_surface.hpp"

namespace meniscus {
namespace {

TEST(ContentHash, ChangesWithEveryMapAndTheMesh) {
  const Surface surface = sample_surface(sample_camera());
  std::set<std::uint64_t> seen{content_hash(surface)};
  const auto with = [&](auto change) {
    Surface other = surface;
    change(other);
    return seen.insert(content_hash(other)).second;
  };
  EXPECT_TRUE(with([](Surface& s) { s.depth[0] = 1; }));
  EXPECT_TRUE(with([](Surface& s) { s.normal[0].z = -0.0f; }));
  EXPECT_TRUE(with([](Surface& s) { s.position[0].y = 1; }));
  EXPECT_TRUE(with([](Surface& s) { s.group[0] = 9; }));
  EXPECT_TRUE(with([](Surface& s) { s.kind[0] = Kind::splash; }));
  EXPECT_TRUE(with([](Surface& s) { s.residual[0] = 1; }));
  EXPECT_TRUE(with([](Surface& s) { s.mesh.position[0].x = 1; }));
  EXPECT_TRUE(with([](Surface& s) { s.mesh.normal[0].x = 1; }));
  EXPECT_TRUE(with([](Surface& s) { s.mesh.triangle[0][0] = 3; }));
  EXPECT_TRUE(with([](Surface& s) { s.mesh = {}; }));
  EXPECT_TRUE(with([](Surface& s) { std::swap(s.camera.width, s.camera.height); }));
  // The same bytes in another array.
  EXPECT_TRUE(with([](Surface& s) {
    s.mesh.position.push_back(s.mesh.normal.front());
    s.mesh.normal.erase(s.mesh.normal.begin());
  }));
}

TEST(ContentHash, IsOfTheContentAlone) {
  const Surface surface = sample_surface(sample_camera());
  Surface other = surface;
  other.counts.particles = 3;
  other.notices = {{.text = "a"}};
  EXPECT_EQ(content_hash(other), content_hash(surface));
  EXPECT_NE(content_hash(Surface{}), content_hash(surface));
}

TEST(ContentHash, HasSixteenDigits) {
  EXPECT_EQ(hex_digits(0xabc), "0000000000000abc");
  EXPECT_EQ(hex_digits(~0ull), "ffffffffffffffff");
}

}  // namespace
}  // namespace meniscus
