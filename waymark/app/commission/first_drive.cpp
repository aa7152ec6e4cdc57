#include "waymark/app/commission/first_drive.hpp"

#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"

namespace waymark {
namespace {

TagWitness witness_of(const RobotSetup& setup, double tag_size_m) {
  TagWitness witness{.cameras = setup.simulated.cameras()};
  if (tag_size_m > 0) {
    witness.sizes.default_size_m = tag_size_m;
  } else {
    for (const auto& [id, tag] : setup.simulated.world.tags.tags)
      witness.sizes.size_by_tag_m[id] = tag.size_m;
  }
  return witness;
}

/// By this origin, else by the first one.
double ratio_of(const std::vector<MotionReading>& readings, const char* origin) {
  double ratio = 0;
  for (const MotionReading& reading : readings) {
    if (reading.origin == origin || ratio == 0) ratio = reading.ratio;
  }
  return ratio;
}

}  // namespace

FirstDrive::FirstDrive(const RobotSetup& setup, const CommissionJob& job, const CommissionPerson& person,
                       const JobControl& control)
    : setup_(setup),
      job_(job),
      person_(person),
      control_(control),
      witness_(witness_of(setup, job.tag_size_m)) {}

Status FirstDrive::open() {
  if (robot_ != nullptr) return {};
  auto robot = LiveRobot::open_first(setup_, control_);
  if (!robot) return tl::unexpected(robot.error());
  robot_ = std::move(*robot);
  report_.real = robot_->process().hello().is_real();
  return report_.real && job_.output.empty() ? check_output_file(commission_file(setup_)) : Status();
}

Status FirstDrive::wait_for(const std::string& words) {
  robot_.reset();  // nobody drives while a person has the hands on it
  return person_.ready(words);
}

void FirstDrive::add(const std::string& step, std::vector<CommissionLine> lines) {
  for (CommissionLine& line : lines) report_.findings.push_back({step, std::move(line)});
}

Result<MotionTrace> FirstDrive::drive(const MotionOptions& options, const std::string& words,
                                      const std::function<bool()>& ends) {
  if (Status opened = open(); !opened) return tl::unexpected(opened.error());
  control_.note(words);
  CommissionMotion motion(options, witness_);
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) {
    motion.receive(sample);
    return Status();
  };
  listener.decide = [&](Duration uptime, SensorTime now) {
    if (motion.moving() && ends()) motion.end_motion();
    return motion.decide(uptime, now);
  };
  listener.should_stop = control_.cancelled;
  const auto end = robot_->drive(std::move(listener));
  if (!end) return tl::unexpected(end.error());
  if (end->interrupted) return fail(ErrorCode::Unreadable, "stopped");
  return motion.trace();
}

Status FirstDrive::drive_lifted() {
  const RobotModel& model = setup_.simulated.model;
  if (Status ready = wait_for("Lift the robot so that its wheels turn freely."); !ready) return ready;
  const auto forward = drive({.command = kFirstForward}, "lifted: forward at 0.1 m/s for 2 s");
  if (!forward) return tl::unexpected(forward.error());
  add("lifted", judge_forward(*forward, model, Ground::Lifted, person_.saw("Did all wheels turn forward?")));
  add("lifted", judge_standing(standing_part(*forward)));
  add("lifted", {judge_stop("stop.zero", timing_of(*forward), 0)});
  const auto turn = drive({.command = kFirstTurn}, "lifted: left at 0.4 rad/s for 2 s");
  if (!turn) return tl::unexpected(turn.error());
  add("lifted",
      judge_turn(*turn, model, Ground::Lifted,
                 person_.saw("Did the wheels of the right side turn forward, those of the left backward?")));
  return {};
}

Status FirstDrive::drive_on_floor() {
  const RobotModel& model = setup_.simulated.model;
  if (Status ready = wait_for("Put the robot on the floor, with 1.5 m free ahead and to its left."); !ready)
    return ready;
  const auto forward =
      drive({.command = kFirstForward, .most_s = 7, .way = 0.5}, "floor: forward at 0.1 m/s, 0.5 m");
  if (!forward) return tl::unexpected(forward.error());
  add("floor",
      judge_forward(*forward, model, Ground::Floor, person_.saw("Did it drive forward, by half a metre?")));
  add("floor", judge_standing(standing_part(*forward)));
  const MotionTiming timing = timing_of(*forward);
  add("floor", {judge_response(timing), judge_stop("stop.zero", timing, 0)});
  const auto turn = drive({.command = kFirstTurn, .most_s = 12, .way = M_PI / 2, .far_m = 0.3},
                          "floor: 90 degrees to the left at 0.4 rad/s");
  if (!turn) return tl::unexpected(turn.error());
  add("floor",
      judge_turn(*turn, model, Ground::Floor, person_.saw("Did it turn to its left, by a quarter turn?")));
  const auto second =
      drive({.command = kFirstForward, .most_s = 4, .way = 0.3}, "floor: forward again, 0.3 m");
  if (!second) return tl::unexpected(second.error());
  std::vector<OdometryLeg> legs;
  constexpr double kSettle_s = 0.6;
  for (const MotionTrace* trace : {&*forward, &*second}) {
    if (const auto leg = odometry_leg(steady_part(*trace, kSettle_s))) legs.push_back(*leg);
  }
  add("floor", judge_axes(legs));
  const MotionTrace steady = steady_part(*turn, kSettle_s);
  report_.figures.response_s = timing.response_s;
  report_.figures.stopping_s = timing.stopping_s;
  if (timing.stopping_s) report_.figures.stopping_m = timing.stopping_m;
  report_.figures.speed_scale = ratio_of(forward_readings(steady_part(*forward, kSettle_s), model), "tags");
  report_.figures.yaw_rate_scale = ratio_of(turn_readings(steady, standing_part(*turn), model), "tags");
  return {};
}

}  // namespace waymark
