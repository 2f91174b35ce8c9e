#include <gmock/gmock.h>

#include "io/io_test_support.hpp"

namespace meniscus {
namespace {

using testing::HasSubstr;

class CameraJson : public InputTest {};

const std::string kView = "\"view\": [[1,0,0,0],[0,1,0,0],[0,0,1,-5],[0,0,0,1]]";
const std::string kProjection = "\"projection\": [[2,0,0,0],[0,2,0,0],[0,0,-1,-0.5],[0,0,-1,0]]";

std::string camera(const std::string& size, const std::string& view,
                   const std::string& projection) {
  return "{" + size + ", " + view + ", " + projection + "}";
}

TEST_F(CameraJson, ReadsAFile) {
  const Camera c = read_camera(test_data("camera.json"));
  EXPECT_EQ(c.width, 1024);
  EXPECT_EQ(c.height, 768);
  EXPECT_EQ(c.view[0], 0.755033118);
  EXPECT_EQ(c.view[11], -4.210235389);
  EXPECT_EQ(c.projection[5], 2.747477419);
  EXPECT_EQ(c.projection[14], -1.0);
}

TEST_F(CameraJson, UnknownKeysAreFine) {
  const std::string path = write(
      "c.json", camera("\"name\": \"left\", \"width\": 4, \"height\": 3", kView, kProjection));
  EXPECT_EQ(read_camera(path).width, 4);
}

TEST_F(CameraJson, SaysWhatIsWrong) {
  const std::string size = "\"width\": 4, \"height\": 3";
  EXPECT_EQ(error_of("c.json", "{\"width\": 4}"),
            "c.json: has no key \"height\", wanted width, height, view, projection");
  EXPECT_EQ(error_of("c.json", camera("\"width\": 4.5, \"height\": 3", kView, kProjection)),
            "c.json: width: found \"4.5\", wanted a whole number of pixels");
  EXPECT_THAT(error_of("c.json", camera("\"width\": 4, \"height\": 18446744073709551615", kView,
                                        kProjection)),
              HasSubstr("c.json: height: found \"18446744073709551615\""));
  EXPECT_THAT(error_of("c.json", camera(size, "\"view\": [1,0,0,0]", kProjection)),
              HasSubstr("c.json: view: row 0: found \"1\", wanted 4 numbers"));
  EXPECT_THAT(
      error_of("c.json", camera(size, "\"view\": [[1,0,0,0],[0,1,0,0],[0,0,1]]", kProjection)),
      HasSubstr("c.json: view: found \"[[1,0,0,0],[0,1,0,0],[0,0,1]]\", wanted 4 rows"));
  EXPECT_THAT(
      error_of("c.json",
               camera(size, kView, "\"projection\": [[2,0,0,0],[0,2,0,0],[0,0,null,1],[0,0,1,0]]")),
      HasSubstr("c.json: projection: row 2, column 2: found \"null\", wanted a number"));
  EXPECT_THAT(error_of("c.json", camera("\"width\": 0, \"height\": 3", kView, kProjection)),
              HasSubstr("c.json: camera: size is 0x3"));
  EXPECT_THAT(error_of("c.json", "[]"), HasSubstr("c.json: found \"[]\", wanted {\"width\""));
  EXPECT_THAT(error_of("c.json", "[]"), HasSubstr("a list of cameras is for a sequence"));
  EXPECT_THAT(error_of("c.json", "{\"width\": 4,\n \"height\" 3}"),
              HasSubstr("c.json: is not JSON: parse error at line 2"));
  EXPECT_THAT(error_of("c.json", "{\"width\": 1e999}"), HasSubstr("c.json: is not JSON: "));
  EXPECT_EQ(error_of("c.json", ""), "c.json: is empty (0 bytes)");
}

TEST_F(CameraJson, AnyCutIsAnError) {
  const std::string bytes = camera("\"width\": 4, \"height\": 3", kView, kProjection);
  for (std::size_t length = 0; length < bytes.size(); ++length)
    EXPECT_NE(error_of("c.json", bytes.substr(0, length)), "no error") << length;
}

TEST_F(CameraJson, DeepNestingIsAnErrorAndNoCrash) {
  const std::string nested = std::string(200'000, '[') + std::string(200'000, ']');
  for (const std::string& bytes : {nested, "{\"width\": " + nested + "}"})
    EXPECT_EQ(error_of("c.json", bytes), "c.json: is not JSON: it nests deeper than 32 levels");
}

}  // namespace
}  // namespace meniscus
