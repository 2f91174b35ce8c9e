// What the library throws. It never prints and never exits.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "meniscus/export.hpp"
#include "meniscus/notice.hpp"

namespace meniscus MENISCUS_API {

/// The base of everything Meniscus throws. what() is one line: where, what was found, what was
/// wanted, what to do; `notice` has it as a code and numbers.
struct Error : std::runtime_error {
  /// `text` as Notice::text.
  explicit Error(const std::string& text) : Error(Notice{.text = text}) {}
  explicit Error(Notice what) : std::runtime_error(to_string(what)), notice(std::move(what)) {}
  Notice notice;
};

/// A file that is missing, truncated or wrong. The message begins with the file's name.
struct InputError : Error {
  using Error::Error;
};

/// A file that could not be written completely. Nothing is left under its final name.
struct OutputError : Error {
  using Error::Error;
};

/// A parameter, camera or array that a function cannot work with.
struct InvalidArgument : Error {
  using Error::Error;
};

/// No usable OpenCL device, a kernel that does not build, or an OpenCL call that failed.
struct DeviceError : Error {
  using Error::Error;
};

/// The device has no memory for what was asked of it. Less at a time may do: a smaller `memory` of
/// extract(), a smaller image, or another device.
struct OutOfDeviceMemory : DeviceError {
  using DeviceError::DeviceError;
};

/// Throws InvalidArgument with `message` unless `condition` holds.
inline void require(bool condition, const std::string& message) {
  if (!condition) throw InvalidArgument(message);
}

}  // namespace MENISCUS_API
