#include "waymark/runtime/operator_input.hpp"

#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace waymark {
namespace {

using E = OperatorEvent;
using S = OperatorState;
using std::chrono::milliseconds;
using std::chrono::seconds;

class CountingDriver final : public LapDriver {
 public:
  void receive(const Sample& /*sample*/) override { ++received; }
  Result<DriverDecision> drive(Duration /*uptime*/, SensorTime /*now*/) override {
    ++decisions;
    return DriverDecision{};
  }
  int received = 0;
  int decisions = 0;
};

TEST(PacedDriver, WaitsForTheClock) {
  Duration clock = seconds(100);
  std::vector<Duration> waits;
  auto inner = std::make_unique<CountingDriver>();
  CountingDriver& counted = *inner;
  PacedDriver paced(
      std::move(inner), [&] { return clock; },
      [&](Duration wait) {
        waits.push_back(wait);
        clock += wait;
      });
  ASSERT_TRUE(paced.drive(seconds(1), {}));  // both clocks start at the first decision
  ASSERT_TRUE(paced.drive(seconds(1) + milliseconds(50), {}));
  clock += milliseconds(200);  // this computer was overloaded
  ASSERT_TRUE(paced.drive(seconds(1) + milliseconds(100), {}));
  EXPECT_EQ(waits, std::vector<Duration>{milliseconds(50)}) << "no waiting if the robot is late";
  EXPECT_EQ(counted.decisions, 3);
  paced.receive(Odometry{});
  EXPECT_EQ(counted.received, 1);
}

class ThreeDecisions final : public LapDriver {
 public:
  Result<DriverDecision> drive(Duration /*uptime*/, SensorTime /*now*/) override {
    if (broken) return fail(ErrorCode::NotFound, "no truth");
    return DriverDecision{.command = {0.3, 0.1}, .done = ++decisions == 3};
  }
  int decisions = 0;
  bool broken = false;
};

std::vector<E> events(ScriptInput& input, Duration uptime, S state) {
  return input.read(uptime, {}, state).value().events;
}

TEST(ScriptInput, TeachesOnceReplaysOnceAndQuits) {
  ScriptInput input(std::make_unique<ThreeDecisions>(), false);
  EXPECT_TRUE(events(input, milliseconds(100), S::Idle).empty()) << "the robot has just started";
  EXPECT_EQ(events(input, seconds(1), S::Idle), std::vector<E>{E::Go});
  EXPECT_EQ(input.read(seconds(2), {}, S::Teaching)->command, (VelocityCommand{0.3, 0.1}));
  EXPECT_TRUE(events(input, seconds(3), S::Teaching).empty());
  EXPECT_EQ(events(input, seconds(4), S::Teaching), std::vector<E>{E::Go}) << "ends the lap";
  EXPECT_TRUE(events(input, seconds(5), S::Mapping).empty());
  EXPECT_EQ(events(input, seconds(6), S::Ready), std::vector<E>{E::Go});
  EXPECT_TRUE(events(input, seconds(7), S::Replaying).empty());
  EXPECT_EQ(events(input, seconds(8), S::Done), std::vector<E>{E::Quit});
}

TEST(ScriptInput, QuitsIfMappingFailed) {
  ScriptInput input(std::make_unique<ThreeDecisions>(), false);
  EXPECT_EQ(events(input, seconds(1), S::Idle), std::vector<E>{E::Go});
  EXPECT_EQ(events(input, seconds(2), S::Idle), std::vector<E>{E::Quit});
}

TEST(ScriptInput, StaysForViewers) {
  ScriptInput input(std::make_unique<ThreeDecisions>(), true);
  EXPECT_EQ(events(input, seconds(1), S::Idle), std::vector<E>{E::Go});
  for (const S state : {S::Idle, S::Done, S::Stopped}) EXPECT_TRUE(events(input, seconds(5), state).empty());
  EXPECT_FALSE(input.is_person());
  EXPECT_FALSE(input.usage().empty());
}

TEST(ScriptInput, FailsWithItsDriver) {
  auto driver = std::make_unique<ThreeDecisions>();
  driver->broken = true;
  ScriptInput input(std::move(driver), false);
  EXPECT_FALSE(input.read(seconds(1), {}, S::Teaching));
}

}  // namespace
}  // namespace waymark
