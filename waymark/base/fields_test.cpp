#include "waymark/base/fields.hpp"

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

struct Motion {
  double noise = 0.1;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.noise, Field{"noise", "Noise of a step.", 0, 1});
  }
};

struct Follower {
  int count = 3;
  Motion motion{};
  bool careful = true;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.count, Field{"count", "How many.", 1, 9});
    visit(self.motion, Field{"motion", "How it moves."});
    visit(self.careful, Field{"careful", "Look twice."});
  }
};

TEST(FieldLeaves, AreVisitedInOrderBetweenTheirStructs) {
  const Follower follower;
  std::string seen;
  visit_leaves(
      follower, [&](const auto&, const Field& field) { seen += std::string(field.name) + " "; },
      [&](const Field& field) { seen += std::string(field.name) + "( "; }, [&] { seen += ") "; });
  EXPECT_EQ(seen, "count motion( noise ) careful ");
}

TEST(FieldLeaves, TheirRangesAreChecked) {
  EXPECT_TRUE(check_leaf_ranges(Follower{}));
  const Status nested = check_leaf_ranges(Follower{.motion = {.noise = 7}});
  ASSERT_FALSE(nested);
  EXPECT_EQ(nested.error().place.key, "noise");
  EXPECT_EQ(nested.error().hint, "Noise of a step.");
  EXPECT_EQ(check_leaf_ranges(Follower{.count = 0}).error().place.key, "count");
}

struct Job {
  std::string output{};
  std::optional<double> pause_s{};
  bool force = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.output, JobField("output FILE", "Recording to write").required());
    visit(self.pause_s, JobField("pause_s NUMBER", "Duration of the stop", 0, 60).usually("5").less());
    visit(self.force, JobField("force", "Replace an existing file").needs("output"));
  }
};

TEST(JobField, IsVisitedLikeAField) {
  EXPECT_EQ(field_names<Job>(), (std::vector<std::string>{"output", "pause_s", "force"}));
}

TEST(JobField, KeyAndValueNameAreSplitAtTheFirstSpace) {
  constexpr JobField kSize("anchor_pose X Y Z", "Pose of the anchor");
  EXPECT_EQ(kSize.name, "anchor_pose");
  EXPECT_EQ(kSize.value_name, "X Y Z");
  constexpr JobField kSwitch("force", "Replace a file");
  EXPECT_EQ(kSwitch.name, "force");
  EXPECT_TRUE(kSwitch.value_name.empty());
}

TEST(JobField, PropertiesCanBeChained) {
  Job job;
  Job::fields(job, [](auto&, const JobField& field) {
    EXPECT_EQ(field.is_required, field.name == "output");
    EXPECT_EQ(field.is_less, field.name == "pause_s");
    EXPECT_EQ(field.usual, field.name == "pause_s" ? "5" : "");
    EXPECT_EQ(field.needed, field.name == "force" ? "output" : "");
    EXPECT_EQ(field.max, field.name == "pause_s" ? 60 : std::numeric_limits<double>::infinity());
  });
}

struct SomeOptions {
  double scale = 1.0;
  int count = 2;
  std::string word = "yes";
  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.scale, Field{"scale", "Between 0 and 2.", 0, 2});
    visit(self.count, Field{"count", "At least 1.", 1});
    visit(self.word, Field{"word", "Any word."});
  }
};

TEST(Fields, NamesAreListedAndRangesChecked) {
  EXPECT_EQ(field_names<SomeOptions>(), (std::vector<std::string>{"scale", "count", "word"}));
  EXPECT_TRUE(check_ranges(SomeOptions{}));
  const Status too_large = check_ranges(SomeOptions{.scale = 3});
  ASSERT_FALSE(too_large);
  EXPECT_EQ(too_large.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(too_large.error().place.key, "scale");
  EXPECT_EQ(too_large.error().hint, "Between 0 and 2.");
  testing::expect_on_page("config", too_large.error());
  EXPECT_FALSE(check_ranges(SomeOptions{.scale = std::numeric_limits<double>::quiet_NaN()}));
  EXPECT_FALSE(check_ranges(SomeOptions{.count = 0}));
}

}  // namespace
}  // namespace waymark
