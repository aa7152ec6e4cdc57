#pragma once

#include <nlohmann/json_fwd.hpp>

#include "waymark/live/doctor_tag_size.hpp"

namespace waymark {

/// What `waymark doctor` looks at.
struct DoctorJob {
  std::string robot{};                 ///< KIND:ADDRESS, which is heard and not moved; empty: none
  std::string calibration{};           ///< empty: calibration.yaml in the current folder, if there is one
  std::vector<std::string> sources{};  ///< addresses of cameras to take pictures from
  std::string map{};                   ///< whose tags each source is searched for; empty: none
  std::string folder = ".";            ///< where recordings will be written
  LoopTrial trial{};
  TagSizeTrial tag{};  ///< by the pictures of each source; without a distance: none
};

/// All checks of a computer, in the order in which they are read. Takes two seconds for the loop and one for
/// each camera. Fails where there is no such robot, nothing can be detected, or it was cancelled.
[[nodiscard]] Result<std::vector<DoctorLine>> run_doctor(
    const DoctorJob& job, const DoctorCancelled& cancelled = [] { return false; });

/// Whether one of the checks failed.
[[nodiscard]] bool any_failed(const std::vector<DoctorLine>& lines);
/// A line each, and below it the command that mends it.
[[nodiscard]] std::string to_text(const std::vector<DoctorLine>& lines);
/// The keys of `waymark doctor --json` (docs/reference/cli.md).
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<DoctorLine>& lines);

}  // namespace waymark
