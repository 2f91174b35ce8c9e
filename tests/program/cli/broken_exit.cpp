// broken_exit: a library to be preloaded that aborts a process while it ends, as a runtime does
// that is taken apart under its threads.
#include <cstdlib>

namespace {
struct Broken {
  ~Broken() { std::abort(); }
} const broken;
}  // namespace
