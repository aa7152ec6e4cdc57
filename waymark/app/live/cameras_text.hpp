#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/base/fields.hpp"
#include "waymark/cameras/v4l2/device_list.hpp"

namespace waymark {

/// What `waymark cameras` lists.
struct CamerasJob {
  std::string device{};   ///< this one alone; empty: all
  bool controls = false;  ///< all of them

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.device, JobField("device DEVICE", "Only this device, for example /dev/video0").input());
    visit(self.controls,
          JobField("controls", "List all controls, not only exposure, gain, focus and white balance"));
  }
};
[[nodiscard]] Result<std::vector<CameraDevice>> find_cameras(const CamerasJob& job);

/// The cameras of this computer as a table for people; ends with an end of line. With `controls` all of them,
/// with their ranges.
[[nodiscard]] std::string to_text(const std::vector<CameraDevice>& devices, bool controls);
/// The keys of `waymark cameras --json` (docs/reference/cli.md).
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<CameraDevice>& devices);
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<CameraControl>& controls);

}  // namespace waymark
