#include <gmock/gmock.h>

#include "io/io_test_support.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::HasSubstr;

class Read : public InputTest {};

std::string error_of_path(const std::string& path) {
  return text_of_thrown<InputError>([&] { read_particles(path); });
}

TEST_F(Read, ListsTheEndingsItKnows) {
  EXPECT_THAT(
      error_of("wave.abc", "ply\n"),
      HasSubstr(
          "wave.abc: unknown format, the name must end in one of .ply, .vtk, .vtp, .vtu, .npy, "
          ".npz, .h5, .hdf5, .bgeo, .bgeo.gz, .bgeo.sc, .bi4, .ffp3, .lammpstrj, .dump, .xyz, "
          ".csv (write the points of Alembic or USD as .bgeo.sc or .ply)"));
#ifndef MENISCUS_OPENVDB
  EXPECT_THAT(error_of("wave.vdb", " BDV"),
              HasSubstr("wave.vdb: this build reads no OpenVDB (build "
                        "Meniscus with -DMENISCUS_OPENVDB=ON"));
#endif
  EXPECT_THAT(error_of("ply", "ply\n"), HasSubstr("unknown format"));
}

TEST_F(Read, SaysWhyAFileCannotBeRead) {
  EXPECT_EQ(error_of_path("no/such/wave.ply"),
            "no/such/wave.ply: cannot be opened: No such file or directory");
  EXPECT_EQ(error_of("empty.ply", ""), "empty.ply: is empty (0 bytes)");
  const std::filesystem::path folder =
      std::filesystem::path(write("file.txt", "")).parent_path() / "folder.ply";
  std::filesystem::create_directory(folder);
  EXPECT_EQ(error_of_path(folder.string()), folder.string() + ": is a directory, wanted a file");
}

}  // namespace
}  // namespace meniscus
