// OpenCL calls that fail on purpose. Stands between a program and the OpenCL loader, as a preloaded
// library or among the program's own sources: counts the calls and makes one of them fail as a
// driver would. The environment says which, where a program is not changed for it:
//
//   MENISCUS_FAIL_CALL=12                 the 12th call
//   MENISCUS_FAIL_CALL=clCreateBuffer:3   the third of that name
//   MENISCUS_FAIL_CALL=clCreateBuffer:3+  that one and all after it
//   MENISCUS_FAIL_CODE=-5                 the error, else one that suits the call
//   MENISCUS_FAIL_DEVICE=basic            only calls for a queue of a device of such a name count
//   MENISCUS_DEVICE_MEMORY=1000000        buffers of more bytes in all cannot be made
//   MENISCUS_COUNT_CALLS=FILE             receives the name of each call, one a line
//
// clRelease... and clRetain... are neither counted nor fail: they do not where the object is valid.
#pragma once

#include <string>
#include <vector>

namespace meniscus::test {

/// Counts from 0 again, and makes a call fail as MENISCUS_FAIL_CALL says; "": none.
void fail_call(const std::string& which);

/// The names of those since then, in order.
std::vector<std::string> calls_made();

/// The call that failed; "": none has been reached.
std::string failed_call();

}  // namespace meniscus::test
