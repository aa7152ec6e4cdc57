#pragma once

#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark {

/// Shows a live camera on the page: images, tags with their poses, rate, age, controls. Viewers may set a
/// control, save an image as PNG, or start a recording; files are written to the current folder.
class CameraPage {
 public:
  /// The camera, the feed and `poses` must outlive this object. Poses are shown only if `poses` is set.
  CameraPage(LiveCamera& camera, LiveFeed& feed, const std::optional<PoseSetup>& poses);

  /// Shows an image and executes orders from viewers. If an order fails, the page shows the error.
  void show(const CameraImage& seen, const PoseList& poses);
  /// Sets the progress of a guided calibration, which is shown with later images, or with the very next one
  /// if `at_once` is true.
  void guide(nlohmann::ordered_json status, bool at_once);
  /// Sets the message shown to viewers.
  void show_message(const std::string& words);
  /// Ends the recording if one is running. Returns its file name, otherwise an empty string.
  [[nodiscard]] Result<std::string> close();

 private:
  void obey(const ViewerOrder& order, const CameraImage& seen);
  void take_snapshot(const CameraImage& seen);
  void start_or_end_recording(const CameraImage& seen);
  [[nodiscard]] Status begin_recording(const CameraImage& seen);
  [[nodiscard]] Status record(const CameraImage& seen);
  void publish_text(const CameraImage& seen, const PoseList& poses);
  void count(SensorTime stamp);

  LiveCamera& camera_;
  LiveFeed& feed_;
  const std::optional<PoseSetup>& poses_;
  std::optional<SampleRecorder> recorder_{};
  std::string recording_{};  ///< name of the file; kept after the recording has ended
  std::string words_{};
  nlohmann::ordered_json controls_{};
  nlohmann::ordered_json guide_{};  ///< null unless a calibration is guided
  SensorTime controls_read_{};
  SensorTime text_sent_{};
  std::optional<SensorTime> last_{};
  double period_s_ = 0;  ///< smoothed frame period
};

}  // namespace waymark
