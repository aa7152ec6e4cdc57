#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/runtime/viewer_input.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// State of the robot's loop, published with its samples.
struct LiveStatus {
  std::string phase = {};   ///< phase of the session: "idle", "teaching", …
  std::string reason = {};  ///< reason of the last stop; empty if none
  std::vector<std::string> commands =
      {};                            ///< accepted in this phase: "go", "stop", "script", "teach", "quit"
  bool page_drives = false;          ///< while teaching: the keys of the page drive
  std::optional<bool> certain = {};  ///< the estimate is reliable; nothing without an estimator
  std::string halted = {};           ///< why the replay is halted; empty if it is not
  double driven_m = 0;
  double goal_m = 0;
  int dropped_pictures = 0;  ///< images that arrived faster than they could be processed

  friend bool operator==(const LiveStatus&, const LiveStatus&) = default;
};

/// Content of the page besides samples: the camera and its mounting, the map, the route.
struct LiveTexts {
  std::map<std::string, std::string> by_name{};  ///< "map.yaml"
  std::uint64_t version = 0;                     ///< incremented by each change
};

struct LiveSample {
  /// A measurement, an estimate, or the comparison of the two.
  std::variant<Sample, ros2::PoseWithCovarianceStamped, ros2::DiagnosticArray> value;
  std::int64_t host_ns = 0;  ///< system clock when the robot's loop received it
};

/// Queue between the loop of a robot and the server. The loop never blocks: if the server holds the lock, the
/// loop keeps its samples until the next call. Samples beyond kMaxWaiting are dropped and counted. Samples
/// are copied only while a viewer is connected. One thread on each side.
class LiveFeed {
 public:
  static constexpr std::size_t kMaxWaiting = 512;

  /// The robot side calls `wake` when data for the server are available; `wake` must not block.
  explicit LiveFeed(std::function<void()> wake = [] {}) : wake_(std::move(wake)) {}
  void set_wake(std::function<void()> wake) { wake_ = std::move(wake); }  ///< call before either side starts
  void set_labels(ViewerLabels labels) { labels_ = std::move(labels); }   ///< call before either side starts
  /// Rewrites the reasons of set_status() for viewers; default: unchanged.
  using ForUsers = std::function<std::string(std::string_view)>;
  void set_for_users(ForUsers write) { for_users_ = std::move(write); }
  [[nodiscard]] const ViewerLabels& labels() const { return labels_; }

  // Robot side.
  void publish(const Sample& sample, std::int64_t host_ns);
  void publish(const ros2::PoseWithCovarianceStamped& estimate, std::int64_t host_ns);
  void publish(const ros2::DiagnosticArray& compared, std::int64_t host_ns);
  void set_status(const LiveStatus& status);
  void show_text(const std::string& name, std::string text);
  void show_camera(const CameraModel& camera, const SE3& base_T_cam);
  /// The map as markers, for viewers that cannot read map.yaml.
  void show_shapes(ros2::MarkerArray shapes);
  /// Orders of viewers since the last call, oldest first.
  [[nodiscard]] std::vector<ViewerOrder> take_orders();
  /// Whether a viewer holds control, or lost it without releasing it.
  using Control = ViewerControl;
  [[nodiscard]] Control control() const { return control_.load(); }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(); }

  // Server side.
  struct Mounted {
    CameraModel camera;
    SE3 base_T_cam;
  };
  struct Updates {
    std::vector<LiveSample> samples{};
    LiveStatus status{};
    std::shared_ptr<const LiveTexts> texts = std::make_shared<const LiveTexts>();
    std::optional<Mounted> camera{};
    std::shared_ptr<const ros2::MarkerArray> shapes{};  ///< a new object after each change
  };
  void set_listening(bool anybody) { listening_.store(anybody); }
  [[nodiscard]] Updates take();
  /// Returns an image that is no longer needed, so that the loop can reuse its memory.
  void give_back(CameraFrame picture);
  void order(const ViewerOrder& order);
  void set_control(Control control) { control_.store(control); }

 private:
  void add(LiveSample sample);
  void hand_over();

  std::function<void()> wake_;
  ViewerLabels labels_{};
  ForUsers for_users_ = [](std::string_view text) { return std::string(text); };
  std::atomic<bool> listening_{false};
  std::atomic<Control> control_{Control::None};
  std::atomic<std::uint64_t> dropped_{0};
  std::vector<LiveSample> waiting_{};  ///< owned by the robot side
  std::optional<LiveStatus> status_waiting_{};
  std::shared_ptr<const LiveTexts> texts_waiting_{};
  std::optional<Mounted> camera_waiting_{};
  std::shared_ptr<const ros2::MarkerArray> shapes_waiting_{};
  std::vector<CameraFrame> spare_{};  ///< for reuse
  LiveTexts texts_{};                 ///< owned by the robot side
  LiveStatus last_status_{};

  std::mutex box_;  ///< guards the members below
  Updates box_updates_{};
  std::vector<CameraFrame> box_spare_{};
  std::mutex order_box_;
  std::vector<ViewerOrder> orders_{};
};

}  // namespace waymark
