#include "waymark/server/background_thread.hpp"

#include <thread>

#include <gtest/gtest.h>
#include <sched.h>

namespace waymark {
namespace {

TEST(BackgroundThread, RunsOnAnotherProcessorThanTheRobot) {
  cpu_set_t allowed;
  ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  BackgroundThread background;
  background.note_robot_processor();
  int left_alone = -1;
  cpu_set_t used;
  std::thread server([&] {
    background.begin();
    background.avoid_robot_processor();
    left_alone = background.left_alone();
    sched_getaffinity(0, sizeof used, &used);
    EXPECT_EQ(sched_getscheduler(0), SCHED_BATCH);
  });
  server.join();
  if (CPU_COUNT(&allowed) == 1) {  // there is no other processor
    EXPECT_EQ(left_alone, -1);
    EXPECT_TRUE(CPU_EQUAL(&used, &allowed));
    return;
  }
  EXPECT_GE(left_alone, 0);
  EXPECT_FALSE(CPU_ISSET(static_cast<std::size_t>(left_alone), &used));
  EXPECT_EQ(CPU_COUNT(&used), CPU_COUNT(&allowed) - 1);
}

}  // namespace
}  // namespace waymark
