#include "waymark/robots/gazebo/gazebo_robot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

TEST(GazeboTopics, AreListedWithTheirTypes) {
  testing::expect_on_page("robots", topic_list_text({}));
  const std::string two = topic_list_text({{"/a", "ignition.msgs.Pose"}, {"/b", "ignition.msgs.IMU"}});
  EXPECT_NE(two.find("/a [ignition.msgs.Pose], /b [ignition.msgs.IMU]"), std::string::npos) << two;
}

}  // namespace
}  // namespace waymark
