// Running the kernels of others.
#include "verify/program.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

#include "base/comma_separated.hpp"
#include "base/elapsed.hpp"
#include "base/grouped.hpp"
#include "base/printed.hpp"
#include "device/opencl_error.hpp"
#include "verify/bits.hpp"

namespace meniscus::verify {
namespace {

using Clock = std::chrono::steady_clock;

std::uint64_t bits_at(const Bytes& bytes, std::size_t at, std::size_t size) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, bytes.data() + at, size);
  return bits;
}

double real_of(std::uint64_t bits, std::size_t size) {
  return size == 4 ? float_of(static_cast<std::uint32_t>(bits)) : std::bit_cast<double>(bits);
}

// One unit in the last place of a float or double of that size.
double ulp_of(double value, std::size_t size) {
  if (size == 4) return verify::ulp_of(value);
  return std::ldexp(1.0, std::max(value == 0 ? -1022 : std::ilogb(value), -1022) - 52);
}

// "0x3f800000 (1)" of a float, "-7" of an integer.
std::string shown_bits(std::uint64_t bits, const ValueType& type) {
  switch (type.kind) {
    case ValueType::Kind::floating:
      return type.bytes == 4 ? hex(static_cast<std::uint32_t>(bits), Reading::floats)
                             : printed("0x%016llx (%.17g)", static_cast<unsigned long long>(bits),
                                       real_of(bits, type.bytes));
    case ValueType::Kind::unsigned_integer:
      return std::to_string(bits);
    case ValueType::Kind::integer:
      break;
  }
  const std::size_t unused = 64 - 8 * type.bytes;
  return std::to_string(static_cast<std::int64_t>(bits << unused) >> unused);
}

std::string range_of(const Program& program) {
  const auto words = [](const std::vector<std::size_t>& sizes) {
    return comma_separated(
        sizes, [](std::size_t size) { return grouped(size); }, " x ");
  };
  return words(program.range) + " work-items" +
         (program.group.empty() ? "" : " in groups of " + words(program.group));
}

cl::NDRange nd_range(const std::vector<std::size_t>& sizes) {
  switch (sizes.size()) {
    case 0:
      return cl::NullRange;
    case 1:
      return {sizes[0]};
    case 2:
      return {sizes[0], sizes[1]};
    default:
      return {sizes[0], sizes[1], sizes[2]};
  }
}

// A kernel that is built, with its arguments.
class Launch {
 public:
  Launch(Device& device, const Program& program) : state_(device.state()), program_(program) {
    if (state_.guard && !state_.guard->allows(program.kernel)) throw KernelLeftOut(program.kernel);
    if (state_.guard) state_.guard->begins(program.kernel, "building", true);
    cl::Program built(state_.context, program.source);
    const cl_int error = clBuildProgram(built(), 1, &handle_of(state_.info)(),
                                        program.options.c_str(), nullptr, nullptr);
    if (error == CL_BUILD_PROGRAM_FAILURE)
      throw DeviceError("it did not build: " +
                        first_error(build_log(built, handle_of(state_.info))));
    if (error != CL_SUCCESS) throw cl::Error(error, "clBuildProgram");
    cl_int found = CL_SUCCESS;
    kernel_ = cl::Kernel(clCreateKernel(built(), program.kernel.c_str(), &found));
    if (found == CL_INVALID_KERNEL_NAME)
      throw DeviceError("the source has no kernel " + program.kernel);
    if (found != CL_SUCCESS) throw cl::Error(found, "clCreateKernel");
    const cl_uint count = kernel_.getInfo<CL_KERNEL_NUM_ARGS>();
    if (count != program.arguments.size())
      throw DeviceError("it takes " + counted(count, "argument") + ", the manifest has " +
                        std::to_string(program.arguments.size()));
    for (cl_uint k = 0; k < count; ++k) set(k, program.arguments[k]);
    if (state_.guard) state_.guard->ended();
  }

  // What one run leaves in the buffers.
  std::vector<Bytes> run() {
    std::vector<Bytes> left;
    const cl::CommandQueue& queue = state_.queue;
    for (std::size_t k = 0; k < buffers_.size(); ++k)
      if (const Bytes& bytes = program_.arguments[k].bytes; buffers_[k]())
        queue.enqueueWriteBuffer(buffers_[k], CL_TRUE, 0, bytes.size(), bytes.data());
    if (state_.guard) state_.guard->begins(program_.kernel, "running", true);
    queue.enqueueNDRangeKernel(kernel_, cl::NullRange, nd_range(program_.range),
                               nd_range(program_.group));
    queue.finish();
    if (state_.guard) state_.guard->ended();
    for (std::size_t k = 0; k < buffers_.size(); ++k) {
      left.emplace_back(buffers_[k]() ? program_.arguments[k].bytes.size() : 0);
      if (buffers_[k]())
        queue.enqueueReadBuffer(buffers_[k], CL_TRUE, 0, left.back().size(), left.back().data());
    }
    return left;
  }

 private:
  void set(cl_uint k, const ProgramArgument& argument) {
    buffers_.emplace_back();
    try {
      if (argument.kind == ProgramArgument::Kind::local) {
        kernel_.setArg(k, argument.local_bytes, nullptr);
      } else if (argument.kind == ProgramArgument::Kind::value) {
        kernel_.setArg(k, argument.bytes.size(), argument.bytes.data());
      } else {
        buffers_.back() = cl::Buffer(state_.context, CL_MEM_READ_WRITE, argument.bytes.size());
        kernel_.setArg(k, buffers_.back());
      }
    } catch (const cl::Error& error) {
      state_.fail("giving " + program_.kernel + " its argument " + argument.name, error);
    }
  }

  Device::State& state_;
  const Program& program_;
  cl::Kernel kernel_;
  std::vector<cl::Buffer> buffers_;  // of each argument; none for what is no buffer
};

}  // namespace

std::string difference(const ProgramArgument& argument, const Bytes& expected, const Bytes& found,
                       double* ulp) {
  const ValueType& type = argument.type;
  const std::size_t size = type.bytes, count = expected.size() / size;
  std::size_t differing = 0, first = 0;
  if (expected == found) return "";
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint64_t wanted = bits_at(expected, k * size, size),
                        own = bits_at(found, k * size, size);
    if (wanted == own) continue;
    if (type.kind == ValueType::Kind::floating) {
      const double x = real_of(wanted, size), y = real_of(own, size);
      if (std::isnan(x) && std::isnan(y)) continue;
      const double off = ulps_between(x, y, ulp_of(x, size));
      if (ulp) *ulp = std::max(*ulp, off);
      if (argument.ulp > 0 && off <= argument.ulp) continue;
    }
    if (differing++ == 0) first = k;
  }
  if (differing == 0) return "";
  std::string text = "argument " + argument.name + ": " + grouped(differing) + " of ";
  text += counted(count, "value");
  text += " differ";
  if (argument.ulp > 0) text += " by more than " + three_digits(argument.ulp) + " ulp";
  text += ", the first at " + std::to_string(first) + ": found ";
  text += shown_bits(bits_at(found, first * size, size), type) + ", wanted ";
  return text + shown_bits(bits_at(expected, first * size, size), type);
}

std::vector<Bytes> run_program(Device& device, const Program& program, const std::string& group,
                               const Report& report) {
  const auto begin = Clock::now();
  Row row;
  row.group = group;
  row.kernel = program.kernel;
  row.size = range_of(program);
  const auto finish = [&](const std::string& variant, const std::string& wrong, double ulp) {
    row.variant = variant;
    row.result = wrong.empty() ? Result::pass : Result::fail;
    row.ulp = wrong.empty() ? 0 : ulp > 0 ? ulp : -1;
    row.reason = wrong;
    report(row);
  };
  try {
    Launch launch(device, program);
    const std::vector<Bytes> first = launch.run();
    std::string wrong;
    for (int run = 2; run <= program.repeat && wrong.empty(); ++run) {
      const std::vector<Bytes> again = launch.run();
      // To the last bit, whatever devices may differ by.
      for (std::size_t k = 0; k < again.size() && wrong.empty(); ++k) {
        ProgramArgument strict = program.arguments[k];
        strict.ulp = 0;
        if (strict.compared) wrong = difference(strict, first[k], again[k]);
        if (!wrong.empty())
          wrong = "differs from run to run: run " + std::to_string(run) +
                  " is not like run 1: " + wrong;
      }
    }
    row.ms = milliseconds_since(begin);
    if (program.repeat > 1) finish(counted(program.repeat, "run"), wrong, 0);
    for (std::size_t k = 0; k < first.size(); ++k) {
      const ProgramArgument& argument = program.arguments[k];
      if (!argument.expected) continue;
      double ulp = 0;
      const std::string off = difference(argument, *argument.expected, first[k], &ulp);
      finish("expected " + argument.name, off, ulp);
    }
    return first;
  } catch (const cl::Error& error) {
    device.state().fail("running " + program.kernel, error);
  }
}

void compare_devices(const Program& program, const std::vector<std::string>& names,
                     const std::vector<std::vector<Bytes>>& left,
                     const std::function<void(std::size_t device, Row)>& report) {
  const auto ran = [](const std::vector<Bytes>& buffers) { return !buffers.empty(); };
  const auto first = std::find_if(left.begin(), left.end(), ran);
  if (first == left.end()) return;
  if (std::count_if(left.begin(), left.end(), ran) < 2) return;
  const auto reference = static_cast<std::size_t>(first - left.begin());
  for (std::size_t d = reference; d < left.size(); ++d) {
    if (!ran(left[d])) continue;
    Row row;
    row.group = "program";
    row.kernel = program.kernel;
    row.variant = "agreement";
    row.size = range_of(program);
    double ulp = 0;
    for (std::size_t k = 0; k < program.arguments.size() && row.reason.empty(); ++k)
      if (program.arguments[k].compared)
        row.reason = difference(program.arguments[k], (*first)[k], left[d][k], &ulp);
    row.result = row.reason.empty() ? Result::pass : Result::fail;
    row.ulp = ulp > 0 ? ulp : row.reason.empty() ? 0 : -1;
    if (d == reference)
      row.reason = "the others are compared with it";
    else
      row.reason = (row.reason.empty() ? "as on " : "not as on ") + names[reference] +
                   (row.reason.empty() ? "" : ": " + row.reason);
    report(d, std::move(row));
  }
}

Bytes joined(const std::vector<Bytes>& buffers) {
  Bytes all;
  for (const Bytes& bytes : buffers) all.insert(all.end(), bytes.begin(), bytes.end());
  return all;
}

std::vector<Bytes> parted(const Program& program, const Bytes& bytes) {
  std::vector<Bytes> buffers;
  std::size_t at = 0;
  for (const ProgramArgument& argument : program.arguments) {
    const std::size_t size =
        argument.kind == ProgramArgument::Kind::buffer ? argument.bytes.size() : 0;
    if (size > bytes.size() - at) return {};
    const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    buffers.emplace_back(from, from + static_cast<std::ptrdiff_t>(size));
    at += size;
  }
  return at == bytes.size() ? buffers : std::vector<Bytes>{};
}

}  // namespace meniscus::verify
