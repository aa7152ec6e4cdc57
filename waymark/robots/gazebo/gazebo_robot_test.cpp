#include "waymark/robots/gazebo/gazebo_robot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(GazeboTopics, AreNamedWithTheirTypes) {
  EXPECT_EQ(topics_in_words({}), "nobody publishes anything there");
  EXPECT_EQ(topics_in_words({{"/a", "ignition.msgs.Pose"}, {"/b", "ignition.msgs.IMU"}}),
            "published there: /a [ignition.msgs.Pose], /b [ignition.msgs.IMU]");
}

}  // namespace
}  // namespace waymark
