// What is seen of launches.
#include "verify/trace.hpp"

#include <gmock/gmock.h>

#include "meniscus/error.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus::verify {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ArgumentNames, AreThoseOfTheKernel) {
  EXPECT_THAT(argument_names("bins.cl", "bound_bins"),
              ElementsAre("cell", "bound", "cells", "bins", "side"));
  EXPECT_THAT(argument_names("bins.cl", "sum_counts"),
              ElementsAre("count", "total", "chunks", "own"));
  // Those behind nouns, as the kernel calls them.
  EXPECT_THAT(argument_names("sheet.cl", "average_on_sheets"),
              ElementsAre("mean", "cell_x", "cell_y", "cell_z", "cell_tag", "cell_start",
                          "cell_grid", "normal", "share", "value", "by"));
  EXPECT_THAT(argument_names("list_samples.cl", "keep_samples"),
              ElementsAre("sample", "count", "nearer", "depth", "unwanted", "kept", "kept_count",
                          "tiles", "where"));
  EXPECT_TRUE(argument_names("bins.cl", "no_such_kernel").empty());
}

using Traces = OnDevice;

// count_bins: two particles, both in the bin.
Buffer<cl_int> count(Device& device, int box_end) {
  const auto box = upload(device, std::vector<cl_int>{0, 0, box_end, 3, 0, 0, 3, 3});
  const auto key = upload(device, std::vector<float>{1, 2});
  const auto bound = upload(device, std::vector<float>{5});
  const auto counts = filled<cl_int>(device, 1, 0);
  launch(device, "bins.cl", "count_bins", {2}, "", box, key, bound, counts,
         filled<cl_uchar>(device, 2, 0), records::Chunked{2, 2, 1, 1, 0});
  return counts;
}

// The trace of one launch, and what it wrote.
Trace traced(Device& device, std::map<std::uint64_t, std::vector<std::uint8_t>>& values) {
  Tracer tracer(device, &values);
  count(device, 3);
  return tracer.trace();
}

TEST_P(Traces, OfTheSameLaunchesAreTheSame) {
  std::map<std::uint64_t, std::vector<std::uint8_t>> values;
  const Trace first = traced(device_, values);
  ASSERT_EQ(first.size(), 1u);
  ASSERT_EQ(first[0].written.size(), 2u);
  EXPECT_EQ(first[0].written[0].argument, 3);
  EXPECT_EQ(values.at(first[0].written[0].hash), (std::vector<std::uint8_t>{2, 0, 0, 0}));
  Tracer again(device_, first, values);
  count(device_, 3);
  EXPECT_EQ(again.findings().at("count_bins").launches, 1);
  EXPECT_EQ(again.findings().at("count_bins").differing, 0);
  EXPECT_EQ(again.other_launches(), "");
}

TEST_P(Traces, SayWhatDiffersAndPutItRight) {
  std::map<std::uint64_t, std::vector<std::uint8_t>> values;
  const Trace canonical = traced(device_, values);
  device_.state().forget_programs();
  device_.state().kernel_text = [](const std::string&, const std::string& text) {
    std::string wrong = text;
    if (const auto at = wrong.find("atomic_inc(counts"); at != std::string::npos)
      wrong.replace(at, 10, "atomic_dec");
    return wrong;
  };
  device_.state().stage = "visible";
  Tracer tracer(device_, canonical, values);
  const auto counts = count(device_, 3);
  const KernelFindings& found = tracer.findings().at("count_bins");
  EXPECT_EQ(found.differing, 1);
  EXPECT_THAT(found.first,
              HasSubstr("launch 1 of 1, stage visible, argument count: 1 of 1 values"));
  EXPECT_THAT(found.first, HasSubstr("found 0xfffffffe"));
  EXPECT_THAT(tracer.first_difference(),
              HasSubstr("kernel count_bins (launch 1 of 1, stage visible): argument"));
  EXPECT_EQ(download(device_, counts), std::vector<cl_int>{2}) << "the canonical value";
  device_.state().stage.clear();
}

TEST_P(Traces, EndWhereNothingCanBePutRight) {
  Trace canonical;
  {
    Tracer tracer(device_, nullptr);
    count(device_, 3);
    count(device_, 3);
    canonical = tracer.trace();
  }
  canonical[0].written[0].hash ^= 1;
  const std::map<std::uint64_t, std::vector<std::uint8_t>> none;
  Tracer tracer(device_, canonical, none);
  EXPECT_THROW(count(device_, 3), BeyondRepair);
  const KernelFindings& found = tracer.findings().at("count_bins");
  EXPECT_EQ(found.differing, 1);
  EXPECT_EQ(found.unknown, 1) << "the second launch, which was not reached";
  EXPECT_THAT(found.why_unknown,
              HasSubstr("not run: the case ended at kernel count_bins (launch 1 of 2"));
}

TEST_P(Traces, DoNotJudgeWhatHadOtherInputs) {
  std::map<std::uint64_t, std::vector<std::uint8_t>> values;
  const Trace canonical = traced(device_, values);
  {
    Tracer tracer(device_, canonical, values);
    count(device_, -1);
    EXPECT_EQ(tracer.findings().at("count_bins").launches, 0);
    EXPECT_EQ(tracer.findings().at("count_bins").unknown, 1);
    EXPECT_THAT(tracer.findings().at("count_bins").why_unknown,
                HasSubstr("its inputs are not the canonical ones, though each launch before it"));
    EXPECT_THAT(tracer.first_difference(),
                HasSubstr("kernel count_bins (launch 1 of 1): its inputs are not the canonical"));
  }
  Tracer tracer(device_, canonical, values);
  EXPECT_EQ(tracer.other_launches(), "0 launches, wanted 1");
  count(device_, 3);
  count(device_, 3);
  EXPECT_THAT(tracer.other_launches(), HasSubstr("is count_bins, wanted none"));
}

// Every run counts itself in the buffer's padding, which stays when its values are put back.
TEST_P(Traces, SayWhatDiffersFromRunToRun) {
  std::map<std::uint64_t, std::vector<std::uint8_t>> values;
  const Trace canonical = traced(device_, values);
  device_.state().forget_programs();
  device_.state().kernel_text = [](const std::string&, const std::string& text) {
    const std::string head = "kernel void count_bins(";
    std::string wrong = text;
    if (const auto at = wrong.find(head); at != std::string::npos)
      wrong.insert(wrong.find(") {", at) + 3,
                   " if (get_global_id(0) == 0) { atomic_inc(count + 1);"
                   " atomic_add(count, count[1] / 3); }");
    return wrong;
  };
  for (const int repeat : {2, 3}) {
    Tracer tracer(device_, canonical, values, {repeat, nullptr});
    const auto counts = count(device_, 3);
    const KernelFindings& found = tracer.findings().at("count_bins");
    EXPECT_EQ(found.differing, 0) << found.first;
    EXPECT_EQ(found.unsteady, repeat == 3 ? 1 : 0);
    EXPECT_EQ(found.first_unsteady,
              repeat == 3 ? "launch 1 of 1, run 3 is not like run 1: argument count: 1 of 1 values "
                            "differ, the first at 0: found 0x00000003 (3), wanted 0x00000002 (2)"
                          : "");
    EXPECT_EQ(download(device_, counts), std::vector<cl_int>{2}) << "what the first run left";
  }
}

// A guard that allows no launch of one kernel.
class Without : public LaunchGuard {
 public:
  explicit Without(std::string kernel) : kernel_(std::move(kernel)) {}
  bool allows(const std::string& kernel) override { return kernel != kernel_; }
  void begins(const std::string& kernel, const char* doing, bool) override {
    told.push_back(std::string(doing) + " " + kernel);
  }
  void ended() override { told.push_back("ended"); }
  bool waits() const override { return false; }
  std::vector<std::string> told;

 private:
  std::string kernel_;
};

TEST_P(Traces, PutCanonicalValuesInThePlaceOfWhatIsLeftOut) {
  std::map<std::uint64_t, std::vector<std::uint8_t>> values;
  const Trace canonical = traced(device_, values);
  Without guard("count_bins");
  device_.state().guard = &guard;
  {
    Tracer tracer(device_, canonical, values);
    const auto counts = count(device_, 3);
    EXPECT_EQ(tracer.findings().at("count_bins").left_out, 1);
    EXPECT_EQ(tracer.findings().at("count_bins").launches, 0);
    EXPECT_EQ(tracer.other_launches(), "");
    EXPECT_EQ(download(device_, counts), std::vector<cl_int>{2});
    EXPECT_THAT(guard.told, testing::IsEmpty()) << "nothing was built or run";
  }
  {
    const std::map<std::uint64_t, std::vector<std::uint8_t>> none;
    Tracer tracer(device_, canonical, none);
    EXPECT_THROW(count(device_, 3), BeyondRepair) << "nobody knows the values";
  }
  EXPECT_THROW(count(device_, 3), KernelLeftOut) << "nobody watches";
  device_.state().guard = nullptr;
}

TEST_P(Traces, AreAnnouncedBeforeTheyRun) {
  device_.state().forget_programs();
  Without guard("");
  device_.state().guard = &guard;
  {
    Tracer tracer(device_, nullptr);
    count(device_, 3);
  }
  device_.state().guard = nullptr;
  EXPECT_THAT(guard.told,
              ElementsAre("building count_bins", "ended", "running count_bins", "ended"));
}

MENISCUS_ON_EVERY_DEVICE(Traces);

}  // namespace
}  // namespace meniscus::verify
