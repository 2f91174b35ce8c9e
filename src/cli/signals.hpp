// What the program does when it is told to stop, and when a file grows beyond a limit.
#pragma once

namespace meniscus::cli {

/// From here on SIGINT, SIGTERM and SIGHUP remove the outputs' temporary files and end the program
/// with 128 + signal, and a file that exceeds its size limit is a write error instead of a signal.
/// Call before any thread is started.
void handle_signals();

}  // namespace meniscus::cli
