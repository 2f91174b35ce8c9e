#include "program/cli/program.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <future>
#include <sstream>

namespace meniscus::test {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

int Program::start(const std::vector<std::string>& arguments, const Conditions& conditions) const {
  const std::string out = path("stdout.log"), err = path("stderr.log");
  std::vector<std::string> words = conditions.launcher;
  words.push_back(conditions.program);
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  const pid_t process = fork();
  if (process != 0) return process;
  for (const auto& [name, value] : conditions.environment)
    value.empty() ? unsetenv(name.c_str()) : setenv(name.c_str(), value.c_str(), 1);
  dup2(open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
  dup2(open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
  if (conditions.file_size_limit > 0) {
    const auto bytes = static_cast<rlim_t>(conditions.file_size_limit);
    const rlimit limit{bytes, bytes};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  if (chdir(folder_.path().c_str()) == 0) execv(argv[0], argv.data());
  _exit(127);
}

Outcome Program::wait_for(int process) const {
  int status = 0;
  if (waitpid(process, &status, 0) != process) throw std::runtime_error("waitpid failed");
  const int code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  return {code, read("stdout.log"), read("stderr.log")};
}

Outcome Program::run(const Words& arguments, const Conditions& conditions) const {
  return wait_for(start(arguments, conditions));
}

Outcome Program::run_well(const Words& arguments, const Conditions& conditions) const {
  const Outcome outcome = run(arguments, conditions);
  std::string command = "meniscus";
  for (const std::string& word : arguments) command += " " + word;
  EXPECT_EQ(outcome.exit_code, 0) << command << "\n" << outcome.err;
  return outcome;
}

Outcome Program::run_on_terminal(int columns, const std::vector<std::string>& arguments) const {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  winsize size{};
  size.ws_row = 24;
  size.ws_col = static_cast<unsigned short>(columns);
  if (terminal < 0 || grantpt(terminal) != 0 || unlockpt(terminal) != 0 ||
      ioctl(terminal, TIOCSWINSZ, &size) != 0)
    throw std::runtime_error("no terminal can be made");
  const std::string device = ptsname(terminal);
  // So that what is written stays until it is read.
  const int held = open(device.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  const int process = start(arguments, {{}, 0, {"/bin/sh", "-c", "exec \"$@\" 2>" + device, "sh"}});
  std::future<Outcome> ended =
      std::async(std::launch::async, [&, process] { return wait_for(process); });
  std::string shown;
  for (bool over = false, more = true; more || !over;) {
    over = ended.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    pollfd there{terminal, POLLIN, 0};
    char part[4096];
    const ssize_t count = poll(&there, 1, 100) > 0 ? ::read(terminal, part, sizeof part) : 0;
    more = count > 0;
    if (more) shown.append(part, static_cast<std::size_t>(count));
  }
  close(held);
  close(terminal);
  Outcome outcome = ended.get();
  outcome.err = shown;
  return outcome;
}

std::string Program::read(const std::string& name) const {
  std::ifstream file(folder_ / name, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void Program::write(const std::string& name, const std::string& bytes) const {
  std::ofstream(folder_ / name, std::ios::binary) << bytes;
}

std::vector<std::string> Program::files() const {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    const std::string name = entry.path().filename().string();
    if (name != "stdout.log" && name != "stderr.log") names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::map<std::string, std::string> Program::outputs(const std::string& stem) const {
  std::map<std::string, std::string> bytes;
  for (const std::string& file : files())
    if (file.starts_with(stem)) bytes[file] = read(file);
  return bytes;
}

void Program::write_particles(const std::string& name,
                              const std::vector<std::array<double, 3>>& points, double radius,
                              const std::string& velocity) const {
  std::ostringstream text;
  text << "ply\nformat ascii 1.0\n";
  if (radius > 0) text << "comment time 0 particle_radius " << radius << "\n";
  text << "element vertex " << points.size()
       << "\nproperty float x\nproperty float y\nproperty float z\n"
       << (velocity.empty() ? "" : "property float vx\nproperty float vy\nproperty float vz\n")
       << "end_header\n";
  for (const auto& p : points)
    text << p[0] << ' ' << p[1] << ' ' << p[2] << ' ' << velocity << '\n';
  write(name, text.str());
}

std::vector<std::array<double, 3>> block(int n) {
  std::vector<std::array<double, 3>> points;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k)
        points.push_back({0.2 * i - 0.1 * n, 0.2 * j - 0.1 * n, 0.2 * k - 0.1 * n});
  return points;
}

std::vector<std::string> bars_in(const std::string& shown) {
  std::vector<std::string> bars;
  std::istringstream turns(shown);
  for (std::string turn; std::getline(turns, turn, '\r');)
    if (const std::size_t end = turn.find('\x1b'); end != 0 && end != std::string::npos)
      bars.push_back(turn.substr(0, end));
  return bars;
}

void expect_error(const Outcome& outcome, int code, const std::vector<std::string>& parts) {
  EXPECT_EQ(outcome.exit_code, code) << outcome.err;
  std::istringstream lines(outcome.err);
  std::string line, last;
  int errors = 0;
  while (std::getline(lines, line)) {
    const std::string error = "meniscus: error: ", of_a_frame = error + "frame ";
    const bool is_frames = line.starts_with(of_a_frame) && line.size() > of_a_frame.size() &&
                           line[of_a_frame.size()] >= '0' && line[of_a_frame.size()] <= '9';
    if (line.starts_with(error) && !is_frames) ++errors;  // the batch has one of its own, too
    last = line;
  }
  EXPECT_EQ(errors, 1) << outcome.err;
  EXPECT_THAT(last, StartsWith("meniscus: error: ")) << outcome.err;
  for (const std::string& part : parts) EXPECT_THAT(last, HasSubstr(part));
}

}  // namespace meniscus::test
