// A lap with changes of direction is taught, mapped and repeated including its cusps, by skid-steered and
// Ackermann robots; and a robot stops at the stations of its route.
#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "replay_course.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/pipeline/lap_mapper.hpp"
#include "waymark/replay/route_builder.hpp"

namespace waymark::replay_course {
namespace {

struct Taught {
  TaughtLap data{};
  Trajectory truth{};
};

struct Manoeuvre {
  double for_s;
  VelocityCommand command;
};

/// Forwards, backwards around a corner, forwards out of it.
constexpr std::array kManoeuvres{Manoeuvre{6, {0.3, 0.18}},   Manoeuvre{1, {0, 0}},
                                 Manoeuvre{5, {-0.2, -0.12}}, Manoeuvre{1, {0, 0}},
                                 Manoeuvre{5, {0.25, 0.3}},   Manoeuvre{1, {0, 0}}};

SimulatedSetup setup_of(const Course& course, std::uint64_t seed) {
  SimulatedSetup setup{.world = course.world,
                       .model = course.robot.model,
                       .camera = course.robot.camera,
                       .robot = course.robot.simulation};
  setup.robot.seed = seed;
  setup.robot.camera_latency_s = 0.08;
  return setup;
}

Taught teach(const SimulatedSetup& setup) {
  Taught taught;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) {
    if (const auto* frame = std::get_if<TagFrame>(&sample)) taught.data.frames.push_back(*frame);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) taught.data.odometry.push_back(*odometry);
    if (const auto* truth = std::get_if<TruthPose>(&sample))
      taught.truth.push_back({truth->stamp, truth->map_T_base});
    return Status();
  };
  const auto drive = [](const SE2&, Duration uptime, SensorTime) -> Result<DriverDecision> {
    double at_s = to_seconds(uptime);
    for (const Manoeuvre& manoeuvre : kManoeuvres) {
      if (at_s < manoeuvre.for_s) return DriverDecision{.command = manoeuvre.command};
      at_s -= manoeuvre.for_s;
    }
    return DriverDecision{.done = true};
  };
  EXPECT_TRUE(drive_lap(setup, drive, listener).value().finished);
  return taught;
}

MappedLap map(const SimulatedSetup& setup, const Taught& taught) {
  const World& world = setup.world;
  const TeachSetup taught_with{.camera = setup.camera,
                               .base_T_cam = setup.model.base_T_cam,
                               .sizes = {.default_size_m = 0.16},
                               .anchor = world.anchor,
                               .map_T_anchor = world.tags.find(world.anchor)->map_T_tag};
  return map_lap(taught.data, taught_with).value();
}

Route through_file(const Route& route) {
  auto read = parse_route(to_yaml(route), "route.yaml");
  EXPECT_TRUE(read) << to_string(read.error());
  return read ? *std::move(read) : route;
}

double least_distance_m(const Trajectory& way, const Eigen::Vector3d& place) {
  double least = 1e9;
  for (const StampedPose& pose : way) least = std::min(least, (pose.map_T_base.translation() - place).norm());
  return least;
}

/// Legs of 0.4 m to 1.6 m in alternating directions, with noise; between two legs the robot stops and, if
/// `turns`, turns on the spot.
Trajectory random_legs(Random& random, bool turns) {
  constexpr double kStep_m = 0.01;
  Trajectory driven;
  SE2 map_T_base(0, 0, random.uniform(-3, 3));
  const auto add = [&] {
    const SE2 noise{random.normal(0, 0.002), random.normal(0, 0.002), random.normal(0, 0.005)};
    const Duration at(static_cast<std::int64_t>(driven.size()) * 33'000'000);
    driven.push_back({SensorTime(at), lift(map_T_base * noise)});
  };
  double sign = random.uniform(0, 1) < 0.5 ? 1 : -1;
  for (int leg = 0; leg < 4; ++leg, sign = -sign) {
    const double bend = random.uniform(-1.5, 1.5);
    const int steps = static_cast<int>(random.uniform(40, 160));
    for (int i = 0; i < steps; ++i, add())
      map_T_base = map_T_base * SE2::exp({sign * kStep_m, 0, sign * kStep_m * bend});
    for (int i = 0; i < 10; ++i) add();
    const double turn = turns ? random.uniform(-2, 2) : 0;
    for (int i = 0; i < 20 && turns; ++i, add()) map_T_base = map_T_base * SE2(0, 0, turn / 20);
  }
  return driven;
}

TEST(ReversingRoute, ARouteOfRandomLegsSurvivesItsFile) {
  Random random(7);
  int turning_points = 0;
  for (int i = 0; i < 300; ++i) {
    const auto route = build_route(random_legs(random, i % 2 == 1));
    ASSERT_TRUE(route) << i;
    const auto read = parse_route(to_yaml(*route), "route.yaml");
    ASSERT_TRUE(read) << i << ": " << to_string(read.error());
    for (std::size_t k = 1; k < read->points.size(); ++k)
      if ((read->points[k - 1].speed_m_s < 0) != (read->points[k].speed_m_s < 0)) ++turning_points;
  }
  EXPECT_GE(turning_points, 800) << "of 900";
}

class Reversing : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Robots, Reversing, ::testing::Values("limo", "limo-ackermann"));

TEST_P(Reversing, ALapWithCuspsIsTaughtMappedAndRepeated) {
  const Course course = circuit24(GetParam());
  const Taught taught = teach(setup_of(course, 21));
  MappedLap mapped = map(setup_of(course, 21), taught);
  mapped.route = through_file(mapped.route);  // as `waymark map` writes and `waymark replay` reads it
  std::vector<double> cusps_m;
  for (std::size_t i = 1; i < mapped.route.points.size(); ++i) {
    const RoutePoint& a = mapped.route.points[i - 1];
    if ((a.speed_m_s < 0) != (mapped.route.points[i].speed_m_s < 0)) cusps_m.push_back(a.arc_length_m);
  }
  ASSERT_EQ(cusps_m.size(), 2U);
  EXPECT_FALSE(mapped.route.closed);
  const ReplayJudgement itself =
      judge_replay(taught.truth, taught.truth, course.world.tags, course.robot.model.hull).value();
  ASSERT_GT(itself.min_clearance_m, 0.25) << "the taught lap does not touch the tags";

  SimulatedSetup setup = setup_of(course, 1021);
  LocalizerSetup localizer{.landmarks = Landmarks(mapped.map),
                           .tags = mapped.map,
                           .sensor = {setup.camera, setup.model.base_T_cam}};
  ReplayOptions options;
  if (std::string(GetParam()) == "limo-ackermann") options.safety.max_curvature_1_m = 2.5;
  Replayer replayer(make_localization_method(localizer).value(), mapped.route, mapped.map, setup.model,
                    options);
  Trajectory way;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) {
    if (const auto* truth = std::get_if<TruthPose>(&sample)) way.push_back({truth->stamp, truth->map_T_base});
    return Status();
  };
  const ReplayEnd end = drive_replay(setup, replayer, listener).value();
  ASSERT_TRUE(end.finished) << end.reason;
  EXPECT_EQ(end.stops, 0);
  const ReplayJudgement judged =
      judge_replay(way, taught.truth, course.world.tags, course.robot.model.hull).value();
  std::printf("%s: rmse %.4f p95 %.4f max %.4f m, %.2f deg\n", GetParam(), judged.cross_track_rmse_m,
              judged.cross_track_p95_m, judged.cross_track_max_m, judged.heading_rmse_deg);
  EXPECT_LT(judged.cross_track_rmse_m, 0.015);
  EXPECT_LT(judged.cross_track_max_m, 0.04);
  EXPECT_LT(judged.heading_rmse_deg, 2);
  // Each turning point and the end were reached.
  for (const double cusp_m : cusps_m)
    EXPECT_LT(least_distance_m(way, lift(pose_at(mapped.route, cusp_m)).translation()), 0.04) << cusp_m;
  EXPECT_LT((way.back().map_T_base.translation() - taught.truth.back().map_T_base.translation()).norm(),
            0.05);
}

TEST(Stations, TheRobotStopsAtEachAndDoesNotReverse) {
  Course course = circuit24();
  course.route.stations = {{.name = "shelf", .arc_length_m = 3, .pause_s = 6},  // longer than give_up_s
                           {.name = "door", .arc_length_m = 3.4, .pause_s = 0.5}};
  const SimulatedSetup setup = setup_of(course, 5);
  LocalizerSetup localizer{.landmarks = Landmarks(course.world.tags),
                           .tags = course.world.tags,
                           .sensor = {setup.camera, setup.model.base_T_cam}};
  ReplayOptions options;
  options.laps = 2;
  Replayer replayer(make_localization_method(localizer).value(), course.route, course.world.tags, setup.model,
                    options);
  std::vector<std::string> visits;
  double stopped_s = 0;
  double moved_m = 0;  // while it should be stopped, after the 0.5 s that it needs to stop
  double backwards_m = 0;
  bool at_station = false;
  std::optional<SE2> last;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) {
    const auto* truth = std::get_if<TruthPose>(&sample);
    if (truth == nullptr) return Status();
    const SE2 here = project_to_plane(truth->map_T_base);
    const double ahead = last ? (last->inverse() * here).x() : 0;
    backwards_m = std::max(backwards_m, -ahead);
    if (at_station && stopped_s > 0.5) moved_m = std::max(moved_m, std::abs(ahead));
    last = here;
    return Status();
  };
  listener.on_step = [&](SensorTime, const ReplayStep& step) {
    at_station = step.state == ReplayState::AtStation;
    if (at_station && stopped_s == 0) visits.push_back(step.station->name);
    stopped_s = at_station ? stopped_s + 0.05 : 0;
    if (at_station) {
      EXPECT_THAT(step.reason.value_or(""), ::testing::HasSubstr("'" + step.station->name + "'"));
      EXPECT_NEAR(step.progress->arc_length_m, step.station->arc_length_m, 0.03);
    }
    return Status();
  };
  const ReplayEnd end = drive_replay(setup, replayer, listener).value();
  EXPECT_TRUE(end.finished) << end.reason;
  EXPECT_EQ(end.stops, 0);
  EXPECT_EQ(visits, (std::vector<std::string>{"shelf", "door", "shelf", "door"}));
  EXPECT_LT(moved_m, 0.0005) << "in 20 ms";
  EXPECT_LT(backwards_m, 0.002);
}

}  // namespace
}  // namespace waymark::replay_course
