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

/// A live camera on the page: pictures, tags with their poses, rate, age, controls; and what its viewers ask
/// for: a control's new value, a picture saved as PNG, a recording. Files go to the current folder.
class CameraPage {
 public:
  /// Camera and feed outlive this. `poses`: nothing: no poses.
  CameraPage(LiveCamera& camera, LiveFeed& feed, const std::optional<PoseSetup>& poses);

  /// Shows a picture and does what viewers asked for. An order that fails is said on the page.
  void show(const CameraPicture& seen, const PoseList& poses);
  /// How far a guided calibration is, beside the pictures that are shown from now on; `at_once`: with the
  /// next.
  void guide(nlohmann::ordered_json status, bool at_once);
  /// Words of the camera, for its viewers.
  void say(const std::string& words);
  /// Ends a recording that runs; its name, if there was one.
  [[nodiscard]] Result<std::string> close();

 private:
  void obey(const ViewerOrder& order, const CameraPicture& seen);
  void take_snapshot(const CameraPicture& seen);
  void start_or_end_recording(const CameraPicture& seen);
  [[nodiscard]] Status begin_recording(const CameraPicture& seen);
  [[nodiscard]] Status record(const CameraPicture& seen);
  void publish_text(const CameraPicture& seen, const PoseList& poses);
  void count(SensorTime stamp);

  LiveCamera& camera_;
  LiveFeed& feed_;
  const std::optional<PoseSetup>& poses_;
  std::optional<SampleRecorder> recorder_{};
  std::string recording_{};  ///< the file; kept after its end
  std::string words_{};
  nlohmann::ordered_json controls_{};
  nlohmann::ordered_json guide_{};  ///< null: no calibration
  SensorTime controls_read_{};
  SensorTime text_sent_{};
  std::optional<SensorTime> last_{};
  double period_s_ = 0;  ///< smoothed
};

}  // namespace waymark
