#include "waymark/robots/simulated/simulated_robot.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(5);
/// Separate random streams, so that an additional lidar or image does not change any other noise.
constexpr std::uint64_t kLidarSeed = 5000;
constexpr std::uint64_t kImageSeed = 1'000'003;
constexpr std::uint64_t kCameraSeed = 7919;

Duration period(double rate_hz) { return Duration(std::llround(1e9 / rate_hz)); }

}  // namespace

bool SimulatedRobot::Timer::due(SensorTime now) {
  if (now < next) return false;
  next += period;
  return true;
}

SimulatedRobot::SimulatedRobot(World world, RobotModel model, const CameraModel& camera,
                               const SE2& map_T_base, const SimulatedRobotOptions& options,
                               CameraOutput camera_output)
    : SimulatedRobot(std::move(world), model, {{.camera = camera, .base_T_cam = model.base_T_cam}},
                     map_T_base, options, camera_output) {}

SimulatedRobot::SimulatedRobot(World world, RobotModel model, std::vector<MountedCamera> cameras,
                               const SE2& map_T_base, const SimulatedRobotOptions& options,
                               CameraOutput camera_output)
    : true_world_(std::move(world)),
      world_(std::make_shared<const World>(true_world_)),
      model_(std::move(model)),
      options_(options),
      random_(options.seed),
      dynamics_(model_, options.dynamics, map_T_base, random_.fork()),
      sensors_(model_, options.sensors, random_.fork()),
      camera_timer_{period(options.camera_rate_hz)},
      odometry_timer_{period(options.odometry_rate_hz)},
      imu_timer_{period(options.imu_rate_hz)},
      truth_timer_{period(options.truth_rate_hz)},
      lidar_timer_{period(std::max(options.lidar.rate_hz, 0.1))},
      lidar_(true_world_, options.lidar),
      lidar_random_(options.seed + kLidarSeed),
      camera_output_(camera_output),
      happened_(options.faults.size(), false) {
  lidar_timer_.next += lidar_timer_.period;  // by then, the first revolution is complete
  for (MountedCamera& camera : cameras)
    cameras_.push_back({std::move(camera), Random(options.seed + kCameraSeed * cameras_.size())});
}

bool SimulatedRobot::fault_active(FaultKind kind) const {
  return !options_.faults.empty() && active(options_.faults, kind, to_seconds(uptime()));
}

/// Applies an active fault that affects the motion.
void SimulatedRobot::apply_motion_fault(const Fault& fault, Grip& grip) {
  if (fault.kind == FaultKind::SlipBurst) {
    grip.speed_share = fault.speed_share;
    grip.yaw_share = fault.yaw_share;
  }
  if (fault.kind == FaultKind::BatterySag) grip.motor_share = fault.speed_share;
  grip.blocked = grip.blocked || fault.kind == FaultKind::WheelsBlocked;
  grip.held = grip.held || fault.kind == FaultKind::RobotHeld;
  if (fault.kind == FaultKind::Carried)
    dynamics_.place(dynamics_.map_T_base() * SE2::exp(fault.carry * to_seconds(kStep)));
}

void SimulatedRobot::apply_faults() {
  if (options_.faults.empty()) return;
  const double now_s = to_seconds(uptime());
  Grip grip;
  for (std::size_t i = 0; i < options_.faults.size(); ++i) {
    const Fault& fault = options_.faults[i];
    if (active(fault, now_s)) apply_motion_fault(fault, grip);
    if (happened_[i] || now_s < fault.at_s) continue;
    happened_[i] = true;
    if (fault.kind == FaultKind::Kidnapped) dynamics_.place(dynamics_.map_T_base() * fault.base_T_put);
    if (fault.kind == FaultKind::ClockJump) clock_offset_ += Duration(std::llround(fault.jump_s * 1e9));
  }
  dynamics_.set_grip(grip);
  if (now_s < next_tag_change_s_) return;
  world_ = std::make_shared<const World>(with_tag_faults(true_world_, options_.faults, now_s));
  next_tag_change_s_ = next_tag_change_s(options_.faults, now_s);
}

/// Queues a sample with a timestamp from the robot's clock.
void SimulatedRobot::emit(Sample sample) {
  if (clock_offset_ != Duration::zero())
    std::visit([&](auto& value) { value.stamp += clock_offset_; }, sample);
  ready_.push_back(std::move(sample));
}

void SimulatedRobot::emit_late(Sample sample) {
  if (options_.camera_latency_s <= 0) return emit(std::move(sample));
  std::visit([&](auto& value) { value.stamp += clock_offset_; }, sample);
  late_.push_back({uptime() + Duration(std::llround(options_.camera_latency_s * 1e9)), std::move(sample)});
}

void SimulatedRobot::take_image() {
  ++images_;
  if (!fault_active(FaultKind::CameraStuck)) camera_base_ = dynamics_.map_T_base();
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
    if (camera_output_ == CameraOutput::Corners)
      take_corners(camera);
    else
      take_shot(camera);
  }
}

void SimulatedRobot::take_corners(std::size_t camera) {
  CameraState& state = cameras_[camera];
  const SensorTime stamp = dynamics_.now();
  if (!fault_active(FaultKind::CameraFrozen)) {
    const SE3 map_T_cam = lift(camera_base_) * state.mounted.base_T_cam;
    Random& random = camera == 0 ? random_ : state.random;
    state.last_frame = see_tags(*world_, state.mounted.camera, map_T_cam, stamp, options_.tag_camera, random);
    state.last_frame.camera = state.mounted.name;
  }
  state.last_frame.stamp = stamp;
  if (fault_active(FaultKind::CameraBlackout)) state.last_frame.detections.clear();
  if (!fault_active(FaultKind::CameraLost)) emit_late(state.last_frame);
}

void SimulatedRobot::take_shot(std::size_t camera) {
  CameraState& state = cameras_[camera];
  const SensorTime stamp = dynamics_.now();
  if (!fault_active(FaultKind::CameraFrozen))
    state.last_shot = {.world = world_,
                       .map_T_base = lift(camera_base_),
                       .twist = dynamics_.twist(),
                       .seed = options_.seed + kImageSeed * images_ + kCameraSeed * camera,
                       .camera = camera};
  state.last_shot.stamp = stamp + clock_offset_;
  state.last_shot.dark = fault_active(FaultKind::CameraBlackout);
  if (fault_active(FaultKind::CameraLost)) return;
  shots_.push_back(state.last_shot);
  emit_late(CameraFrame{.stamp = stamp, .camera = state.mounted.name});
}

void SimulatedRobot::read_sensors() {
  const SensorTime now = dynamics_.now();
  if (truth_timer_.due(now)) emit(TruthPose{now, lift(dynamics_.map_T_base())});
  if (imu_timer_.due(now)) emit(sensors_.read_imu(dynamics_));
  if (odometry_timer_.due(now)) {
    const WheelTicks wheels = sensors_.read_wheels(dynamics_);
    const Odometry odometry = sensors_.read_odometry(dynamics_);
    if (!fault_active(FaultKind::OdometryLost)) {
      emit(wheels);
      emit(odometry);
    }
  }
  if (options_.lidar.rate_hz > 0 && lidar_timer_.due(now))
    emit(lidar_.scan(dynamics_.map_T_base(), dynamics_.twist(), now, lidar_random_));
  if (camera_timer_.due(now)) take_image();
  for (; !late_.empty() && late_.front().due <= uptime(); late_.pop_front())
    ready_.push_back(std::move(late_.front().sample));
}

Sample SimulatedRobot::next() {
  while (ready_.empty()) {
    const bool fresh = to_seconds(uptime() - command_uptime_) <= options_.watchdog_s;
    dynamics_.step(fresh ? command_ : VelocityCommand{}, kStep);
    apply_faults();
    read_sensors();
  }
  Sample sample = std::move(ready_.front());
  ready_.pop_front();
  if (std::holds_alternative<CameraFrame>(sample)) {
    given_shot_ = std::move(shots_.front());
    shots_.pop_front();
  }
  return sample;
}

Status SimulatedRobot::command(const VelocityCommand& command) {
  command_ = command;
  command_uptime_ = uptime();
  return {};
}

}  // namespace waymark
