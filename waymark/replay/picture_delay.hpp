#pragma once

#include <optional>
#include <span>

namespace waymark {

/// A heading at a moment; turns are counted on, not wrapped.
struct HeadingAt {
  double time_s = 0;
  double yaw_rad = 0;
};

/// By how much headings seen in pictures follow those of odometry.
struct PictureDelay {
  double delay_s = 0;
  double rms_rad = 0;            ///< of what is left with this delay
  double rms_undelayed_rad = 0;  ///< and with none
};

/// The delay, up to `most_s`, with which scale times the headings of odometry fit those of pictures best
/// (least squares on a grid). Nothing when the turns are too even to tell, or another delay fits nearly as
/// well. Both in order of time. O(pictures log odometry). Pure.
[[nodiscard]] std::optional<PictureDelay> find_delay(std::span<const HeadingAt> pictures,
                                                     std::span<const HeadingAt> odometry, double most_s);

}  // namespace waymark
