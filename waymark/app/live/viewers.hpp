#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/live/ros2_node.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/robots/dds/ros_environment.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/runtime/viewer_input.hpp"
#include "waymark/server/http_server.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark {

/// Options for the server of the page.
struct PageOptions {
  int port = 8642;  ///< any free port if this one is in use, or if 0
  std::string listen = "127.0.0.1";
  std::string token = {};  ///< if empty, a random one is used where a token is required
  bool open = false;       ///< whether to open the page in the browser

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.port,
          JobField("port INT", "Port of the page; any free port if it is in use. 0: any", 0, 65535));
    visit(self.listen, JobField("listen ADDRESS",
                                "Address on which other machines can reach this one, 0.0.0.0 for all "
                                "addresses; they need the token"));
    visit(self.token, JobField("token WORD",
                               "Token that grants control and remote viewing: at least 16 characters. "
                               "Default: a random one"));
    visit(self.open, JobField("open", "Open the page in the browser"));
  }

  /// The same fields for a page that is served only if the field `view` is set.
  template <class Self, class Visitor>
  static void fields_of_view(Self& self, Visitor&& visit) {
    fields(self, [&](auto& value, const JobField& field) {
      visit(value, field.name == "open" ? field.needs("view") : field.needs("view").less());
    });
  }
};

/// How viewers can watch a running session.
struct ViewerOptions {
  bool view = false;         ///< whether to show it in the browser
  bool ros2 = false;         ///< whether to publish it on the ROS 2 network
  std::string ros_distro{};  ///< ROS 2 release whose node list shows this node; not listed if empty
  PageOptions page{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.view, JobField("view", "Show the running robot in the browser, with buttons"));
    PageOptions::fields_of_view(self.page, visit);
    visit(self.ros2, JobField("publish_ros2",
                              "Publish pose, /tf, tags and path on the ROS 2 network, with services as "
                              "buttons: docs/howto/ros2.md")
                         .excludes("view")
                         .less());
    visit(self.ros_distro, JobField("ros_distro NAME", kRosDistroHelp).needs("publish_ros2").less());
  }
};

/// Options for the server. A server that other machines can reach, or that shows a robot (`live`), gets a
/// random token if none is specified. Fails if the token is too weak.
[[nodiscard]] Result<ServerOptions> server_options(const PageOptions& page, bool live);

/// Passes the address of the page to `address`, and opens the page if requested. Prints notes if the port
/// differs from the requested one, and about the addresses for other machines.
void announce(const HttpServer& server, const PageOptions& page, const JobControl& control,
              const std::function<void(const std::string&)>& address);

/// Opens the page in the default browser; returns false on failure.
[[nodiscard]] bool open_browser(const std::string& url);

/// The page for a running robot, served on its own thread until this object is destroyed. The robot's loop
/// must have ended by then.
class LivePage {
 public:
  /// Fails if the robot of the setup is not a process, because a simulated robot inside this process runs as
  /// fast as possible, which is too fast to watch.
  static Result<std::unique_ptr<LivePage>> start(const PageOptions& page, const RobotSetup& setup,
                                                 const JobControl& control);
  /// Starts a ROS 2 node instead of a page, configured by the environment variables of ROS 2. It appears in
  /// the node list of the release `distro`.
  static Result<std::unique_ptr<LivePage>> start_ros2(const RobotSetup& setup, const std::string& distro);
  static Result<std::unique_ptr<LivePage>> start_ros2(const std::string& distro);
  /// The page for a different source of updates to the feed, with this name.
  static Result<std::unique_ptr<LivePage>> start(const PageOptions& page, const std::string& name,
                                                 const JobControl& control);
  /// Opens the page or the node, as requested in the options; nullptr if neither is requested.
  static Result<std::unique_ptr<LivePage>> open(const ViewerOptions& viewers, const RobotSetup& setup,
                                                const JobControl& control);
  /// The same for a different source of updates to the feed with this name, such as a live camera.
  static Result<std::unique_ptr<LivePage>> open(const ViewerOptions& viewers, const std::string& name,
                                                const JobControl& control);
  ~LivePage();
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  [[nodiscard]] LiveFeed& feed() { return feed_; }

 private:
  static Result<std::unique_ptr<LivePage>> start_ros2(NodeRobot robot, const std::string& distro);
  LivePage() = default;
  LiveFeed feed_{};
  std::unique_ptr<HttpServer> server_{};
  std::unique_ptr<Ros2Node> node_{};
  std::atomic<bool> over_{false};
  std::thread thread_{};
};

/// The time on the system clock, in the unit that the feed uses.
[[nodiscard]] std::int64_t host_now_ns();

/// A listener that also passes samples to the feed, if there is one, and stops once the control cancels.
[[nodiscard]] RobotListener watched(RobotListener listener, LiveFeed* feed, const JobControl& control);

/// Shows a session, a lap being taught, or a replay to viewers. Without a feed, the functions do nothing.
class SessionViewers {
 public:
  explicit SessionViewers(LiveFeed* feed) : feed_(feed) {}

  void show_camera(const SimulatedSetup& setup);
  /// Shows map.yaml, route.yaml and robot.yaml in the folder if they exist, and draws the map.
  void show_map(const std::filesystem::path& folder);
  void show_status(const Operator& session, const OperatorInput& input);
  void show_status(LiveStatus status);
  /// A listener for the decisions made during a replay. It shows estimates, consistency checks and progress;
  /// viewers receive only the newest of each.
  [[nodiscard]] std::function<void(const ReplayStep&)> watch(double goal_m);

 private:
  LiveFeed* feed_;
  double goal_m_ = 0;
  double driven_m_ = 0;
  std::optional<bool> certain_{};
  std::string halted_{};
};

/// Viewers of a single phase, as run by `waymark teach` and `waymark replay`.
class PhaseViewers {
 public:
  /// `keys_taken` is true if a driver reads the keys of the terminal itself.
  PhaseViewers(LiveFeed* feed, const SimulatedSetup& setup, OperatorState phase, bool keys_taken = false);
  /// Orders from viewers and from the space bar. This object must outlive the result.
  [[nodiscard]] SessionRequests requests();
  [[nodiscard]] SessionViewers& viewers() { return viewers_; }

 private:
  void show_status();
  SessionViewers viewers_;
  StopKey stop_key_;
  PhaseRequests requests_;
  bool shown_;
};

}  // namespace waymark
