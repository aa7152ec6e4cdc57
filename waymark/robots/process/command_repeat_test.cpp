#include "waymark/robots/process/command_repeat.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

TEST(CommandRepeat, PublishesAtLeastTwentyTimesASecondAndNothingOlderThanTheTimeout) {
  Random random(1);
  CommandRepeat repeat;
  Duration last_published{};
  Duration last_given = Duration(-1);
  for (Duration now{}; now < std::chrono::seconds(60); now += milliseconds(1)) {
    const bool there = (now / std::chrono::seconds(5)) % 2 == 0;  // the driver comes and goes
    if (there && random.uniform() < 0.03) {
      repeat.offer({0.3, 0.1}, now);
      last_given = now;
    }
    const auto command = repeat.due(now);
    if (!command) {
      ASSERT_LE(now - last_published, milliseconds(50));
      continue;
    }
    last_published = now;
    const bool fresh = last_given >= Duration(0) && now - last_given <= milliseconds(250);
    ASSERT_EQ(command->speed_m_s != 0, fresh) << now.count();
  }
}

TEST(CommandRepeat, WhatIsNoNumberIsZero) {
  CommandRepeat repeat;
  repeat.offer({std::numeric_limits<double>::quiet_NaN(), 1}, milliseconds(1));
  const auto command = repeat.due(milliseconds(1));
  ASSERT_TRUE(command);
  EXPECT_EQ(*command, VelocityCommand{});
}

}  // namespace
}  // namespace waymark
