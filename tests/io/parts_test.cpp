// A frame in several files, read by one and by several ranks.
#include "io/parts.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <mutex>

#include "base/thread_team.hpp"
#include "io/io_test_support.hpp"
#include "prepare/survey.hpp"

namespace meniscus {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(NaturalOrder, TakesNumbersAsNumbers) {
  std::vector<std::string> sorted{"ab",    "a11", "a10.b10", "a10.b9", "a10.b2", "a10",
                                  "a0010", "a2",  "a1b",     "a1",     "a0b",    "a"};
  std::sort(sorted.begin(), sorted.end(), naturally_before);
  EXPECT_THAT(sorted, ElementsAre("a", "a0b", "a1", "a1b", "a2", "a0010", "a10", "a10.b2", "a10.b9",
                                  "a10.b10", "a11", "ab"));
  for (const std::string& a : sorted)
    for (const std::string& b : sorted) EXPECT_EQ(naturally_before(a, b), &a < &b) << a << " " << b;
}

class Parts : public InputTest {
 protected:
  /// Rows with x = begin, begin + 1, ...
  std::string csv(int begin, int count) const {
    std::string text = "x,y,z\n";
    for (int k = 0; k < count; ++k) text += std::to_string(begin + k) + ",1,2\n";
    return text;
  }
  std::string ply(int begin, int count, const std::string& comment = "",
                  bool with_radius = false) const {
    std::string bytes = "ply\nformat binary_little_endian 1.0\n" + comment + "element vertex " +
                        std::to_string(count) +
                        "\nproperty float x\nproperty float y\nproperty float z\n" +
                        (with_radius ? "property float radius\n" : "") + "end_header\n";
    for (int k = 0; k < count; ++k) {
      bytes += stored(static_cast<float>(begin + k), std::endian::little) +
               stored(1.0f, std::endian::little) + stored(2.0f, std::endian::little);
      if (with_radius) bytes += stored(0.5f, std::endian::little);
    }
    return bytes;
  }
  static std::string in_folder(const std::string& file, const std::string& name) {
    return (std::filesystem::path(file).parent_path() / name).string();
  }
  static std::string error_of(const std::string& path, int ranks = 1) {
    const TeamOutcome outcome =
        as_team(ranks, [&](Team& team) { open_parts(path, ReadOptions{}, team); });
    EXPECT_THAT(outcome.errors, Each(outcome.errors[0]));
    return outcome.errors[0];
  }
};

TEST_F(Parts, AreTheFilesThatMatchInNaturalOrder) {
  const std::string file = write("dam.rank2.csv", csv(0, 1));
  for (const char* name : {"dam.rank10.csv", "dam.rank1.csv", "dam.rank1.csv.bak", "dam.csv"})
    write(name, csv(0, 1));
  const auto at = [&](const char* name) { return in_folder(file, name); };
  std::filesystem::create_directory(at("dam.rank3.csv"));
  EXPECT_THAT(part_files(at("dam.rank*.csv")),
              ElementsAre(at("dam.rank1.csv"), file, at("dam.rank10.csv")));
  EXPECT_THAT(part_files(file), ElementsAre(file));
  EXPECT_THAT(part_files(at("missing.csv")), ElementsAre(at("missing.csv")));
  // Nothing but * is special, and a file that is called so is itself.
  EXPECT_THROW(part_files(at("dam.rank?*.csv")), InputError);
  EXPECT_THROW(part_files(at("dam.rank[12]*.csv")), InputError);
  write("a?[1]*.csv", csv(0, 1));
  write("a?[1]b.csv", csv(0, 1));
  EXPECT_THAT(part_files(at("a?[1]*.csv")), ElementsAre(at("a?[1]*.csv")));
  EXPECT_THAT(part_files(at("a?[1]*b.csv")), ElementsAre(at("a?[1]b.csv")));
  std::filesystem::create_directory(at("rank1"));
  write("rank1/dam.csv", csv(0, 1));
  EXPECT_THAT(part_files(at("rank*/dam.csv")), ElementsAre(at("rank1/dam.csv")));
}

// Three files of which one is empty, one is text and one is large enough to be left on disk.
TEST_F(Parts, AreReadOnceByWhateverRanks) {
  constexpr int kLarge = 1 << 18, kAll = 5 + kLarge + 3;
  const std::string file = write("a1.csv", csv(0, 5));
  write("a2.csv", csv(0, 0));
  write("a3.ply", ply(5, kLarge));
  write("a4.csv", csv(5 + kLarge, 3));
  const std::string pattern = in_folder(file, "a*.*");
  for (const int ranks : {1, 2, 3, 4, 7}) {
    std::vector<int> times(kAll);
    std::mutex mutex;
    const TeamOutcome outcome = as_team(ranks, [&](Team& team) {
      const auto source = open_parts(pattern, ReadOptions{.attributes = {"x"}}, team);
      EXPECT_EQ(source->size(), kAll);
      EXPECT_THAT(source->attributes(), ElementsAre("x"));
      EXPECT_FALSE(source->has_radius());
      EXPECT_FALSE(source->in_memory());
      EXPECT_EQ(source->name(4), "particle 4 of " + in_folder(file, "a1.csv"));
      EXPECT_EQ(source->name(5), "particle 0 of " + in_folder(file, "a3.ply"));
      EXPECT_EQ(source->name(kAll - 1), "particle 2 of " + in_folder(file, "a4.csv"));
      for_each_chunk(*source, 100000, {.attributes = true}, [&](const ParticleChunk& chunk) {
        const std::lock_guard lock(mutex);
        for (std::size_t k = 0; k < chunk.count; ++k) {
          const std::int64_t particle = chunk.first + static_cast<std::int64_t>(k);
          ASSERT_LT(particle, kAll);
          EXPECT_EQ(chunk.x[k], static_cast<float>(particle));
          EXPECT_EQ(chunk.attributes.at(0)[k], chunk.x[k]);
          ++times[static_cast<std::size_t>(particle)];
        }
      });
      // With more ranks than files each has some of the large one.
      EXPECT_TRUE(ranks <= 4 || !source->share().empty());
    });
    EXPECT_THAT(outcome.errors, Each(IsEmpty()));
    EXPECT_THAT(times, Each(1)) << ranks;
  }
}

TEST_F(Parts, OfOneFileAreRangesWhoseParticlesHaveItsNames) {
  constexpr int kLarge = (1 << 18) + 1;
  const std::string file = write("a.ply", ply(0, kLarge, "comment particle_radius 0.25\n"));
  std::vector<std::vector<ParticleRange>> shares(3);
  as_team(3, [&](Team& team) {
    const auto source = open_parts(file, ReadOptions{}, team);
    EXPECT_EQ(source->name(7), "vertex 7");
    EXPECT_EQ(source->particle_radius(), 0.25);
    shares[static_cast<std::size_t>(team.rank())] = source->share();
  });
  std::int64_t next = 0;
  for (const auto& share : shares) {
    ASSERT_EQ(share.size(), 1u);
    EXPECT_EQ(share[0].first, next);
    EXPECT_NEAR(static_cast<double>(share[0].count), kLarge / 3.0, 1);
    next += share[0].count;
  }
  EXPECT_EQ(next, kLarge);
}

TEST_F(Parts, MustAgree) {
  const std::string file = write("r1.ply", ply(0, 2, "comment particle_radius 0.25\n"));
  write("r2.ply", ply(0, 0));  // has nothing to say
  write("r3.ply", ply(2, 2, "comment particle_radius 0.5\n"));
  for (const int ranks : {1, 2, 5})
    EXPECT_THAT(error_of(in_folder(file, "r*.ply"), ranks),
                AllOf(HasSubstr("r3.ply: particle_radius is 0.5, "), HasSubstr("r1.ply it is 0.25"),
                      HasSubstr("give particle_radius")));
  EXPECT_EQ(open_particles(in_folder(file, "r*.ply"), 0.125)->particle_radius(), 0.125);

  write("s1.ply", ply(0, 2));
  write("s2.ply", ply(0, 2, "", true));
  EXPECT_THAT(error_of(in_folder(file, "s*.ply"), 2),
              AllOf(HasSubstr("s2.ply: its particles have radii, those of "),
                    HasSubstr("s1.ply have none (the parts")));
}

TEST_F(Parts, EndForAllRanksWhenOneIsMissingOrBroken) {
  const std::string file = write("b1.csv", csv(0, 3));
  write("b2.csv", "x,y,z\n1,2\n");
  EXPECT_THAT(error_of(in_folder(file, "b*.csv")), HasSubstr("b2.csv: line 2"));
  EXPECT_THAT(error_of(in_folder(file, "b*.csv"), 3),
              AllOf(HasSubstr("b2.csv: line 2"), HasSubstr(" (rank 1 on ")));
  EXPECT_EQ(error_of(in_folder(file, "c*.csv"), 3),
            in_folder(file, "c*.csv") + ": no file matches");
  std::filesystem::create_directory_symlink("loop", in_folder(file, "loop"));
  EXPECT_EQ(error_of(in_folder(file, "loop/*.csv")),
            in_folder(file, "loop: cannot be listed: Too many levels of symbolic links"));
  EXPECT_THAT(error_of(in_folder(file, "gone.csv"), 2), HasSubstr("gone.csv: cannot be opened"));
}

}  // namespace
}  // namespace meniscus
