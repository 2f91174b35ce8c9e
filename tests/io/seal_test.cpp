#include "io/seal.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "io/sample_surface.hpp"
#include "io/temporary_folder.hpp"
#include "io/writers.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

using testing::HasSubstr;

const std::string kJobOfTest = "00c0ffee00c0ffee";

void put(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

// A small output by its ending, with a job.
void write_output(const std::string& path, const std::string& job, int width = 9) {
  const Surface surface = sample_surface(sample_camera(width, width * 7 / 9));
  OutputFile file(path);
  if (path.ends_with(".exr"))
    write_exr(file, surface, {}, Compression::zip, false, job);
  else if (path.ends_with(".png"))
    write_png(file, surface, Preview::lit, job);
  else
    write_mesh(file, surface.mesh, job);
  file.commit();
}

class Seal : public testing::TestWithParam<const char*> {
 protected:
  TemporaryFolder folder;
  std::string path = folder / (std::string("a.") + GetParam());
};

TEST_P(Seal, AWholeFileOfTheSameJobHasNoFlaw) {
  write_output(path, kJobOfTest);
  EXPECT_EQ(flaw_of(path, kJobOfTest), "");
  EXPECT_EQ(flaw_of(path, ""), "");
  EXPECT_THAT(file_bytes(path), HasSubstr("meniscus.job"));
  const std::string job = kJobOfTest;
  EXPECT_EQ(stated_job(path, job.size()), path.ends_with(".stl") ? "" : job);
  EXPECT_THAT(file_bytes(path), testing::Not(HasSubstr(kNoHash)));
}

TEST_P(Seal, AJobMustBeTheSameToTheLastLetter) {
  write_output(path, kJobOfTest);
  for (const std::string& other : {kJobOfTest.substr(1), kJobOfTest.substr(0, 15), kJobOfTest + "0",
                                   std::string("00c0ffee00c0ffef")})
    EXPECT_THAT(flaw_of(path, other), HasSubstr("other settings")) << other;
}

TEST_P(Seal, WithoutAJobItIsOfNoJob) {
  write_output(path, "");
  EXPECT_EQ(flaw_of(path, ""), "");
  EXPECT_THAT(flaw_of(path, kJobOfTest), HasSubstr("other settings"));
  EXPECT_THAT(file_bytes(path), testing::Not(HasSubstr("meniscus.job")));
}

TEST_P(Seal, NoBeginningOfAFileIsWhole) {
  write_output(path, kJobOfTest);
  const std::string bytes = file_bytes(path);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    put(path, bytes.substr(0, size));
    ASSERT_NE(flaw_of(path, ""), "") << size << " of " << bytes.size();
  }
  put(path, bytes + '\0');
  EXPECT_NE(flaw_of(path, ""), "");
}

TEST_P(Seal, NoBitCanChangeUnseen) {
  write_output(path, kJobOfTest);
  const std::string bytes = file_bytes(path);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += 7) {  // one or two a byte
    std::string damaged = bytes;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    put(path, damaged);
    ASSERT_NE(flaw_of(path, kJobOfTest), "") << "bit " << bit;
  }
  put(path, bytes);
  EXPECT_EQ(flaw_of(path, kJobOfTest), "");
}

TEST_P(Seal, HashesFilesOfManyPieces) {
  Surface surface = sample_surface(sample_camera(300, 300));
  for (int k = 0; k < 100000; ++k) {
    surface.mesh.position.push_back({1.0f / static_cast<float>(k), 0, 0});
    surface.mesh.normal.push_back({0, 0, 1});
    surface.mesh.triangle.push_back({0, 1, 2});
  }
  OutputFile file(path);
  if (path.ends_with(".exr")) {
    write_exr(file, surface, {}, Compression::none, false, kJobOfTest);
  } else if (path.ends_with(".png")) {  // smooth pictures pack too well: its first chunk, then any
    file.write(std::string(33, '.') + seal_chunks(kJobOfTest) + std::string(3 << 20, '.'));
    seal(file, OutputFormat::png);
  } else {
    write_mesh(file, surface.mesh, kJobOfTest);
  }
  file.commit();
  std::string bytes = file_bytes(path);
  ASSERT_GT(bytes.size(), std::size_t{2} << 20);
  EXPECT_EQ(flaw_of(path, kJobOfTest), "");
  for (const std::size_t at : {std::size_t{70'000}, std::size_t{1} << 20, bytes.size() - 1}) {
    ++bytes[at];
    put(path, bytes);
    EXPECT_NE(flaw_of(path, kJobOfTest), "") << at;
    --bytes[at];
  }
  put(path, bytes.substr(0, std::size_t{1} << 16));  // where the first piece ends
  EXPECT_NE(flaw_of(path, kJobOfTest), "");
}

TEST_P(Seal, SaysWhatIsWrongWithAFile) {
  EXPECT_EQ(flaw_of(path, ""), "is missing");
  EXPECT_EQ(flaw_of(folder / ("no/a." + std::string(GetParam())), ""), "is missing");
  put(path, "");
  EXPECT_EQ(flaw_of(path, ""), "is empty");
  put(path, "something else");
  EXPECT_THAT(flaw_of(path, ""), HasSubstr("has no hash"));
  write_output(path, kJobOfTest);
  const std::string bytes = file_bytes(path);
  put(path, bytes.substr(0, bytes.size() - 1));
  EXPECT_THAT(flaw_of(path, ""), HasSubstr("cut off"));
  std::filesystem::create_directory(folder / "d.exr");
  EXPECT_EQ(flaw_of(folder / "d.exr", ""), "is not a regular file");
}

TEST_P(Seal, AFormatUnderAnothersNameIsNotWhole) {
  write_output(path, kJobOfTest);
  for (const std::string ending : {"exr", "ply", "obj", "png", "txt"}) {
    if (ending == GetParam()) continue;
    std::filesystem::copy_file(path, folder / ("b." + ending));
    EXPECT_NE(flaw_of(folder / ("b." + ending), kJobOfTest), "") << ending;
  }
}

TEST_P(Seal, RefusesAJobThatIsNoShortWord) {
  for (const std::string& job : {std::string("a b"), std::string("a\n"), std::string(65, 'a')})
    EXPECT_THROW(write_output(path, job), InvalidArgument);
  EXPECT_THAT(folder.entries(), testing::IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Formats, Seal,
                         testing::Values("exr", "ply", "obj", "vtp", "glb", "stl", "png"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace meniscus
