#include <array>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/replay/motion_pairs.hpp"

namespace waymark {
namespace {

const char* name_of(MotionSource source) {
  constexpr std::array<const char*, 4> kNames{"commands", "wheels", "gyro", "tags"};
  return kNames[static_cast<std::size_t>(source)];
}

std::string explanation(const Contradiction& found) {
  if (found.carried && found.one == MotionSource::Wheels && !found.turning)
    return "Slipping wheels do not explain it: was the robot carried, or do the encoders stand still?";
  if (found.carried) return "Neither commands nor slipping wheels explain it: was the robot carried?";
  if (found.one == MotionSource::Commands && found.turning)
    return "Is the robot held or blocked, or do the motors not obey?";
  if (found.one == MotionSource::Commands) return "The wheels are blocked, or the motors do not obey.";
  if (found.culprit == MotionSource::Gyro) return "The tags say that the gyro is wrong.";
  if (found.culprit == MotionSource::Wheels)
    return found.other == MotionSource::Gyro
               ? "The tags say that the wheels are wrong: do they spin?"
               : "The gyro agrees with the tags: do the wheels spin, is the robot "
                 "held, or was it carried?";
  if (found.one == MotionSource::Gyro)
    return "Does the gyro stand still, is the robot held, does the camera repeat an old picture, or are its "
           "pictures late?";
  return "Do the wheels spin, is the robot held or was it carried, or does the camera repeat an old picture?";
}

}  // namespace

std::string to_words(const Contradiction& found) {
  if (found.repeats_s > 0)
    return fmt::format(
        "the {} has repeated the same value for {:.1f} s while the robot was asked to turn otherwise: does "
        "it "
        "stand still? Look at the robot, then resume",
        name_of(found.one), found.repeats_s);
  if (found.late_s > 0)
    return fmt::format(
        "turns seen by tags follow those of the {} by {:.2f} s: the pictures are stamped too late. Stamp "
        "them "
        "with the middle of their exposure, or give their delay (--camera-latency-s). Look at the robot, "
        "then "
        "resume",
        name_of(found.one), found.late_s);
  const auto amount = [&](double moved) {
    return found.turning ? fmt::format("{:.0f} deg", to_degrees(moved)) : fmt::format("{:.2f} m", moved);
  };
  return fmt::format(
      "{} and {} disagree: {} against {} in {:.1f} s, {} apart. {} Look at the robot, then resume",
      name_of(found.one), name_of(found.other), amount(found.one_moved), amount(found.other_moved),
      found.over_s, amount(found.apart), explanation(found));
}

}  // namespace waymark
