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

/// What the robot's loop says of itself, beside its samples.
struct LiveStatus {
  std::string phase = {};   ///< of the operator's session: "idle", "teaching", …
  std::string reason = {};  ///< of the last stop; empty when all is well
  std::vector<std::string> commands =
      {};                            ///< that mean something now: "go", "stop", "script", "teach", "quit"
  bool page_drives = false;          ///< while teaching: the page's keys drive
  std::optional<bool> certain = {};  ///< the estimate can be relied on; nothing without an estimator
  std::string halted = {};           ///< why the replay stands at the moment; empty when it does not
  double driven_m = 0;
  double goal_m = 0;
  int dropped_pictures = 0;  ///< that came faster than they could be looked at

  friend bool operator==(const LiveStatus&, const LiveStatus&) = default;
};

/// What the page shows beside samples: the camera and where it sits, the map, the route.
struct LiveTexts {
  std::map<std::string, std::string> by_name{};  ///< "map.yaml"
  std::uint64_t version = 0;                     ///< grows with each change
};

struct LiveSample {
  /// What the robot measured, where it believes to be, or what it compared that with.
  std::variant<Sample, ros2::PoseWithCovarianceStamped, ros2::DiagnosticArray> value;
  std::int64_t host_ns = 0;  ///< of the system's clock, when the robot's loop had it
};

/// The mailbox between the loop of a robot and the server. The loop never waits: where the server has its
/// hand in the box, the loop keeps what it has until its next visit, and beyond kMaxWaiting it drops and
/// counts. Nothing is copied while nobody listens. One thread on each side.
class LiveFeed {
 public:
  static constexpr std::size_t kMaxWaiting = 512;

  /// `wake` is called from the robot's side when something is there for the server; it must not wait.
  explicit LiveFeed(std::function<void()> wake = [] {}) : wake_(std::move(wake)) {}
  void set_wake(std::function<void()> wake) { wake_ = std::move(wake); }  ///< before either side begins
  void set_words(ViewerWords words) { words_ = std::move(words); }        ///< before either side begins
  /// How the reasons of tell() are written for viewers; as they are, unless it is said.
  using ForUsers = std::function<std::string(std::string_view)>;
  void set_for_users(ForUsers write) { for_users_ = std::move(write); }
  [[nodiscard]] const ViewerWords& words() const { return words_; }

  // The robot's side.
  void publish(const Sample& sample, std::int64_t host_ns);
  void publish(const ros2::PoseWithCovarianceStamped& estimate, std::int64_t host_ns);
  void publish(const ros2::DiagnosticArray& compared, std::int64_t host_ns);
  void tell(const LiveStatus& status);
  void show_text(const std::string& name, std::string text);
  void show_camera(const CameraModel& camera, const SE3& base_T_cam);
  /// The map as shapes, for viewers that cannot read map.yaml.
  void show_shapes(ros2::MarkerArray shapes);
  /// What viewers asked for since the last call, oldest first.
  [[nodiscard]] std::vector<ViewerOrder> take_orders();
  /// Somebody holds control, or held it and went away without giving it back.
  using Control = ViewerControl;
  [[nodiscard]] Control control() const { return control_.load(); }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(); }

  // The server's side.
  struct Mounted {
    CameraModel camera;
    SE3 base_T_cam;
  };
  struct Updates {
    std::vector<LiveSample> samples{};
    LiveStatus status{};
    std::shared_ptr<const LiveTexts> texts = std::make_shared<const LiveTexts>();
    std::optional<Mounted> camera{};
    std::shared_ptr<const ros2::MarkerArray> shapes{};  ///< another one when they change
  };
  void set_listening(bool anybody) { listening_.store(anybody); }
  [[nodiscard]] Updates take();
  /// A picture that is of no use any more: the next one takes its memory, and the loop need not ask for any.
  void give_back(CameraFrame picture);
  void order(const ViewerOrder& order);
  void set_control(Control control) { control_.store(control); }

 private:
  void add(LiveSample sample);
  void hand_over();

  std::function<void()> wake_;
  ViewerWords words_{};
  ForUsers for_users_ = [](std::string_view text) { return std::string(text); };
  std::atomic<bool> listening_{false};
  std::atomic<Control> control_{Control::Nobody};
  std::atomic<std::uint64_t> dropped_{0};
  std::vector<LiveSample> waiting_{};  ///< the robot's own
  std::optional<LiveStatus> status_waiting_{};
  std::shared_ptr<const LiveTexts> texts_waiting_{};
  std::optional<Mounted> camera_waiting_{};
  std::shared_ptr<const ros2::MarkerArray> shapes_waiting_{};
  std::vector<CameraFrame> spare_{};  ///< to be written over
  LiveTexts texts_{};                 ///< the robot's own
  LiveStatus told_{};

  std::mutex box_;  ///< guards what follows
  Updates box_updates_{};
  std::vector<CameraFrame> box_spare_{};
  std::mutex order_box_;
  std::vector<ViewerOrder> orders_{};
};

}  // namespace waymark
