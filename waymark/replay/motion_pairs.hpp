#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/replay/motion_window.hpp"

namespace waymark {

struct ConsistencyOptions {
  double window_s = 1.0;
  double contradiction_m = 0.05;
  double contradiction_rad = 0.0873;
  double pushed_m = 0.10;
  double pushed_rad = 0.2;
  double slipped_m = 0.15;
  double late_pictures_s = 0.2;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.window_s,
          Field{"window_s", "Time of motion over which commands, wheels, gyro and tags are compared.", 0.3,
                10});
    visit(self.contradiction_m,
          Field{"contradiction_m",
                "Stop when two sources of motion differ by more over the window, beyond their uncertainty.",
                0.005, 10});
    visit(self.contradiction_rad,
          Field{"contradiction_rad",
                "Stop when two sources of turning differ by more over the window, beyond their uncertainty.",
                0.005, 6.3});
    visit(
        self.pushed_m,
        Field{
            "pushed_m",
            "Stop when the robot moved by more within the window than its wheels explain, even by slipping, "
            "beyond the uncertainty: it was carried.",
            0.01, 10});
    visit(
        self.pushed_rad,
        Field{"pushed_rad",
              "Stop when the robot turned by more within the window than its commands or wheels explain: it "
              "was carried.",
              0.01, 6.3});
    visit(self.slipped_m,
          Field{"slipped_m",
                "Stop when the ways by wheels and by tags differ by more within the window, beyond the "
                "uncertainty, even if slipping wheels explain it: the robot may have been carried back.",
                0.01, 10});
    visit(self.late_pictures_s,
          Field{"late_pictures_s",
                "Stop when turns seen by tags follow those of odometry by more than this time: pictures are "
                "stamped late.",
                0.05, 10});
  }
};

enum class MotionSource : std::uint8_t { Commands, Wheels, Gyro, Tags };

/// Two sources that cannot both be right.
struct Contradiction {
  MotionSource one = MotionSource::Wheels;
  MotionSource other = MotionSource::Tags;
  bool turning = false;  ///< both motions are turns [rad], not ways [m]
  bool carried = false;  ///< moved by more than slip explains, within a moment
  double one_moved = 0;
  double other_moved = 0;
  double apart = 0;  ///< difference of both, as vectors
  double over_s = 0;
  double late_s = 0;     ///< turns of the other follow those of the one by this time; 0: that is not it
  double repeats_s = 0;  ///< so long the one has repeated itself to the last bit; 0: that is not it
  std::optional<MotionSource> culprit{};  ///< where a third source decides
};

/// The first contradiction over the whole of the window, oldest sample first: two sources differ by more than
/// their limit beyond their uncertainty, and each third of the window holds a quarter of the difference or
/// more, so that a jump or a short slip does not count. Pure.
[[nodiscard]] std::optional<Contradiction> find_contradiction(const std::vector<MotionSample>& window,
                                                              const MotionScales& scales,
                                                              const ConsistencyOptions& options);

/// The same for poses that rest on the tags of one picture each: only what concerns tags.
[[nodiscard]] std::optional<Contradiction> find_tag_contradiction(const std::vector<MotionSample>& window,
                                                                  const MotionScales& scales,
                                                                  const ConsistencyOptions& options);

/// Whether the robot came farther between two moments than wheels that slip explain (its true way lies
/// between none and theirs, and not far from theirs: nobody can tell slipping wheels from a robot that is
/// carried back meanwhile), or turned by more than commands or wheels do: somebody carried or turned it.
/// Pure.
[[nodiscard]] std::optional<Contradiction> find_push(const MotionSample& before, const MotionSample& after,
                                                     const MotionScales& scales,
                                                     const ConsistencyOptions& options);

/// Whether tags and odometry differ over a standstill by more than their limit and their uncertainty:
/// somebody carried or turned the robot. Pure.
[[nodiscard]] std::optional<Contradiction> find_carry(const MotionSample& before, const MotionSample& after,
                                                      double stood_s, const ConsistencyOptions& options);

/// One sentence that names the pair.
[[nodiscard]] std::string to_words(const Contradiction& found);

}  // namespace waymark
