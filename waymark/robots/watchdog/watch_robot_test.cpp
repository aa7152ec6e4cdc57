#include "waymark/robots/watchdog/watch_robot.hpp"

#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

using std::chrono::nanoseconds;

WireCommand ahead(std::int64_t sequence, Duration given) {
  return {.sequence = sequence, .given = given, .speed_m_s = 0.3, .yaw_rate_rad_s = -0.1};
}

bool moves(const RobotOrder& order) { return order.speed_m_s != 0 || order.yaw_rate_rad_s != 0; }

TEST(WireCommand, RoundTrips) {
  const WireCommand command{12, Duration(8123456789), 0.1 + 0.2, -1e-17, 7};
  std::string line = wire_line(command);
  ASSERT_EQ(line.back(), '\n');
  line.pop_back();
  EXPECT_EQ(parse_wire_line(line).value(), command);
  for (const char* bad : {"", "command", "command 1 2 3 4", "command 1 2 3 4 5 6", "command 1 2 nan 4 5",
                          "command 1 2 3 inf 5", "command x 2 3 4 5", "stop 1 2 3 4 5", "command 1 2 3 4 5 "})
    EXPECT_FALSE(parse_wire_line(bad)) << bad;
}

TEST(CommandWatch, ForwardsACommandOnceAndStopsWhenItIsOld) {
  CommandWatch watch;
  const Duration start = milliseconds(1000);
  const auto first = watch.due(start);
  ASSERT_TRUE(first);
  EXPECT_FALSE(moves(*first));
  EXPECT_STREQ(first->reason, "no command yet");
  ASSERT_TRUE(watch.offer(ahead(1, start), start + milliseconds(3)));
  const auto order = watch.due(start + milliseconds(4));
  ASSERT_TRUE(order);
  EXPECT_EQ(order->speed_m_s, 0.3);
  EXPECT_DOUBLE_EQ(order->age_s, 0.004);
  EXPECT_EQ(order->reason, nullptr);
  EXPECT_FALSE(watch.due(start + milliseconds(250)));
  EXPECT_EQ(watch.next(start + milliseconds(250)), start + milliseconds(250) + nanoseconds(1));
  const auto stop = watch.due(start + milliseconds(250) + nanoseconds(1));
  ASSERT_TRUE(stop);
  EXPECT_FALSE(moves(*stop));
  EXPECT_STREQ(stop->reason, "no fresh command");
  EXPECT_FALSE(watch.due(start + milliseconds(299)));
  EXPECT_TRUE(watch.due(start + milliseconds(301))) << "zero is repeated";
  ASSERT_TRUE(watch.offer(ahead(2, start + milliseconds(400)), start + milliseconds(400)));
  EXPECT_TRUE(moves(watch.due(start + milliseconds(400)).value())) << "a fresh command drives again";
}

TEST(CommandWatch, RejectsOldRepeatedFutureAndNonFiniteCommands) {
  CommandWatch watch;
  const Duration now = milliseconds(1000);
  EXPECT_FALSE(watch.offer(ahead(1, now - milliseconds(251)), now)) << "it was in the pipe for too long";
  EXPECT_FALSE(watch.offer(ahead(1, now + nanoseconds(1)), now));
  WireCommand bad = ahead(1, now);
  bad.yaw_rate_rad_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(watch.offer(bad, now));
  EXPECT_TRUE(watch.offer(ahead(5, now), now));
  EXPECT_FALSE(watch.offer(ahead(5, now), now));
  EXPECT_FALSE(watch.offer(ahead(4, now), now));
  watch.give_up();
  EXPECT_FALSE(watch.offer(ahead(6, now), now));
  EXPECT_FALSE(moves(watch.due(now).value()))
      << "the driver has disconnected, so a fresh command does not drive either";
}

TEST(CommandWatch, NeverDrivesOnACommandOlderThanTheTimeout) {
  // The robot executes the last order until it receives the next one. The driver connects and disconnects,
  // and orders are read at irregular intervals.
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    CommandWatch watch;
    Duration now{};
    Duration given{};
    bool moving = false;
    std::int64_t sequence = 0;
    bool driver_there = true;
    for (int i = 0; i < 2000; ++i) {
      now += milliseconds(5);
      if (random.uniform() < 0.01) driver_there = !driver_there;
      if (driver_there && random.uniform() < 0.3) {
        const Duration late = milliseconds(static_cast<int>(random.uniform() * 400));
        (void)watch.offer(ahead(++sequence, now > late ? now - late : Duration{}), now);
      }
      const auto order = watch.due(now);
      if (!order) {
        ASSERT_TRUE(!moving || now - given <= milliseconds(250)) << "seed " << seed << ", step " << i;
        continue;
      }
      moving = moves(*order);
      if (moving) given = now - nanoseconds(static_cast<std::int64_t>(order->age_s * 1e9));
      ASSERT_LE(order->age_s, 0.25);
    }
  }
}

TEST(OrderLine, ContainsAllFields) {
  EXPECT_EQ(
      order_line({.sequence = 7, .speed_m_s = 0.25, .yaw_rate_rad_s = -1, .age_s = 0.0015, .step = 3}),
      "{\"type\":\"velocity\",\"sequence\":7,\"speed_m_s\":0.25,\"yaw_rate_rad_s\":-1,\"age_s\":0.001500,"
      "\"step\":3}\n");
  EXPECT_NE(order_line({.reason = "no fresh command"}).find(R"("stop":"no fresh command")"),
            std::string::npos);
}

}  // namespace
}  // namespace waymark
