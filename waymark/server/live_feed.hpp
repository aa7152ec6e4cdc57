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

/// The state of the robot loop, published together with its samples.
struct LiveStatus {
  std::string phase = {};                  ///< phase of the session: "idle", "teaching", …
  std::string reason = {};                 ///< reason for the last stop; empty if there was none
  std::vector<std::string> commands = {};  ///< orders accepted in this phase: "go", "stop", "script",
                                           ///< "teach", "quit"
  bool page_drives = false;                ///< whether keys on the page drive the robot during teaching
  std::optional<bool> certain = {};  ///< whether the estimate is reliable; `nullopt` without an estimator
  std::string halted = {};           ///< why the replay is halted; empty if it is not
  double driven_m = 0;
  double goal_m = 0;
  int dropped_images = 0;  ///< number of images that arrived faster than they could be processed

  friend bool operator==(const LiveStatus&, const LiveStatus&) = default;
};

/// Content of the page other than samples: the camera and its mounting, the map, the route.
struct LiveTexts {
  std::map<std::string, std::string> by_name{};  ///< texts by name, such as "map.yaml"
  std::uint64_t version = 0;                     ///< incremented on each change
};

struct LiveSample {
  /// A measurement, an estimate, or a comparison of the two.
  std::variant<Sample, ros2::PoseWithCovarianceStamped, ros2::DiagnosticArray> value;
  std::int64_t host_ns = 0;  ///< time on the system clock when the robot loop received it
};

/// A queue between the robot loop and the server, with one thread on each side. The loop never blocks: while
/// the server holds the lock, the loop keeps its samples until the next call. Samples beyond kMaxWaiting are
/// dropped and counted. Samples are copied only while a viewer is connected.
class LiveFeed {
 public:
  static constexpr std::size_t kMaxWaiting = 512;

  /// `wake` is called on the robot's side when data are available for the server; it must not block.
  explicit LiveFeed(std::function<void()> wake = [] {}) : wake_(std::move(wake)) {}
  void set_wake(std::function<void()> wake) {
    wake_ = std::move(wake);
  }  ///< Call this before either side
     ///< starts.
  void set_labels(ViewerLabels labels) {
    labels_ = std::move(labels);
  }  ///< Call this before either side
     ///< starts.
  /// Rewords the reasons from set_status() for viewers; by default they are unchanged.
  using ForUsers = std::function<std::string(std::string_view)>;
  void set_for_users(ForUsers write) { for_users_ = std::move(write); }
  [[nodiscard]] const ViewerLabels& labels() const { return labels_; }

  // The following functions are for the robot's side.
  void publish(const Sample& sample, std::int64_t host_ns);
  void publish(const ros2::PoseWithCovarianceStamped& estimate, std::int64_t host_ns);
  void publish(const ros2::DiagnosticArray& compared, std::int64_t host_ns);
  void set_status(const LiveStatus& status);
  void show_text(const std::string& name, std::string text);
  void show_camera(const CameraModel& camera, const SE3& base_T_cam);
  /// Shows the map as markers, for viewers that cannot read map.yaml.
  void show_shapes(ros2::MarkerArray shapes);
  /// Returns the orders from viewers since the last call, oldest first.
  [[nodiscard]] std::vector<ViewerOrder> take_orders();
  /// Whether a viewer is in control, or has left without releasing control.
  using Control = ViewerControl;
  [[nodiscard]] Control control() const { return control_.load(); }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(); }

  // The following members are for the server's side.
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
  /// Returns an image that is no longer needed to the loop, so that its memory can be reused.
  void give_back(CameraFrame image);
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
  std::vector<LiveSample> waiting_{};  ///< owned by the robot's side
  std::optional<LiveStatus> status_waiting_{};
  std::shared_ptr<const LiveTexts> texts_waiting_{};
  std::optional<Mounted> camera_waiting_{};
  std::shared_ptr<const ros2::MarkerArray> shapes_waiting_{};
  std::vector<CameraFrame> spare_{};  ///< images to be reused
  LiveTexts texts_{};                 ///< owned by the robot's side
  LiveStatus last_status_{};

  std::mutex box_;  ///< protects the members below
  Updates box_updates_{};
  std::vector<CameraFrame> box_spare_{};
  std::mutex order_box_;
  std::vector<ViewerOrder> orders_{};
};

}  // namespace waymark
