#include "io/output_file.hpp"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "io/sample_surface.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

TEST(OutputFile, AppearsOnCommitWithEverythingWritten) {
  const TemporaryFolder folder;
  const std::string path = folder / "räksmörgås with spaces.bin";
  const std::string body(3'000'001, 'x');  // more than its buffer, not a multiple of it
  {
    OutputFile file(path);
    file.write("head");
    file.write(body);
    EXPECT_EQ(file.position(), 4 + body.size());
    file.seek(1);
    file.write("EA");
    EXPECT_EQ(file.position(), 3u);
    EXPECT_FALSE(std::filesystem::exists(path));
    file.commit();
  }
  EXPECT_EQ(file_bytes(path), "hEAd" + body);
  EXPECT_EQ(folder.entries().size(), 1u);
}

TEST(OutputFile, LeavesNothingAndTheOldFileWithoutCommit) {
  const TemporaryFolder folder;
  std::ofstream(folder / "old.bin") << "old";
  {
    OutputFile file(folder / "old.bin"), other(folder / "new.bin");
    file.write("new");
    other.write("new");
  }
  EXPECT_THAT(folder.entries(), ElementsAre("old.bin"));
  EXPECT_EQ(file_bytes(folder / "old.bin"), "old");
}

TEST(OutputFile, TwoWritersOfOneNameDoNotMix) {
  const TemporaryFolder folder;
  OutputFile first(folder / "a"), second(folder / "a");
  first.write("first");
  second.write("second");
  first.commit();
  second.commit();
  EXPECT_EQ(file_bytes(folder / "a"), "second");
  EXPECT_THAT(folder.entries(), ElementsAre("a"));
}

TEST(OutputFile, NamesTheFileTheReasonAndTheWayOut) {
  const TemporaryFolder folder;
  std::ofstream(folder / "plain") << "";
  const auto message = [](const std::string& path) {
    return text_of_thrown<OutputError>([&] { OutputFile file(path); });
  };
  EXPECT_EQ(message(folder / "no/where.exr"),
            (folder / "no/where.exr") +
                ": cannot be written: No such file or directory (make the "
                "folder " +
                (folder / "no") + " first)");
  EXPECT_THAT(message(folder.path().string()),
              AllOf(StartsWith(folder.path().string() + ": "), HasSubstr("Is a directory")));
  EXPECT_THAT(message(folder / "plain/a.exr"), HasSubstr("Not a directory"));
  EXPECT_THAT(message(folder / "plain/"), HasSubstr("cannot be written"));
  EXPECT_THAT(message("/dev/null"), HasSubstr("not a regular file"));
  EXPECT_THAT(message(folder / std::string(300, 'n') + "/a.png"), HasSubstr("File name too long"));
  EXPECT_THAT(message(""), HasSubstr("cannot be written"));
  EXPECT_THAT(folder.entries(), ElementsAre("plain"));
}

// Every writer against a disk, or a limit, that takes only a part of the file.
const std::vector<std::string> kOutputs = {"a.exr", "a.ply", "a.obj", "a.png"};

void write_any(const std::string& path) {
  Surface surface = sample_surface(sample_camera(320, 240));
  // Enough triangles that the mesh is larger than the limits below.
  surface.mesh.triangle.resize(40000, {0, 1, 2});
  if (path.ends_with(".exr")) return write_exr(path, surface, {}, Compression::none);
  if (path.ends_with(".png")) return write_png(path, surface);
  write_mesh(path, surface.mesh);
}

// Runs `action` in a child process, so that limits and mounts end with it. True: exit status 0.
bool in_child(const std::function<int()>& action) {
  const pid_t child = fork();
  if (child == 0) _exit(action());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(OutputFile, RefusesAFolderThatCannotBeWritten) {
  EXPECT_THAT(text_of_thrown<OutputError>([] { OutputFile file("/proc/meniscus.exr"); }),
              AllOf(StartsWith("/proc/meniscus.exr: cannot be written: "),
                    HasSubstr("(no file can be made in /proc; choose another folder)")));
  const TemporaryFolder folder;
  ASSERT_EQ(chmod(folder.path().c_str(), 0555), 0);
  // Root may write anywhere: another user tries.
  EXPECT_TRUE(in_child([&] {
    if (geteuid() == 0 && setuid(65534) != 0) return 2;
    const std::string message =
        text_of_thrown<OutputError>([&] { OutputFile file(folder / "a.exr"); });
    return message.ends_with("Permission denied (choose a folder that you may write to)") ? 0 : 1;
  }));
  EXPECT_THAT(folder.entries(), IsEmpty());
}

TEST(OutputFile, ReportsALimitOnFileSizesAndLeavesNothing) {
  for (const std::string& name : kOutputs) {
    for (const rlim_t limit : {1u, 20000u}) {
      const TemporaryFolder folder;
      EXPECT_TRUE(in_child([&] {
        signal(SIGXFSZ, SIG_IGN);
        const rlimit size = {limit, limit};
        if (setrlimit(RLIMIT_FSIZE, &size) != 0) return 2;
        const std::string message = text_of_thrown<OutputError>([&] { write_any(folder / name); });
        return message == (folder / name) +
                              ": cannot be written: File too large (raise the limit on the size of "
                              "files, ulimit -f)"
                   ? 0
                   : 1;
      })) << name
          << ", limit " << limit;
      EXPECT_THAT(folder.entries(), IsEmpty()) << name << ", limit " << limit;
    }
  }
}

TEST(OutputFile, ReportsAFullDiskAndLeavesNothing) {
  const TemporaryFolder folder;
  if (mount("tmpfs", folder.path().c_str(), "tmpfs", 0, "size=16k") != 0)
    GTEST_SKIP() << "a small disk cannot be mounted here: " << strerror(errno);
  for (const std::string& name : kOutputs) {
    EXPECT_THAT(text_of_thrown<OutputError>([&] { write_any(folder / name); }),
                AllOf(StartsWith(folder / name + ": cannot be written: No space left on device"),
                      HasSubstr("free some space")));
    EXPECT_THAT(folder.entries(), IsEmpty()) << name;
  }
  EXPECT_EQ(umount(folder.path().c_str()), 0);
}

TEST(OutputFile, ASignalHandlerRemovesPendingFiles) {
  const TemporaryFolder folder;
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGTERM, [](int) {
      remove_pending_outputs();
      _exit(15);
    });
    OutputFile done(folder / "done"), pending(folder / "pending"), other(folder / "other");
    done.commit();
    pending.write("half of it");
    if (write(ready[1], "x", 1) == 1) pause();
    _exit(1);
  }
  char byte;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_EQ(folder.entries().size(), 3u);
  kill(child, SIGTERM);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 15);
  EXPECT_THAT(folder.entries(), ElementsAre("done"));
  close(ready[0]);
  close(ready[1]);
}

// Other threads go on for a moment when a signal has come.
TEST(OutputFile, NoneIsLeftByThreadsThatMakeFilesWhileASignalEndsTheProcess) {
  const TemporaryFolder folder;
  for (int time = 0; time < 20; ++time) {
    const pid_t child = fork();
    if (child == 0) {
      std::atomic<int> made{0};
      for (int thread = 0; thread < 3; ++thread)
        std::thread([&] {
          for (;; ++made) OutputFile file(folder / "file");
        }).detach();
      while (made < 10) std::this_thread::yield();
      remove_pending_outputs();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_EQ(status, 0);
    ASSERT_THAT(folder.entries(), IsEmpty()) << "time " << time;
  }
}

TEST(OutputFile, ManyFilesAtOnce) {
  const TemporaryFolder folder;  // more than the registry of pending files holds
  std::vector<std::unique_ptr<OutputFile>> files;
  for (int k = 0; k < 70; ++k)
    files.push_back(std::make_unique<OutputFile>(folder / std::to_string(k)));
  for (const auto& file : files) file->commit();
  files.clear();
  EXPECT_EQ(folder.entries().size(), 70u);
}

TEST(OutputFile, FollowsLinksToAFileThatIsThereOrNotYet) {
  for (const bool there : {false, true}) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "real");
    if (there) std::ofstream(folder / "real/file") << "old and longer";
    std::filesystem::create_symlink("real/file", folder / "first");
    std::filesystem::create_symlink("first", folder / "link");
    OutputFile file(folder / "link");
    file.write("new");
    file.commit();
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
    EXPECT_EQ(file_bytes(folder / "real/file"), "new");
  }
}

TEST(OutputFile, LinksInACircleAreAnError) {
  const TemporaryFolder folder;
  std::filesystem::create_symlink("b", folder / "a");
  std::filesystem::create_symlink("a", folder / "b");
  EXPECT_THAT(text_of_thrown<OutputError>([&] { OutputFile file(folder / "a"); }),
              AllOf(StartsWith(folder / "a: cannot be written: "), HasSubstr("in a circle")));
  EXPECT_EQ(folder.entries().size(), 2u);
}

// What Linux's protected_symlinks refuses.
TEST(OutputFile, ALinkOfAnotherUserInASharedFolderIsNotFollowed) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can make another user's link";
  constexpr uid_t kOther = 65534;
  const TemporaryFolder folder;
  std::ofstream(folder / "precious") << "precious";
  std::filesystem::create_directory(folder / "shared");
  std::filesystem::create_symlink("../precious", folder / "shared/out");
  ASSERT_EQ(lchown((folder / "shared/out").c_str(), kOther, kOther), 0);
  const auto result = [&] {
    return text_of_thrown<OutputError>([&] {
      OutputFile file(folder / "shared/out");
      file.write("new");
      file.commit();
    });
  };
  ASSERT_EQ(chmod((folder / "shared").c_str(), 01777), 0);
  EXPECT_THAT(result(), AllOf(StartsWith(folder / "shared/out: cannot be written: "),
                              HasSubstr("a symbolic link of another user")));
  EXPECT_EQ(file_bytes(folder / "precious"), "precious");
  // The folder's owner may leave links in it.
  ASSERT_EQ(chown((folder / "shared").c_str(), kOther, kOther), 0);
  EXPECT_EQ(result(), "no error");
  EXPECT_EQ(file_bytes(folder / "precious"), "new");
}

TEST(OutputFile, KeepsTheModeOfTheFileThatItReplaces) {
  const TemporaryFolder folder;
  for (const mode_t mode : {0600u, 0644u, 0666u, 0750u}) {
    std::ofstream(folder / "a") << "old";
    ASSERT_EQ(chmod((folder / "a").c_str(), mode), 0);
    OutputFile file(folder / "a");
    file.commit();
    struct stat status {};
    ASSERT_EQ(stat((folder / "a").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 07777, mode);
  }
}

TEST(OutputFile, LeavesAFileThatIsReadOnly) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a") << "old";
  ASSERT_EQ(chmod((folder / "a").c_str(), 0444), 0);
  EXPECT_THAT(text_of_thrown<OutputError>([&] { OutputFile(folder / "a").commit(); }),
              AllOf(StartsWith(folder / "a: cannot be written: "), HasSubstr("read-only (chmod")));
  EXPECT_EQ(file_bytes(folder / "a"), "old");
  EXPECT_THAT(folder.entries(), ElementsAre("a"));
}

}  // namespace
}  // namespace meniscus
