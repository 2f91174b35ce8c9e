#include "program/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <sstream>

#include "meniscus/error.hpp"

namespace meniscus {
namespace {

// The words of MENISCUS_LAUNCHER.
std::vector<std::string> launcher() {
  const char* text = std::getenv("MENISCUS_LAUNCHER");
  std::istringstream line(text ? text : "");
  return {std::istream_iterator<std::string>(line), {}};
}

}  // namespace

std::string name_of_signal(int signal) {
  return "signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
}

ChildProcess::ChildProcess(const std::vector<std::string>& arguments, bool keep_errors) {
  std::vector<std::string> words = launcher();
  const bool launched = !words.empty();
  words.push_back(launched ? std::filesystem::read_symlink("/proc/self/exe").string() : "meniscus");
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  const auto fail = [](const char* what) {
    return Error(std::string(what) + " for a child process: " + std::strerror(errno));
  };
  if (keep_errors) errors_.reset(std::tmpfile());
  if (keep_errors && !errors_) throw fail("no temporary file");
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw fail("no pipe");
  const pid_t parent = getpid();
  child_ = fork();
  if (child_ < 0) {
    const Error error = fail("no memory or no number");
    ::close(ends[0]);
    ::close(ends[1]);
    throw error;
  }
  if (child_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(127);
    dup2(ends[1], STDOUT_FILENO);
    if (errors_) dup2(fileno(errors_.get()), STDERR_FILENO);
    if (launched)
      execvp(argv.front(), argv.data());
    else
      execv("/proc/self/exe", argv.data());
    dprintf(STDERR_FILENO, "%s%s cannot be started: %s\n", launched ? "MENISCUS_LAUNCHER: " : "",
            argv.front(), std::strerror(errno));
    _exit(127);
  }
  ::close(ends[1]);
  output_ = ends[0];
}

ChildProcess::~ChildProcess() {
  kill();
  wait();
  ::close(output_);
}

ChildProcess::Read ChildProcess::read_line(std::string& line, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto late = Clock::now() + std::chrono::duration<double>(seconds);
  for (;;) {
    if (const std::size_t end = buffer_.find('\n'); end != std::string::npos) {
      line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      return Read::line;
    }
    const double left = std::chrono::duration<double>(late - Clock::now()).count();
    if (left <= 0) return Read::late;
    pollfd wait_for{output_, POLLIN, 0};
    const int ready = poll(&wait_for, 1, static_cast<int>(std::ceil(1e3 * std::min(left, 1e6))));
    if (ready < 0 && errno != EINTR) return Read::end;
    if (ready <= 0) continue;
    char bytes[4096];
    const ssize_t count = ::read(output_, bytes, sizeof bytes);
    if (count == 0 || (count < 0 && errno != EINTR)) {
      if (buffer_.empty()) return Read::end;
      line = std::move(buffer_);
      buffer_.clear();
      return Read::line;
    }
    if (count > 0) buffer_.append(bytes, static_cast<std::size_t>(count));
  }
}

std::string ChildProcess::read_all() {
  std::string text, line;
  while (read_line(line, INFINITY) == Read::line) text += line + "\n";
  return text;
}

void ChildProcess::kill() {
  if (child_ > 0) ::kill(child_, SIGKILL);
}

std::string ChildProcess::wait() {
  if (child_ <= 0) return "";
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
  if (WIFSIGNALED(status)) return name_of_signal(WTERMSIG(status));
  const int code = WEXITSTATUS(status);
  return code == 0 ? "" : "exit code " + std::to_string(code);
}

std::string ChildProcess::last_words() const {
  if (!errors_) return "";
  std::string text(2048, '\0');
  std::fseek(errors_.get(), 0, SEEK_END);
  const long end = std::ftell(errors_.get());
  std::fseek(errors_.get(), std::max(0L, end - static_cast<long>(text.size())), SEEK_SET);
  text.resize(std::fread(text.data(), 1, text.size(), errors_.get()));
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

}  // namespace meniscus
