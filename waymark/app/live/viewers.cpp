#include "waymark/app/live/viewers.hpp"

#include <array>
#include <chrono>
#include <utility>

#include <spawn.h>

#include <fmt/format.h>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/recording/ros2/map_markers.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/ros_environment.hpp"
#include "waymark/server/access.hpp"
#include "waymark/server/assets.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration): no POSIX header declares it

namespace waymark {

Result<ServerOptions> server_options(const PageOptions& page, bool live) {
  ServerOptions options{.port = static_cast<std::uint16_t>(page.port), .address = page.listen};
  if (!page.token.empty()) {
    if (Status status = check_token(page.token); !status) return tl::unexpected(status.error());
    options.token = page.token;
  } else if (live || page.listen != "127.0.0.1") {
    options.token = make_token();
  }
  return options;
}

bool open_browser(const std::string& url) {
#ifdef __APPLE__
  std::string program = "open";
#else
  std::string program = "xdg-open";
#endif
  std::string argument = url;
  std::array<char*, 3> words = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  return posix_spawnp(&child, program.c_str(), nullptr, nullptr, words.data(), environ) == 0;
}

void announce(const HttpServer& server, const PageOptions& page, const JobControl& control,
              const std::function<void(const std::string&)>& address) {
  if (viewer_assets().empty())
    control.note(
        "this program was built without the viewer page: run tools/build_viewer.sh in the source folder and "
        "rebuild");
  if (page.port != 0 && server.port() != page.port)
    control.note(fmt::format("port {} is in use; another port was chosen", page.port));
  address(server.url());
  for (const std::string& url : server.urls_from_elsewhere()) control.note("from another machine: " + url);
  if (page.open && !open_browser(server.url()))
    control.note("cannot open a browser; open the address manually");
}

namespace {

Status refuse_in_process(const RobotSetup& setup, const char* key) {
  if (!setup.process.empty()) return {};
  return fail(ErrorCode::InvalidArgument,
              "requires a robot process: this simulated robot does not run in real time", {.key = key},
              "Use `waymark run view=true`, or `robot=process:CMD`.");
}

/// Describes the robot of a setup to its ROS 2 node.
Result<NodeRobot> node_robot(const RobotSetup& setup) {
  constexpr std::string_view kRos2 = "ros2:";
  NodeRobot robot{.cameras = setup.simulated.cameras(), .own_images = setup.live_cameras.empty()};
  if (!setup.ground.robot.starts_with(kRos2)) return robot;
  auto profile = find_ros2_profile(setup.ground.robot.substr(kRos2.size()));
  if (!profile) return tl::unexpected(profile.error());
  robot.profile = std::move(*profile);
  return robot;
}

}  // namespace

Result<std::unique_ptr<LivePage>> LivePage::start_ros2(const RobotSetup& setup, const std::string& distro) {
  if (Status status = refuse_in_process(setup, "publish_ros2"); !status)
    return tl::unexpected(status.error());
  auto robot = node_robot(setup);
  if (!robot) return tl::unexpected(robot.error());
  return start_ros2(std::move(*robot), distro);
}

Result<std::unique_ptr<LivePage>> LivePage::start_ros2(const std::string& distro) {
  return start_ros2(NodeRobot(), distro);
}

Result<std::unique_ptr<LivePage>> LivePage::start_ros2(NodeRobot robot, const std::string& distro) {
  BusOptions options;
  Status status = apply_ros_environment(options, process_environment());
  if (robot.profile && status) status = use_interface_of(*robot.profile, options);
  if (status) status = show_in_node_list(options, distro);
  if (!status) return tl::unexpected(status.error());
  std::unique_ptr<LivePage> view(new LivePage);
  auto bus = open_bus(options);
  if (!bus) return tl::unexpected(bus.error());
  view->feed_.set_labels(service_labels());
  auto node = Ros2Node::start(std::move(*bus), view->feed_, std::move(robot));
  if (!node) return tl::unexpected(node.error());
  view->node_ = std::move(*node);
  return view;
}

Result<std::unique_ptr<LivePage>> LivePage::start(const PageOptions& page, const RobotSetup& setup,
                                                  const JobControl& control) {
  if (Status status = refuse_in_process(setup, "view"); !status) return tl::unexpected(status.error());
  return start(page, setup.simulated.model.name, control);
}

Result<std::unique_ptr<LivePage>> LivePage::start(const PageOptions& page, const std::string& name,
                                                  const JobControl& control) {
  Result<ServerOptions> options = server_options(page, true);
  if (!options) return tl::unexpected(options.error());
  std::unique_ptr<LivePage> view(new LivePage);
  view->feed_.set_for_users(control.for_users);
  options->feed = &view->feed_;
  options->robot_name = name;
  Result<HttpServer> server = HttpServer::listen(std::move(*options));
  if (!server) return tl::unexpected(server.error());
  announce(*server, page, control, [&control](const std::string& url) { control.note("the page: " + url); });
  view->server_ = std::make_unique<HttpServer>(std::move(*server));
  view->thread_ =
      std::thread([live = view.get()] { live->server_->run([live] { return live->over_.load(); }); });
  return view;
}

namespace {

Result<std::unique_ptr<LivePage>> with_user_messages(const JobControl& control,
                                                     Result<std::unique_ptr<LivePage>> started) {
  if (started) (*started)->feed().set_for_users(control.for_users);
  return started;
}

}  // namespace

Result<std::unique_ptr<LivePage>> LivePage::open(const ViewerOptions& viewers, const RobotSetup& setup,
                                                 const JobControl& control) {
  if (viewers.ros2) return with_user_messages(control, start_ros2(setup, viewers.ros_distro));
  if (!viewers.view) return std::unique_ptr<LivePage>();
  return start(viewers.page, setup, control);
}

Result<std::unique_ptr<LivePage>> LivePage::open(const ViewerOptions& viewers, const std::string& name,
                                                 const JobControl& control) {
  if (viewers.ros2) return with_user_messages(control, start_ros2(viewers.ros_distro));
  if (!viewers.view) return std::unique_ptr<LivePage>();
  return start(viewers.page, name, control);
}

LivePage::~LivePage() {
  over_ = true;
  if (thread_.joinable()) thread_.join();
}

std::int64_t host_now_ns() {
  return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()).count();
}

RobotListener watched(RobotListener listener, LiveFeed* feed, const JobControl& control) {
  listener.should_stop = control.cancelled;
  if (feed == nullptr) return listener;
  RobotListener out = listener;
  out.on_sample = [feed, inner = std::move(listener.on_sample)](const Sample& sample) {
    feed->publish(sample, host_now_ns());
    return inner(sample);
  };
  return out;
}

void SessionViewers::show_camera(const SimulatedSetup& setup) {
  if (feed_ == nullptr) return;
  feed_->show_camera(setup.camera, setup.model.base_T_cam);
  const MappedTag* anchor = setup.world.tags.find(setup.world.anchor);
  if (anchor != nullptr) feed_->show_text("tags.yaml", fmt::format("tag_size_m: {}\n", anchor->size_m));
}

void SessionViewers::show_map(const std::filesystem::path& folder) {
  constexpr std::size_t kMaxShownBytes = std::size_t{2} << 20U;  // limits the memory used by the page

  if (feed_ == nullptr) return;
  for (const char* name : {"map.yaml", "route.yaml", "robot.yaml"}) {
    auto text = read_text_file(folder / name, kMaxShownBytes);
    if (text) feed_->show_text(name, std::move(*text));
  }
  const Result<MapFile> map = read_map(folder / "map.yaml");
  const Result<Route> route = read_route(folder / "route.yaml");
  if (map) feed_->show_shapes(map_markers(map->tags, route ? *route : Route{}));
}

void SessionViewers::show_status(const Operator& session, const OperatorInput& input) {
  if (feed_ == nullptr) return;
  show_status({.phase = std::string(to_string(session.state())),
               .reason = session.reason(),
               .commands = viewer_commands(session.state(), input.has_script()),
               .page_drives = input.page_drives()});
}

void SessionViewers::show_status(LiveStatus status) {
  if (feed_ == nullptr) return;
  const bool replays = status.phase == "replaying" || status.phase == "paused";
  status.goal_m = goal_m_;
  status.driven_m = driven_m_;
  if (replays) {
    status.certain = certain_;
    status.halted = halted_;
  }
  feed_->set_status(status);
}

std::function<void(const ReplayStep&)> SessionViewers::watch(double goal_m) {
  goal_m_ = goal_m;
  driven_m_ = 0;
  return [this](const ReplayStep& step) {
    if (feed_ == nullptr) return;
    driven_m_ = step.driven_m;
    certain_ = step.estimate && step.estimate->certain;
    halted_ = step.reason.value_or("");
    if (step.estimate) feed_->publish(estimate_message(*step.estimate), host_now_ns());
    for (const NisRecord& record : step.compared) feed_->publish(nis_message(record), host_now_ns());
  };
}

PhaseViewers::PhaseViewers(LiveFeed* feed, const SimulatedSetup& setup, OperatorState phase, bool keys_taken)
    : viewers_(feed),
      stop_key_(keys_taken),
      requests_(viewer_link(feed), phase, [this] { return stop_key_.pressed(); }),
      shown_(feed != nullptr) {
  viewers_.show_camera(setup);
}

void PhaseViewers::show_status() {
  LiveStatus status{.phase = std::string(to_string(requests_.phase())), .commands = {"go", "stop"}};
  if (requests_.phase() == OperatorState::Teaching) status.commands = {"go"};
  viewers_.show_status(std::move(status));
}

SessionRequests PhaseViewers::requests() {
  return [this](Duration uptime) {
    SessionRequest request = requests_.read(uptime);
    if (shown_) show_status();
    return request;
  };
}

}  // namespace waymark
