// What errors of the library are called in the program.
#include "program/wording.hpp"

#include <gtest/gtest.h>

#include "thrown.hpp"

namespace meniscus {
namespace {

TEST(Naming, PutsTheFileBeforeWhatIsWrongWithItOnce) {
  const auto text_of = [](const char* what) {
    return text_of_thrown<InputError>(
        [&] { naming("a.ply", [&]() -> int { throw InputError(what); }); });
  };
  EXPECT_EQ(text_of("no particle is left"), "a.ply: no particle is left");
  // A file that streams is read within the library, and names itself.
  EXPECT_EQ(text_of("a.ply: the file ends here"), "a.ply: the file ends here");
}

}  // namespace
}  // namespace meniscus
