// What the build makes a handle of for each kernel: its name, and the types that it takes.
#pragma once

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>

#include <tuple>
#include <type_traits>
#include <utility>

namespace meniscus {

template <class T>
struct Buffer;

/// A kernel's pointer to memory of the device that holds values of T.
template <class T>
struct Global {
  using Value = T;
};

/// The arguments behind a noun of kernels/nouns.h.
template <class... Types>
struct ArgumentTypes {};

/// A noun: one argument of a launch, several of the kernel.
template <class T>
concept Noun = requires {
  typename T::Types;
};

/// A kernel of kernels/<file> and the types of its arguments, as the text has them: launch() checks
/// them when it is compiled. cmake/embed.cmake makes one for each (device/kernels.hpp).
template <class... Types>
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

/// The same of all that is behind a noun.
template <class All, class Tuple>
inline constexpr bool takes_all = false;
template <class... Types, class... Arguments>
inline constexpr bool takes_all<ArgumentTypes<Types...>, std::tuple<Arguments...>> =
    (takes<Types, std::remove_cvref_t<Arguments>> && ...);
template <Noun Parameter, class Argument>
inline constexpr bool takes<Parameter, Argument> =
    takes_all<typename Parameter::Types,
              decltype(Parameter::parts(std::declval<const Argument&>()))>;

/// What an argument of a launch is to the kernel: itself, or of a noun the members that it names.
template <class Parameter, class Argument>
auto parts_of(const Argument& argument) {
  if constexpr (Noun<Parameter>)
    return Parameter::parts(argument);
  else
    return std::tie(argument);
}

}  // namespace meniscus
