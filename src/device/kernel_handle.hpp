// What the build makes a handle of for each kernel: its name, and the types that it takes.
#pragma once

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>

#include <type_traits>

namespace meniscus {

template <class T>
struct Buffer;

/// A kernel's pointer to memory of the device that holds values of T.
template <class T>
struct Global {
  using Value = T;
};

/// A kernel of kernels/<file> and the types of its arguments, as the text has them: launch() checks
/// them when it is compiled. cmake/embed.cmake makes one for each (device/kernels.hpp).
template <class... Parameters>
struct KernelHandle {
  const char* file;
  const char* name;
  int number;  // among all
};

/// Whether a kernel takes a buffer of T for its pointer to Value: the same values, or 32 bits of
/// any kind that it orders as integers (atomic minima).
template <class Value, class T>
inline constexpr bool takes_values = std::is_same_v<Value, T> || (std::is_same_v<Value, cl_uint> &&
                                                                  sizeof(T) == sizeof(cl_uint));
template <>
inline constexpr bool takes_values<cl_float4, cl_float> = true;

template <class Parameter, class Argument>
inline constexpr bool takes = std::is_same_v<Parameter, Argument>;
template <class Value, class T>
inline constexpr bool takes<Global<Value>, Buffer<T>> = takes_values<Value, T>;

}  // namespace meniscus
