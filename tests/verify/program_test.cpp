// Manifests of others' kernels, and what is said of what they compute.
#include "verify/program.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>

#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "thrown.hpp"
#include "verify/flaws.hpp"

namespace meniscus::verify {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kDouble =
    "kernel void twice(global const float* from, global float* to) {\n"
    "  const int i = get_global_id(0);\n"
    "  to[i] = 2.0f * from[i];\n"
    "}\n";

Program program(const std::string& manifest, const std::string& source = kDouble) {
  return program_of(source, {"m.json", manifest});
}

Program with_argument(const std::string& argument) {
  std::string manifest = R"({"kernel": "k", "range": [8], "arguments": [)";
  manifest += argument;
  return program(manifest += "]}");
}

template <class T>
std::vector<T> values_of(const Bytes& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

std::string error_of(const std::string& manifest) {
  return text_of_thrown<InputError>([&] { program(manifest); });
}

std::string argument_error(const std::string& argument) {
  std::string manifest = R"({"kernel": "k", "range": [8], "arguments": [)";
  manifest += argument;
  return error_of(manifest += "]}");
}

TEST(Manifest, MakesValues) {
  const auto floats = [](const std::string& argument) {
    return values_of<float>(with_argument(argument).arguments[0].bytes);
  };
  const auto ints = [](const std::string& argument) {
    return values_of<std::int32_t>(with_argument(argument).arguments[0].bytes);
  };
  using testing::ElementsAre;
  EXPECT_THAT(floats(R"({"type": "float", "count": 2})"), ElementsAre(0, 0));
  EXPECT_THAT(floats(R"({"type": "float2", "count": 1, "fill": -1.5})"), ElementsAre(-1.5f, -1.5f));
  EXPECT_THAT(floats(R"({"type": "float", "values": [1, "-inf", "0x40000000"]})"),
              ElementsAre(1, -INFINITY, 2));
  EXPECT_THAT(floats(R"({"type": "float", "count": 3, "sequence": [0.5, 2]})"),
              ElementsAre(0.5f, 2.5f, 4.5f));
  EXPECT_THAT(ints(R"({"type": "int", "count": 3, "sequence": [5, -3]})"), ElementsAre(5, 2, -1));
  EXPECT_THAT(ints(R"({"type": "int", "values": [-2147483648, 2147483647]})"),
              ElementsAre(INT32_MIN, INT32_MAX));
  EXPECT_THAT(ints(R"({"type": "int3", "value": [1, 2, 3]})"), ElementsAre(1, 2, 3, 0));
  EXPECT_EQ(with_argument(R"({"local": 256})").arguments[0].local_bytes, 256u);
}

TEST(Manifest, DrawsTheSameNumbersForTheSameSeed) {
  const auto drawn = [](const std::string& seed) {
    return values_of<float>(
        with_argument(R"({"type": "float", "count": 1000, "random": [-1, 3], "seed": )" + seed +
                      "}")
            .arguments[0]
            .bytes);
  };
  const std::vector<float> first = drawn("7");
  EXPECT_EQ(first, drawn("7"));
  EXPECT_NE(first, drawn("8"));
  EXPECT_THAT(first, testing::Each(AllOf(testing::Ge(-1), testing::Le(3))));
  EXPECT_LT(*std::min_element(first.begin(), first.end()), -0.9f);
  EXPECT_GT(*std::max_element(first.begin(), first.end()), 2.9f);
  // Both ends of a range of integers are drawn, and nothing beyond.
  const auto dice = with_argument(R"({"type": "char", "count": 1000, "random": [-2, 1]})");
  const std::vector<signed char> thrown = values_of<signed char>(dice.arguments[0].bytes);
  EXPECT_EQ(*std::min_element(thrown.begin(), thrown.end()), -2);
  EXPECT_EQ(*std::max_element(thrown.begin(), thrown.end()), 1);
}

TEST(Manifest, ErrorsSayWhereWhatAndWhatIsWanted) {
  EXPECT_THAT(error_of("{"), HasSubstr("m.json: is not JSON: parse error at line 1"));
  EXPECT_THAT(error_of("[]"), HasSubstr("m.json: found \"[]\", wanted {\"kernel\""));
  EXPECT_THAT(error_of(R"({"kernal": "k"})"),
              HasSubstr("m.json: unknown key \"kernal\", wanted one of kernel, options, range"));
  EXPECT_THAT(error_of(R"({"range": [8]})"), HasSubstr("has no key \"kernel\""));
  EXPECT_THAT(error_of(R"({"kernel": "k"})"), HasSubstr("has no key \"range\""));
  for (const std::string range : {"8", "[]", "[0]", "[-1]", "[1,1,1,1]", "[2.5]", "[4294967296]"}) {
    std::string manifest = R"({"kernel": "k", "range": )", found = "m.json: range: found \"";
    manifest += range + "}";
    found += range + "\", wanted 1 to 3 whole numbers";
    EXPECT_THAT(error_of(manifest), HasSubstr(found));
  }
  EXPECT_THAT(error_of(R"({"kernel": "k", "range": [100], "group": [48], "arguments": [1]})"),
              HasSubstr("group: 48 does not divide the range 100"));
  EXPECT_THAT(error_of(R"({"kernel": "k", "range": [4, 4], "group": [4]})"),
              HasSubstr("group: has 1 number, wanted as many as \"range\": 2"));
  EXPECT_THAT(error_of(R"({"kernel": "k", "range": [8], "repeat": 0})"),
              HasSubstr("repeat: found \"0\", wanted a whole number from 1"));
  EXPECT_THAT(error_of(R"({"kernel": "k", "range": [8]})"),
              HasSubstr("arguments: wanted a list of the kernel's arguments"));
}

TEST(Manifest, ErrorsNameTheArgument) {
  EXPECT_THAT(argument_error(R"({"type": "float", "count": 8}, {"name": "to", "type": "half"})"),
              AllOf(HasSubstr("m.json: argument 1 (to): type: found \"half\", wanted one of char"),
                    HasSubstr("float4")));
  EXPECT_THAT(argument_error(R"({"type": "float5", "count": 1})"), HasSubstr("\"float5\""));
  EXPECT_THAT(argument_error(R"({"type": "float3", "count": 1})"),
              HasSubstr("takes the room of four"));
  EXPECT_THAT(argument_error(R"({"type": "int", "cuont": 8})"), HasSubstr("unknown key \"cuont\""));
  EXPECT_THAT(argument_error(R"({"type": "int"})"), HasSubstr("has no key \"count\""));
  EXPECT_THAT(argument_error(R"({"type": "int", "count": -1})"), HasSubstr("count: found \"-1\""));
  EXPECT_THAT(argument_error(R"({"type": "int", "count": 2, "fill": 1, "random": [0, 1]})"),
              HasSubstr("has fill, random, wanted one of them"));
  EXPECT_THAT(argument_error(R"({"type": "uchar", "count": 2, "fill": 256})"),
              HasSubstr("fill: found \"256\", wanted a number that a uchar holds"));
  EXPECT_THAT(argument_error(R"({"type": "int", "count": 2, "fill": 1.5})"),
              HasSubstr("fill: found"));
  EXPECT_THAT(argument_error(R"({"type": "float", "count": 2, "fill": 1e300})"),
              HasSubstr("wanted a number that a float holds"));
  EXPECT_THAT(argument_error(R"({"type": "float", "count": 2, "random": [0, 1e300]})"),
              HasSubstr("wanted a number that a float holds"));
  EXPECT_THAT(argument_error(R"({"type": "int", "count": 3, "values": [1, 2]})"),
              HasSubstr("values: has 2 numbers, wanted 3"));
  EXPECT_THAT(argument_error(R"({"type": "int", "count": 2, "expected": [1, 2, 3]})"),
              HasSubstr("expected: has 3 numbers, wanted 2"));
  EXPECT_THAT(argument_error(R"({"type": "int", "value": 1, "count": 2})"),
              HasSubstr("has both \"value\" and \"count\""));
  EXPECT_THAT(argument_error(R"({"type": "int", "count": 2, "ulp": 1})"), HasSubstr("ulp: found"));
  EXPECT_THAT(argument_error(R"({"type": "int", "file": "a"})"),
              HasSubstr("files are not read here"));
  EXPECT_THAT(argument_error("7"), HasSubstr("argument 0: found \"7\""));
}

// Before any of it is allocated: these would take exabytes.
TEST(Manifest, BoundsSizesFirst) {
  for (const char* argument :
       {R"({"type": "float", "count": 1000000000000000000, "random": [0, 1]})",
        R"({"type": "double16", "count": 18446744073709551615})",
        R"({"type": "int", "count": 1000000000000, "values": [1]})",
        R"({"type": "int", "count": 1000000000000, "file": "a"})",
        R"({"type": "char", "count": 1000}, {"type": "char", "count": 1073741000})"})
    EXPECT_THAT(argument_error(argument),
                AllOf(HasSubstr("all arguments together may take 1.0 GiB"),
                      HasSubstr("(give a smaller count)")))
        << argument;
}

TEST(Manifest, ReadsFilesBesideIt) {
  const TemporaryFolder folder;
  const auto write = [&](const char* name, const std::string& bytes) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
  };
  write("k.cl", kDouble);
  write("from.bin", std::string("\0\0\x80\x3f\0\0\0\x40", 8));
  const auto read = [&](const std::string& argument) {
    write("m.json", R"({"kernel": "twice", "range": [2], "arguments": [)" + argument + "]}");
    return read_program(folder / "k.cl", folder / "m.json");
  };
  const auto error = [&](const std::string& argument) {
    return text_of_thrown<InputError>([&] { read(argument); });
  };
  const Program program = read(R"({"type": "float", "file": "from.bin", "expected": "from.bin"})");
  EXPECT_EQ(program.source, std::string("#line 1 \"k.cl\"\n") + kDouble);
  EXPECT_THAT(values_of<float>(program.arguments[0].bytes), testing::ElementsAre(1, 2));
  EXPECT_EQ(program.arguments[0].expected, program.arguments[0].bytes);
  EXPECT_THAT(error(R"({"type": "float", "file": "no.bin"})"),
              HasSubstr("no.bin: cannot be opened: No such file"));
  EXPECT_THAT(error(R"({"type": "float", "count": 3, "file": "from.bin"})"),
              HasSubstr("from.bin: has 8 bytes, wanted 12"));
  EXPECT_THAT(error(R"({"type": "double2", "file": "from.bin"})"),
              HasSubstr("from.bin: has 8 bytes, wanted a multiple of the 16 of a double2"));
  EXPECT_THAT(error(R"({"type": "float", "count": 1, "expected": "from.bin"})"),
              HasSubstr("from.bin: has 8 bytes, wanted 4"));
}

TEST(Difference, CountsValuesBeyondWhatIsAllowed) {
  ProgramArgument argument =
      with_argument(R"({"name": "to", "type": "float", "count": 4})").arguments[0];
  const auto bytes = [](const char* values) {
    return with_argument(std::string(R"({"type": "float", "values": )") + values + "}")
        .arguments[0]
        .bytes;
  };
  const Bytes wanted = bytes(R"([1, "nan", 0, 2])");
  const Bytes found = bytes(R"(["0x3f800002", "0x7fc00001", "0x80000000", "0x40000001"])");
  EXPECT_EQ(difference(argument, wanted, found),
            "argument to: 3 of 4 values differ, the first at 0: found 0x3f800002 (1.00000024), "
            "wanted 0x3f800000 (1)");
  argument.ulp = 1;
  EXPECT_EQ(difference(argument, wanted, found),
            "argument to: 1 of 4 values differ by more than 1.00 ulp, the first at 0: found "
            "0x3f800002 (1.00000024), wanted 0x3f800000 (1)");
  argument.ulp = 2;
  double ulp = 0;
  EXPECT_EQ(difference(argument, wanted, found, &ulp), "");
  EXPECT_EQ(ulp, 2);
  EXPECT_THAT(difference(argument, wanted, bytes(R"([1, 1, 0, 2])")), HasSubstr("1 of 4"))
      << "a number from none";
  argument.type = {"short", ValueType::Kind::integer, 2, 1};
  argument.ulp = 0;
  EXPECT_EQ(difference(argument, {1, 0, 0xff, 0xff}, {1, 0, 0xfe, 0xff}),
            "argument to: 1 of 2 values differ, the first at 1: found -2, wanted -1");
}

std::vector<Row> rows_of(const Program& program) {
  Device device;
  std::vector<Row> rows;
  run_program(device, program, "program", [&](Row row) { rows.push_back(std::move(row)); });
  return rows;
}

constexpr const char* kTwice = R"({"kernel": "twice", "range": [4], "arguments": [
  {"name": "from", "type": "float", "sequence": [1, 1], "count": 4},
  {"name": "to", "type": "float", "count": 4, "expected": [2, 4, 6, 8]}]})";

TEST(ProgramRun, TellsOfRunsAndOfWhatIsExpected) {
  const std::vector<Row> rows = rows_of(program(kTwice));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].variant, "3 runs");
  EXPECT_EQ(rows[0].size, "4 work-items");
  EXPECT_EQ(rows[1].variant, "expected to");
  for (const Row& row : rows) EXPECT_EQ(row.result, Result::pass) << row.reason;

  std::string wrong = kDouble;
  wrong.replace(wrong.find("2.0f * from[i]"), 14, "as_float(as_int(2.0f * from[i]) + 1)");
  const std::vector<Row> other = rows_of(program(kTwice, wrong));
  ASSERT_EQ(other.size(), 2u);
  EXPECT_EQ(other[0].result, Result::pass);
  EXPECT_EQ(other[1].result, Result::fail);
  EXPECT_EQ(other[1].ulp, 1);
  EXPECT_THAT(other[1].reason, HasSubstr("argument to: 4 of 4 values differ, the first at 0"));
}

TEST(ProgramRun, TakesEveryKindOfArgument) {
  const char* const source =
      "kernel void k(global int* to, const int4 add, local int* shared, const double by) {\n"
      "  const int i = get_local_id(0);\n"
      "  shared[i] = add.w + (int)by;\n"
      "  barrier(CLK_LOCAL_MEM_FENCE);\n"
      "  to[get_global_id(1) * 4 + i] = shared[3 - i] + (int)get_global_id(1) * add.x;\n"
      "}\n";
  const std::vector<Row> rows = rows_of(program(
      R"({"kernel": "k", "range": [4, 2], "group": [4, 1], "repeat": 1, "arguments": [
        {"name": "to", "type": "int", "count": 8, "expected": [9, 9, 9, 9, 19, 19, 19, 19]},
        {"type": "int4", "value": [10, 0, 0, 4]}, {"local": 16}, {"type": "double", "value": 5}]})",
      source));
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].result, Result::pass) << rows[0].reason;
}

TEST(ProgramRun, ErrorsNameTheKernel) {
  const auto error = [](const std::string& manifest, const std::string& source) {
    return text_of_thrown<DeviceError>([&] { rows_of(program(manifest, source)); });
  };
  EXPECT_THAT(error(kTwice, "kernel void twice("), HasSubstr("it did not build: "));
  EXPECT_THAT(error(kTwice, "kernel void other() {}"), HasSubstr("the source has no kernel twice"));
  EXPECT_THAT(error(kTwice, "kernel void twice(global float* to) {}"),
              HasSubstr("it takes 1 argument, the manifest has 2"));
  EXPECT_THAT(error(kTwice, "kernel void twice(global float* to, int n) {}"),
              HasSubstr("giving twice its argument to"));
}

TEST(Flaws, AreLookedForAndNotRequired) {
  Device device;
  std::set<std::string> kernels;
  for (const Item& item : flaw_items())
    run_item(item, device, [&](const Row& row) {
      EXPECT_EQ(row.group, "flaw");
      EXPECT_FALSE(row.required);
      kernels.insert(row.kernel);
    });
  EXPECT_THAT(kernels,
              testing::ElementsAre("array_of_structs", "fma_of_zero", "not_of_lanes",
                                   "sixteen_floats", "struct_through_pointer", "zero_minus"));
}

// What rusticl makes of it, on any device.
TEST(Flaws, AreFoundWhereTheyAre) {
  std::string source(flaw_file("zero_minus.cl"));
  const std::string right = "0.0f - values[i]";
  source.replace(source.rfind(right), right.size(), "-values[i]");
  const std::vector<Row> rows = rows_of(program(std::string(flaw_file("zero_minus.json")), source));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[1].result, Result::fail);
  EXPECT_THAT(rows[1].reason, HasSubstr("argument negated: 1 of 4 values differ, the first at 0: "
                                        "found 0x80000000 (-0), wanted 0x00000000 (0)"));
}

TEST(Agreement, IsWithTheFirstDeviceThatRan) {
  const Program twice = program(kTwice);
  const Bytes from = twice.arguments[0].bytes, right = *twice.arguments[1].expected;
  Bytes wrong = right;
  wrong[0] ^= 1;
  std::vector<std::pair<std::size_t, Row>> rows;
  const auto report = [&](std::size_t device, Row row) {
    rows.emplace_back(device, std::move(row));
  };
  compare_devices(twice, {"a", "b", "c", "d"}, {{}, {from, right}, {from, right}, {from, wrong}},
                  report);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].first, 1u);
  EXPECT_EQ(rows[0].second.result, Result::pass);
  EXPECT_EQ(rows[1].second.result, Result::pass);
  EXPECT_EQ(rows[1].second.reason, "as on b");
  EXPECT_EQ(rows[2].first, 3u);
  EXPECT_EQ(rows[2].second.result, Result::fail);
  EXPECT_EQ(rows[2].second.ulp, 1);
  EXPECT_THAT(rows[2].second.reason, HasSubstr("not as on b: argument to: 1 of 4 values differ"));
  rows.clear();
  compare_devices(twice, {"a", "b"}, {{}, {from, right}}, report);
  EXPECT_THAT(rows, IsEmpty()) << "one device agrees with nobody";
}

TEST(Agreement, BuffersGoThroughBytesAndBack) {
  const Program twice = program(kTwice);
  const std::vector<Bytes> buffers{twice.arguments[0].bytes, twice.arguments[1].bytes};
  Bytes bytes = joined(buffers);
  EXPECT_EQ(parted(twice, bytes), buffers);
  bytes.pop_back();
  EXPECT_THAT(parted(twice, bytes), IsEmpty());
  EXPECT_THAT(parted(twice, {}), IsEmpty());
}

}  // namespace
}  // namespace meniscus::verify
