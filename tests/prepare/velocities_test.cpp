// Velocities that cannot be used, and what is said of them.
#include "prepare/velocities.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "meniscus/error.hpp"
#include "texts.hpp"

namespace meniscus {
namespace {

TEST(VelocityCheck, PassesWhatCanBeUsed) {
  VelocityCheck velocities;
  const Vec3 given{1, -2e29f, 0};
  EXPECT_EQ(velocities.checked(given, 3), given);
  Notices notices;
  Parameters strict;
  strict.strict = true;
  velocities.report("particles", strict, notices);
  EXPECT_TRUE(notices.all().empty());
}

TEST(VelocityCheck, CountsWhatCannotAndNamesTheFirst) {
  VelocityCheck velocities;
  velocities.checked({1, 2, 3}, 4);
  for (const float bad : {NAN, INFINITY, -INFINITY, 1e30f, -3e38f})
    for (const Vec3 v : {Vec3{bad, 0, 0}, Vec3{0, bad, 0}, Vec3{0, 0, bad}})
      EXPECT_FALSE(is_known(velocities.checked(v, bad == 1e30f ? 7 : 9)));
  Notices notices;
  velocities.report("particles", {}, notices);
  EXPECT_THAT(
      texts(notices.all()),
      testing::ElementsAre("15 of 16 particles have NaN, infinite or absurd velocities (the first "
                           "is particle 7), which were left out"));
  Parameters strict;
  strict.strict = true;
  EXPECT_THROW(velocities.report("particles", strict, notices), InputError);
}

}  // namespace
}  // namespace meniscus
