#pragma once

#include <functional>
#include <span>

#include "waymark/localization/riekf_localizer.hpp"

namespace waymark {

struct NoiseFit {
  RiekfOptions options{};   ///< with the noise that fits best
  bool adapted = false;     ///< it differs from what was given
  double motion_ratio = 1;  ///< noise of distances over what was given
  double turn_ratio = 1;    ///< noise of headings over what was given
  double sensor_ratio = 1;  ///< noise of observations over what was given
  double tag_sigma_m = 0;   ///< RiekfOptions::tag_sigma_m
};

/// Whether a run shows that its noise is not what was assumed: NIS of observations, or of means of one
/// landmark.
[[nodiscard]] bool noise_is_inconsistent(double nis_per_row, std::optional<double> lasting_nis);

/// The noise of motion and observations under which the innovations of a drive are most likely (Mehra, "On
/// the identification of variances and adaptive Kalman filtering", IEEE TAC 15(2), 1970; a composite
/// likelihood of single innovations and of their means by landmark, which tell noise from lasting errors), by
/// a search over powers of two. Looks at the first minutes. No truth is used. Some fifty runs of the filter
/// over them; `keep_going` is asked before each and ends the search.
[[nodiscard]] NoiseFit adapt_noise(std::span<const Sample> samples, const Landmarks& landmarks,
                                   const MountedSensor& sensor, const RiekfOptions& options,
                                   const std::function<bool()>& keep_going = {});

}  // namespace waymark
