#include "waymark/base/job_field.hpp"

#include <gtest/gtest.h>

#include <optional>

namespace waymark {
namespace {

struct Job {
  std::string output{};
  std::optional<double> pause_s{};
  bool force = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.output, JobField("output FILE", "Recording to write").required());
    visit(self.pause_s, JobField("pause_s NUMBER", "Duration of the stop", 0, 60).usually("5").less());
    visit(self.force, JobField("force", "Replace a file that is there").needs("output"));
  }
};

TEST(JobField, IsAFieldForWhatReadsFields) {
  EXPECT_EQ(field_names<Job>(), (std::vector<std::string>{"output", "pause_s", "force"}));
}

TEST(JobField, KeyAndNameOfTheValueAreSaidInOne) {
  constexpr JobField kSize("anchor_pose X Y Z", "Where it stands");
  EXPECT_EQ(kSize.name, "anchor_pose");
  EXPECT_EQ(kSize.value_name, "X Y Z");
  constexpr JobField kSwitch("force", "Replace a file");
  EXPECT_EQ(kSwitch.name, "force");
  EXPECT_TRUE(kSwitch.value_name.empty());
}

TEST(JobField, WhatIsSaidOfItAddsUp) {
  Job job;
  Job::fields(job, [](auto&, const JobField& field) {
    EXPECT_EQ(field.is_required, field.name == "output");
    EXPECT_EQ(field.is_less, field.name == "pause_s");
    EXPECT_EQ(field.usual, field.name == "pause_s" ? "5" : "");
    EXPECT_EQ(field.needed, field.name == "force" ? "output" : "");
    EXPECT_EQ(field.max, field.name == "pause_s" ? 60 : std::numeric_limits<double>::infinity());
  });
}

}  // namespace
}  // namespace waymark
