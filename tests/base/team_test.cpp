// What several ranks do together, against what one knows who has everything.
#include "base/team.hpp"

#include <gmock/gmock.h>

#include "base/thread_team.hpp"

namespace meniscus {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

// Ranks, and the largest message: whole, and in parts that end within a value's array.
struct Size {
  int ranks;
  std::size_t largest;

  friend void PrintTo(const Size& size, std::ostream* out) {
    *out << size.ranks << " ranks, " << size.largest << " bytes";
  }
};
class TeamOf : public testing::TestWithParam<Size> {
 protected:
  void run(const std::function<void(Team&)>& work) const {
    const TeamOutcome outcome = as_team(GetParam().ranks, work, GetParam().largest);
    EXPECT_THAT(outcome.errors, Each(IsEmpty()));
    EXPECT_LE(outcome.largest, GetParam().largest);
  }
};
INSTANTIATE_TEST_SUITE_P(All, TeamOf,
                         testing::Values(Size{1, 1 << 30}, Size{2, 1 << 30}, Size{3, 1 << 30},
                                         Size{2, 40}, Size{5, 24}),
                         [](const auto& info) {
                           return "Ranks" + std::to_string(info.param.ranks) + "Bytes" +
                                  std::to_string(info.param.largest);
                         });

TEST_P(TeamOf, TakesTheLeastAndTheSumOfEachPlace) {
  run([](Team& team) {
    const std::uint32_t rank = static_cast<std::uint32_t>(team.rank());
    const std::uint32_t ranks = static_cast<std::uint32_t>(team.size());
    std::vector<std::uint32_t> values(101);
    std::vector<std::int64_t> counts(101);
    for (std::uint32_t k = 0; k < values.size(); ++k) {
      values[k] = 1000 * ((k + rank) % ranks) + k;  // each rank has the least somewhere
      counts[k] = (std::int64_t{1} << 40) + rank;
    }
    team.minimum(values);
    team.sum(counts);
    for (std::uint32_t k = 0; k < values.size(); ++k) {
      EXPECT_EQ(values[k], k);
      EXPECT_EQ(counts[k], (std::int64_t{ranks} << 40) + ranks * (ranks - 1) / 2);
    }
    std::vector<std::uint32_t> none;
    team.minimum(none);
  });
}

TEST_P(TeamOf, GathersInTheRanksOrder) {
  run([](Team& team) {
    // Rank r has 7 r values: rank 0 none.
    const auto of = [](int rank) {
      std::vector<std::int32_t> values;
      for (int k = 0; k < 7 * rank; ++k) values.push_back(100 * rank + k);
      return values;
    };
    std::vector<int> ranks;
    team.gather(of(team.rank()), [&](int rank, std::vector<std::int32_t>&& values) {
      ranks.push_back(rank);
      EXPECT_EQ(values, of(rank));
    });
    EXPECT_EQ(ranks.size(), team.leads() ? static_cast<std::size_t>(team.size()) : 0u);
    EXPECT_TRUE(std::is_sorted(ranks.begin(), ranks.end()));

    const int last = team.size() - 1;
    ranks.clear();
    const auto take = [&](int rank, std::vector<std::int32_t>&& values) {
      ranks.push_back(rank);
      EXPECT_EQ(values, of(rank));
    };
    team.gather(of(team.rank()), take, last);
    EXPECT_EQ(ranks.size(), team.rank() == last ? static_cast<std::size_t>(team.size()) : 0u);
    EXPECT_TRUE(std::is_sorted(ranks.begin(), ranks.end()));

    std::vector<std::int32_t> expected;
    for (int rank = 0; rank < team.size(); ++rank)
      for (const std::int32_t value : of(rank)) expected.push_back(value);
    EXPECT_EQ(team.joined(of(team.rank())), expected);
    EXPECT_THAT(team.joined(std::vector<double>()), IsEmpty());
  });
}

TEST_P(TeamOf, HasWhatTheFirstHas) {
  run([](Team& team) {
    EXPECT_EQ(team.from_first(team.rank() + 0.5), 0.5);
    EXPECT_EQ(team.from_first(team.leads() ? std::string(100, 'a') : "b"), std::string(100, 'a'));
    EXPECT_EQ(team.from_first(std::string(team.leads() ? "" : "b")), "");
  });
}

TEST_P(TeamOf, EndsForAllWithTheErrorOfTheLowestRank) {
  const int last = GetParam().ranks - 1;
  for (const int failing : {0, last})
    for (const int steps : {0, 1, 2, 3, 4}) {
      const TeamOutcome outcome = as_team(GetParam().ranks, [&](Team& team) {
        std::vector<std::int64_t> counts(10);
        int done = 0;
        const auto step = [&] {
          if (done++ == steps && team.rank() >= failing)
            throw InputError("no row " + std::to_string(team.rank()));
        };
        step();
        team.sum(counts);
        step();
        team.joined(std::vector<char>(20));
        step();
        team.from_first(1);
        step();
        team.gather(std::vector<char>(20), [](int, std::vector<char>&&) {});
        step();
      });
      for (const std::string& error : outcome.errors)
        EXPECT_THAT(error, StartsWith("no row " + std::to_string(failing)));
      if (failing == 0)
        EXPECT_EQ(outcome.errors[0], "no row 0");
      else
        EXPECT_THAT(outcome.errors[0], HasSubstr(" (rank " + std::to_string(failing) + " on "));
    }
}

// Others still wait for their turn to send then.
TEST(Team, EndsWhenTheFirstFailsAmidWhatItGathers) {
  const TeamOutcome outcome = as_team(4, [](Team& team) {
    team.gather(std::vector<int>{team.rank()}, [](int rank, std::vector<int>&&) {
      if (rank == 1) throw std::bad_alloc();
    });
  });
  EXPECT_THAT(outcome.errors, Each(std::string("std::bad_alloc")));
}

TEST(Team, ThrowsOnlyOnceAskedAfterAFailure) {
  as_team(2, [](Team& team) {
    if (team.rank() == 1) {
      const std::string said = team.fail("broken");
      EXPECT_EQ(team.fail("again"), said);
    } else {
      EXPECT_THROW(team.meet(), TeamError);
    }
    EXPECT_THROW(team.meet(), TeamError);  // and waits for nobody
    EXPECT_THAT(team.fail("later"), StartsWith("broken"));
  });
}

TEST(Team, AloneDoesNothing) {
  Team& team = alone();
  EXPECT_EQ(team.size(), 1);
  EXPECT_TRUE(team.leads());
  std::vector<std::uint32_t> values{3, 1};
  team.minimum(values);
  EXPECT_THAT(values, ElementsAre(3u, 1u));
  EXPECT_THAT(team.joined(values), ElementsAre(3u, 1u));
  EXPECT_EQ(team.fail("message"), "message");
  team.meet();
  EXPECT_EQ(team.waited_ms(), 0);
}

}  // namespace
}  // namespace meniscus
