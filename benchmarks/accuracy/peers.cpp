#include "accuracy/peers.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "accuracy/mesh_file.hpp"
#include "io/output_file.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

namespace fs = std::filesystem;

/// A folder that goes away with its files.
struct Folder {
  std::string path;
  Folder() : path((fs::temp_directory_path() / "meniscus-accuracy-XXXXXX").string()) {
    if (mkdtemp(path.data()) == nullptr)
      throw OutputError(path + ": cannot be made: " + std::strerror(errno));
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

/// Rows of three floats: XYZ.
void write_positions(const std::string& path, const Particles& particles) {
  std::ofstream file(path, std::ios::binary);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const float position[3] = {particles.x[k], particles.y[k], particles.z[k]};
    file.write(reinterpret_cast<const char*>(position), sizeof position);
  }
  file.close();
  if (!file) throw OutputError(cannot_be_written(path, errno));
}

std::string last_line(const std::string& path) {
  std::ifstream file(path);
  std::string last;
  for (std::string line; std::getline(file, line);)
    if (!line.empty()) last = line;
  return last;
}

/// Runs the program of a peer to its end, what it says in `log`.
void run(const std::string& peer, std::vector<std::string> words, const std::string& log) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  pid_t child = 0;
  const int problem =
      posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (problem != 0)
    throw Error(peer + ": " + words[0] + " cannot be run: " + std::strerror(problem) +
                " (install it with benchmarks/peers/" + peer + ".sh, and give its path to --" +
                peer + ")");
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw Error(peer + ": " + words[0] + " failed: " + last_line(log));
}

/// What a peer makes of particles: `words_of` has the words of its command, given both files.
template <class WordsOf>
Mesh reconstruct(const std::string& peer, const Particles& particles, const WordsOf& words_of) {
  const Folder folder;
  const std::string input = folder.path + "/particles.xyz", mesh = folder.path + "/mesh.ply";
  write_positions(input, particles);
  run(peer, words_of(input, mesh), folder.path + "/log.txt");
  return read_mesh(mesh);
}

}  // namespace

Mesh reconstruct_with_splashsurf(const std::string& program, const Particles& particles,
                                 double particle_radius) {
  using Words = std::vector<std::string>;
  return reconstruct("splashsurf", particles, [&](const std::string& in, const std::string& out) {
    return Words{program,
                 "reconstruct",
                 in,
                 "-o",
                 out,
                 "-r=" + std::to_string(particle_radius),
                 "-l=2.0",
                 "-c=0.5",
                 "-t=0.6",
                 "--mesh-smoothing-weights=on",
                 "--mesh-smoothing-iters=25",
                 "--mesh-cleanup=on",
                 "--normals=on",
                 "--normals-smoothing-iters=10"};
  });
}

Mesh reconstruct_with_openvdb(const std::string& program, const Particles& particles,
                              double particle_radius) {
  using Words = std::vector<std::string>;
  return reconstruct("openvdb", particles, [&](const std::string& in, const std::string& out) {
    return Words{program, in, out, std::to_string(particle_radius)};
  });
}

}  // namespace meniscus::accuracy
