#include <gmock/gmock.h>

#include <sstream>
#include <string>

#include "io/io_test_support.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

class Read : public InputTest {};

std::string error_of_path(const std::string& path) {
  return text_of_thrown<InputError>([&] { read_particles(path); });
}

TEST_F(Read, ListsTheEndingsItKnows) {
  EXPECT_THAT(
      error_of("wave.mov", "ply\n"),
      HasSubstr(
          "wave.mov: unknown format, the name must end in one of .ply, .vtk, .vtp, .vtu, .npy, "
          ".npz, .h5, .hdf5, .bgeo, .bgeo.gz, .bgeo.sc, .bi4, .ffp3, .lammpstrj, .dump, .xyz, "
          ".csv"));
#ifndef MENISCUS_OPENVDB
  EXPECT_THAT(error_of("wave.vdb", " BDV"),
              HasSubstr("wave.vdb: this build reads no OpenVDB (build "
                        "Meniscus with -DMENISCUS_OPENVDB=ON"));
#endif
  EXPECT_THAT(error_of("ply", "ply\n"), HasSubstr("unknown format"));
}

TEST_F(Read, SaysWhatToDoWithFormatsThatItDoesNotRead) {
  const auto expect = [&](const char* endings, const std::string& what, const std::string& advice) {
    std::istringstream each(endings);
    for (std::string ending; each >> ending;)
      EXPECT_THAT(error_of("wave" + ending, "x"),
                  AllOf(StartsWith("wave" + ending + ": " + what +
                                   " is not read, the name must end in one of .ply, .vtk,"),
                        HasSubstr(", .csv"), EndsWith(" (" + advice + ")")));
  };
  const std::string open =
      "write its points as .bgeo.sc or .ply in a program that opens it, such as Houdini";
  const std::string maker =
      "let the program that made it write its particles in one of these, such as .ply or .csv";
  expect(".abc .ABC", "Alembic", open);
  expect(".usd .usda .usdc .usdz .USDZ", "USD", open);
  expect(".fbx", "FBX", open);
  expect(".geo", "Houdini's text", "write it as .bgeo or .bgeo.sc");
  expect(".prt", "Krakatoa's PRT", maker);
  expect(".bin .sim", "a program's own file", maker);
  expect(".obj", "OBJ", "a mesh has no particles: write the points that it was made of");
  expect(".laz", "LAS", "convert it to .ply, e.g. by PDAL");
  expect(".pvtu", "a list of pieces",
         "give its pieces instead, with a * for what differs in their names");
  expect(".txt", "plain text",
         "where it is a table, call it .csv with a row of names, or .xyz without one");
  expect(".ply.gz .zip", "a packed file", "unpack it first");
}

TEST_F(Read, SaysWhyAFileCannotBeRead) {
  EXPECT_EQ(error_of_path("no/such/wave.ply"),
            "no/such/wave.ply: cannot be opened: No such file or directory");
  // That there is none comes first, whatever its name says.
  for (const std::string name : {"no/such/wave", "no/such/wave.mov", "no/such/wave.geo"}) {
    const std::string expected = name + ": cannot be opened: No such file or directory";
    EXPECT_EQ(error_of_path(name), expected);
    EXPECT_EQ(text_of_thrown<InputError>([&] { open_particles(name); }), expected);
  }
  EXPECT_EQ(error_of("empty.ply", ""), "empty.ply: is empty (0 bytes)");
  const std::filesystem::path folder =
      std::filesystem::path(write("file.txt", "")).parent_path() / "folder.ply";
  std::filesystem::create_directory(folder);
  for (const std::filesystem::path& path : {folder, folder.parent_path()})
    EXPECT_EQ(error_of_path(path.string()), path.string() + ": is a directory, wanted a file");
}

}  // namespace
}  // namespace meniscus
