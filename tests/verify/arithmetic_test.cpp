// The probes: that devices pass them, and that each can fail.
#include "verify/arithmetic.hpp"

#include <gmock/gmock.h>

#include <set>

#include "stages/stage_test_support.hpp"
#include "verify/bits.hpp"

namespace meniscus::verify {
namespace {

using Arithmetic = OnDevice;
using Probe = void (*)(Device&, const Report&);

std::vector<Row> rows_of(Probe probe, Device& device) {
  std::vector<Row> rows;
  probe(device, [&](Row row) { rows.push_back(std::move(row)); });
  return rows;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

struct Fault {
  const char *probe, *from, *to;
};

// The names of the probes that fail with the kernels' text changed.
std::set<std::string> failing(Probe probe, const DeviceInfo& info,
                              const std::vector<Fault>& faults) {
  Device device(info);
  device.state().kernel_text = [&](const std::string& file, const std::string& text) {
    std::string faulty = text;
    if (file == "arithmetic.cl")
      for (const Fault& fault : faults) faulty = replaced(faulty, fault.from, fault.to);
    return faulty;
  };
  std::set<std::string> names;
  for (const Row& row : rows_of(probe, device))
    if (row.result == Result::fail) names.insert(row.kernel);
  return names;
}

std::set<std::string> probes_of(const std::vector<Fault>& faults) {
  std::set<std::string> names;
  for (const Fault& fault : faults) names.insert(fault.probe);
  return names;
}

TEST_P(Arithmetic, EveryRequiredProbePasses) {
  std::vector<Row> rows = rows_of(probe_expressions, device_);
  for (Row& row : rows_of(probe_execution, device_)) rows.push_back(std::move(row));
  EXPECT_GT(rows.size(), 100u);
  std::set<std::string> names;
  for (const Row& row : rows) {
    EXPECT_EQ(row.group, "probe");
    EXPECT_TRUE(!row.required || row.result == Result::pass)
        << row.kernel << " " << row.variant << ": " << row.reason;
    EXPECT_TRUE(names.insert(row.kernel + ", " + row.variant + ", " + row.size).second)
        << row.kernel << " is asked twice";
  }
}

TEST_P(Arithmetic, OneBitOfOneValueFailsEveryExpression) {
  const auto failed = failing(
      probe_expressions, GetParam(),
      {{"", "STOREI(found, result + i);", "STOREI(i / 8 == 97 ? found ^ 1 : found, result + i);"}});
  for (const Row& row : rows_of(probe_expressions, device_))
    EXPECT_TRUE(failed.count(row.kernel) || row.ulp > 0)  // what is measured may err a little
        << row.kernel;
}

TEST_P(Arithmetic, WhatCompilersDoInsteadIsFoundAndNamed) {
  const std::vector<Fault> faults{
      {"quotient", "FLOATS(QUOTIENT, a / b)", "FLOATS(QUOTIENT, a * (1.0f / b))"},
      {"fused", "FLOATS(FUSED, fma(a, b, c))", "FLOATS(FUSED, a * b + c)"},
      {"product_and_sum", "FLOATS(PRODUCT_AND_SUM, a * b + c)",
       "FLOATS(PRODUCT_AND_SUM, fma(a, b, c))"},
      {"product_and_difference", "DIFFERENCE, c - a * b)", "DIFFERENCE, fma(-a, b, c))"},
      {"sum_of_products", "a * b + b * c + c * a", "fma(c, a, fma(b, c, a * b))"},
      {"sum_of_three", "a + (b + c)", "a + b + c"},
      {"sum_taken_back", "(a + b) - a", "b"},
      {"product_taken_back", "a * b / b", "a"},
      {"common_factor", "a * b + a * c", "a * (b + c)"},
      {"least", "LEAST, fmin(a, b)", "LEAST, SELECT(a, b, b < a)"},
      {"greatest", "GREATEST, fmax(a, b)", "GREATEST, SELECT(a, b, b > a)"},
      {"denormal_sum", "DENORMAL_SUM, a + b)",
       "DENORMAL_SUM, SELECT(a + b, 0.0f * (a + b), fabs(a + b) < 1.17549435e-38f))"}};
  Device device(GetParam());
  device.state().kernel_text = [&](const std::string&, const std::string& text) {
    std::string faulty = text;
    if (text.find("compute_values") != std::string::npos)
      for (const Fault& fault : faults) faulty = replaced(faulty, fault.from, fault.to);
    return faulty;
  };
  std::set<std::string> failed;
  for (const Row& row : rows_of(probe_expressions, device)) {
    if (row.result != Result::fail || !probes_of(faults).count(row.kernel)) continue;
    failed.insert(row.kernel);
    EXPECT_GT(row.ulp, 0) << row.kernel;
    EXPECT_THAT(row.reason, testing::HasSubstr(" of 2048 differ, first at a = 0x"));
    if (row.kernel != "denormal_sum") {  // flushing the sum alone is not what devices do
      EXPECT_THAT(row.reason, testing::HasSubstr("; all as if ")) << row.kernel;
    }
  }
  EXPECT_EQ(failed, probes_of(faults));
}

TEST_P(Arithmetic, EveryProbeOfExecutionCanFail) {
  const std::vector<Fault> faults{
      {"sum_in_order", "k < count; ++k) total += LOADF(values + k * sums + i)",
       "k < count; ++k) total += LOADF(values + (count - 1 - k) * sums + i)"},
      {"vector_loads", "vload8(0, from + i + 6)", "vload8(0, from + (i + 6) / 4 * 4)"},
      {"lanes", "out[10] = ALL(negative);", "out[10] = ANY(negative);"},
      {"private_memory", "kept[(k + i) & 3]", "kept[(k + (i & 6)) & 3]"},
      {"arguments", "result[3] = c;", "result[3] = d.s0;"},
      {"tickets", "atomic_inc(counter + (i & mask))", "atomic_inc(counter + (i & mask)) & ~1u"},
      {"atomic_bounds", "atomic_min(least_signed + at, as_int(value[i]))",
       "atomic_min((volatile global uint*)least_signed + at, value[i])"},
      {"barriers", "own >= step ?", "own > step ?"},
      {"local_memory", "k * 2654435761u + group", "k % (WORDS - 1) * 2654435761u + group"},
      {"ids", "get_local_id(0) + get_local_size(0)", "get_local_id(0) + get_local_size(1)"},
      {"order", "to[i] = from", "if (i < n - 1) to[i] = from"},
      {"macros", "\n// Every value from its", "\n\n// Every value from its"}};
  const auto failed = failing(probe_execution, GetParam(), faults);
  for (const Fault& fault : faults) EXPECT_TRUE(failed.count(fault.probe)) << fault.probe;
}

TEST_P(Arithmetic, WhatDoesNotBuildFailsAloneWithTheCompilersWords) {
  Device device(GetParam());
  device.state().kernel_text = [](const std::string& file, const std::string& text) {
    return file == "arithmetic.cl" ? replaced(text, "vload4(0", "vload_four(0") : text;
  };
  for (const Row& row : rows_of(probe_execution, device)) {
    const bool broken = row.kernel == "vector_loads";
    EXPECT_EQ(row.result == Result::fail, broken) << row.kernel << ": " << row.reason;
    if (broken) {
      EXPECT_THAT(row.reason, testing::HasSubstr("arithmetic.cl"));
    }
  }
}

MENISCUS_ON_EVERY_DEVICE(Arithmetic);

TEST(Bits, DifferencesAreCountedAndMeasured) {
  const std::vector<std::uint32_t> one{bits_of(1.0f), bits_of(-0.0f), bits_of(NAN), 7};
  std::vector<std::uint32_t> other = one;
  EXPECT_EQ(compare(one, other, Reading::floats).count, 0u);
  other[2] ^= 1;  // another NaN
  EXPECT_EQ(compare(one, other, Reading::floats).count, 0u);
  EXPECT_EQ(compare(one, other, Reading::integers).count, 1u);
  other[1] = 0;  // the other zero
  EXPECT_EQ(compare(one, other, Reading::unsigned_zeros).count, 0u);
  EXPECT_EQ(compare(one, other, Reading::floats).first, 1u);
  other[0] += 3;
  EXPECT_EQ(compare(one, other, Reading::floats).ulp, 3);
  EXPECT_EQ(compare(one, other, Reading::floats).first, 0u);
  EXPECT_EQ(compare(one, {one[0]}, Reading::integers).count, 3u);  // what is missing differs
  EXPECT_EQ(ulp_of(1), 0x1p-23);
  EXPECT_EQ(ulp_of(-1.999), 0x1p-23);
  EXPECT_EQ(ulp_of(0), 0x1p-149);
  EXPECT_EQ(hex(0x3f800000, Reading::floats), "0x3f800000 (1)");
  EXPECT_EQ(hex(0xffffffff, Reading::integers), "0xffffffff (-1)");
}

}  // namespace
}  // namespace meniscus::verify
