#include "waymark/base/field_leaves.hpp"

#include <string>

#include <gtest/gtest.h>

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
  EXPECT_EQ(to_string(check_leaf_ranges(Follower{.motion = {.noise = 7}}).error()),
            "(noise): 7 is outside [0, 1]. Noise of a step.");
  EXPECT_EQ(check_leaf_ranges(Follower{.count = 0}).error().place.key, "count");
}

}  // namespace
}  // namespace waymark
