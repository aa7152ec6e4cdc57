// Places a thousand robots (forty unless WAYMARK_FULL is set) in a ring of tags. They have wrong parameters,
// are in the dark, or are moved by hand.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

#include "tests/support/tag_ring.hpp"

namespace waymark {
namespace {

using testing::certain;
using testing::mounted_sensor;
using testing::observe;
using testing::off_m;
using testing::ring;
using testing::RingRobot;
using testing::RingWorld;
using testing::run;

/// Checks that a claim of being certain holds from the time it is made until it is withdrawn. Moving a robot
/// by hand in the dark cannot be detected: its estimate may stay certain until tags have contradicted it for
/// one second.
struct Claims {
  bool certain = false;
  int starts = 0;
  bool carried = false;  ///< the robot has been moved by hand since the estimate became certain
  int made = 0;
  int false_moments = 0;

  void receive(const RiekfLocalizer& filter, const RingRobot& robot, double two_tags_s) {
    const bool now = testing::certain(filter);
    const int begun = filter.tracker().state().starts;
    if (now && (!certain || begun != starts)) {
      ++made;
      carried = false;
    }
    certain = now;
    starts = begun;
    if (!certain || (carried && two_tags_s < 1)) return;
    const double sigma_m = filter.estimate()->position_sigma_m();
    if (off_m(filter, robot) > std::max(0.15, 5 * sigma_m)) ++false_moments;
  }
};

/// One robot among tags, with a fifth of the ids misread.
struct Trial {
  RiekfLocalizer filter{Landmarks(ring()), mounted_sensor()};
  RingRobot robot{};
  RingWorld world{.wrong_id_share = 0.2};
  Random random;
  Claims claims{};
  double two_tags_s = 0;  ///< since it was last in the dark
  bool back = false;

  explicit Trial(std::uint64_t seed) : random(seed) {}

  void run_for(double seconds) {
    constexpr double kFrame = 0.08;
    for (int i = 0; i < static_cast<int>(std::lround(seconds / kFrame)); ++i) {
      const std::size_t seen = observe({}, robot.truth, 0, random).detections.size();
      run(filter, robot, world, kFrame, random);
      two_tags_s = world.dark ? 0 : two_tags_s + (seen >= 2 ? kFrame : 0);
      claims.receive(filter, robot, two_tags_s);
      back = back || (!world.dark && certain(filter) && off_m(filter, robot) < 0.1);
    }
  }
};

/// Within a second of two tags becoming visible, the estimate is correct again, and it is never reported as
/// certain while it is wrong.
TEST(RiekfLocalizer, IsHardToLose) {
  const int trials = std::getenv("WAYMARK_FULL") != nullptr ? 1000 : 40;
  int made = 0;
  int false_moments = 0;
  int not_back = 0;
  for (int number = 0; number < trials; ++number) {
    Trial trial(static_cast<std::uint64_t>(100 + number));
    trial.run_for(3);
    trial.world.dark = true;
    if (number % 2 == 0) {  // moved by hand
      trial.run_for(1);
      trial.robot.truth =
          SE2(trial.random.uniform(-1, 1), trial.random.uniform(-1, 1), trial.random.uniform(-3, 3));
      trial.claims.carried = true;
    } else {
      trial.run_for(5);
    }
    trial.world.dark = false;
    trial.back = false;
    while (trial.two_tags_s < 1) trial.run_for(0.08);
    not_back += trial.back ? 0 : 1;
    trial.run_for(4);
    made += trial.claims.made;
    false_moments += trial.claims.false_moments;
    EXPECT_EQ(trial.claims.false_moments, 0) << "trial " << number;
  }
  std::printf("%d trials: certain again %d times, %d false steps, %d not recovered within 1 s\n", trials,
              made, false_moments, not_back);
  EXPECT_GE(made, trials);
  EXPECT_EQ(not_back, 0);
}

}  // namespace
}  // namespace waymark
