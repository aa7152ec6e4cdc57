#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// A live camera and which of a robot's cameras it is.
struct CameraAddress {
  std::string name = "cam";
  std::string address{};
};

/// "v4l2:/dev/video0", or with the name of the robot's camera before it: "left=v4l2:/dev/video2".
/// InvalidArgument: no address. Without a name it is `name`.
[[nodiscard]] Result<CameraAddress> parse_camera_address(const std::string& word, const std::string& name);

/// Whether a word names a live camera: "v4l2:/dev/video0,size=1280x720", "gstreamer:libcamerasrc".
[[nodiscard]] bool is_camera_address(std::string_view word);

/// Whether the inputs are live cameras; fails where files are among them, and where one is named twice.
[[nodiscard]] Result<bool> are_cameras(const std::vector<std::string>& sources);

/// Whether the inputs are one live camera; fails where a camera is among others.
[[nodiscard]] Result<bool> is_only_camera(const std::vector<std::string>& sources);

/// Opens the camera of an address; `name` is that of its samples. Errors: InvalidArgument (the address), as
/// the camera's driver.
[[nodiscard]] Result<std::unique_ptr<LiveCamera>> open_live_camera(const std::string& address,
                                                                   const std::string& name = "cam");

}  // namespace waymark
