// The file of canonical bits.
#include "verify/canonical.hpp"

#include <gmock/gmock.h>

#include "meniscus/error.hpp"
#include "thrown.hpp"

namespace meniscus::verify {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(CanonicalFile, GoesToBytesAndBack) {
  Canonical before;
  before.traces["a"] = {{"fit", "k", 1, {{0, 2}, {300, ~std::uint64_t{0}}}}, {"", "k", 4, {}}};
  before.traces["b"] = {};
  before.values[2] = {1, 2, 3};
  before.frames["f"] = 77;
  before.origin = {{"A (P, driver 1)", "B"}, "1234abc", 12345, 0.75};
  const Canonical after = canonical_from(to_bytes(before));
  ASSERT_EQ(after.traces.size(), 2u);
  EXPECT_EQ(after.traces.at("a")[0].stage, "fit");
  EXPECT_EQ(after.traces.at("a")[0].written, before.traces["a"][0].written);
  EXPECT_EQ(after.traces.at("a")[1].kernel, "k");
  EXPECT_EQ(after.values, before.values);
  EXPECT_EQ(after.frames, before.frames);
  EXPECT_EQ(after.origin.words(),
            "recorded on A (P, driver 1) and B at commit 1234abc; 12,345 outputs within the bounds "
            "of double precision, the worst at 0.750 of its bound");
}

// No names, traces, values and frames, and nothing behind them: four zeros, deflated.
TEST(CanonicalFile, OfBeforeThereWereOriginsIsRead) {
  const std::string bytes("\4\0\0\0\0\0\0\0\x78\xda\x63\x60\x60\x60\0\0\0\4\0\1", 20);
  EXPECT_EQ(canonical_from(bytes).origin.words(), "of unknown origin");
}

Canonical computed_by(const std::string& device) {
  Canonical canonical;
  canonical.origin = {{device}, "", 10, device == "A" ? 0.5 : 0.25};
  canonical.traces["case"] = {{"fit", "k", 1, {{0, 2}}}, {"fit", "l", 2, {{1, 3}}}};
  canonical.frames["frame"] = 77;
  return canonical;
}

TEST(CanonicalBits, OfDevicesThatAgreeNameThemAll) {
  const Canonical all = agreed({computed_by("A"), computed_by("B"), computed_by("C")});
  EXPECT_THAT(all.origin.devices, ElementsAre("A", "B", "C"));
  EXPECT_EQ(all.origin.references, 30u);
  EXPECT_EQ(all.origin.share, 0.5);
  EXPECT_EQ(all.traces.at("case").size(), 2u);
}

TEST(CanonicalBits, AreNoneWhereTwoDevicesDisagree) {
  const auto refused = [](const Canonical& other) {
    return text_of_thrown<InvalidArgument>([&] {
      agreed({computed_by("A"), computed_by("B"), other});
    });
  };
  Canonical c = computed_by("C");
  c.traces["case"][1].written[0].hash = 4;
  EXPECT_THAT(refused(c), HasSubstr("\"A\" and \"C\" differ in case: launch 2, l: other results"));
  c = computed_by("C");
  c.traces["case"][0].inputs = 9;
  EXPECT_THAT(refused(c), HasSubstr("launch 1, k: other inputs"));
  c = computed_by("C");
  c.traces["case"].pop_back();
  EXPECT_THAT(refused(c), HasSubstr("launch 2 is not the same kernel's"));
  c = computed_by("C");
  c.traces["more"] = {};
  EXPECT_THAT(refused(c), HasSubstr("differ in more: one of them did not run it"));
  c = computed_by("C");
  c.frames["frame"] = 78;
  EXPECT_THAT(refused(c), HasSubstr("differ in whole frames"));
}

// What the program was built with.
TEST(CanonicalBits, OfThisReleaseHaveAnOrigin) {
  const Origin& origin = shipped_canonical().origin;
  EXPECT_FALSE(origin.devices.empty());
  EXPECT_FALSE(origin.commit.empty());
  EXPECT_GT(origin.references, 100u);
  EXPECT_GT(origin.share, 0);
  EXPECT_LE(origin.share, 1);
}

TEST(CanonicalFile, IsRefusedWhenDamaged) {
  Canonical some;
  some.frames["f"] = 77;
  const std::string bytes = to_bytes(some);
  EXPECT_THROW(canonical_from(""), InputError);
  EXPECT_THROW(canonical_from(bytes.substr(0, 5)), InputError);
  EXPECT_THROW(canonical_from(bytes.substr(0, bytes.size() - 3)), InputError);
  std::string other = bytes;
  other[12] ^= 0x55;
  EXPECT_THROW(canonical_from(other), InputError);
}

}  // namespace
}  // namespace meniscus::verify
