#pragma once

#include <functional>
#include <limits>
#include <string>

#include "waymark/samples/live_camera.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// A picture of a live camera and the tags in it. Stamps are times since 1970.
struct CameraPicture {
  CameraFrame frame{};
  FoundTags found{};
  Duration age{};  ///< from the middle of the exposure until the tags were found
};

/// What becomes of the pictures of a live camera.
struct CameraWatch {
  double duration_s = std::numeric_limits<double>::infinity();  ///< from the first picture on
  const CameraModel* camera =
      nullptr;  ///< its lens bends the edges of tags; the pictures' size must be its own
  std::function<Status(CameraPicture&)> on_picture{};  ///< an error ends the watch
  std::function<void(const std::string&)> on_words = [](const std::string&) {};
  std::function<bool()> should_stop = [] { return false; };
};

struct CameraWatchEnd {
  std::size_t pictures = 0;
  std::size_t tags = 0;
  double seconds = 0;  ///< from the first picture to the last
  CameraCounts counts{};
  bool stopped = false;  ///< should_stop() said so
};

/// Finds the tags in a camera's newest picture, again and again. Fails when the camera does, when it has
/// delivered no picture for ten seconds, and when on_picture() does.
[[nodiscard]] Result<CameraWatchEnd> watch_camera(LiveCamera& camera, const TagFinder& finder,
                                                  const CameraWatch& watch);

}  // namespace waymark
