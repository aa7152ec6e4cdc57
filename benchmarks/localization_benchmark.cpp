// One frame of tags and the motion since the previous one: the entire localizer (gates, considered errors,
// one second of history) compared with a plain textbook EKF of x, y and yaw with the same corners, written
// with Eigen.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <vector>

#include <benchmark/benchmark.h>
#include <Eigen/Cholesky>
#include <Eigen/Dense>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/riekf_localizer.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

MountedSensor camera() {
  const PinholeRadtan lens{.fx = 440, .fy = 440, .cx = 320, .cy = 240, .k = {}, .coefficients = 0};
  return {CameraModel::make(lens, 640, 480).value(), SE3(body_R_optical(), {0.08, 0, 0.18})};
}

/// A ring of 24 tags that face inwards.
TagMap ring() {
  TagMap map;
  for (int i = 0; i < 24; ++i) {
    const double angle = 2 * std::numbers::pi * i / 24;
    const SE2 place(2.5 * std::cos(angle), 2.5 * std::sin(angle), angle);
    map.tags[{.number = i}] = {.map_T_tag = lift(place) * SE3(body_R_optical(), {0, 0, 0.3}), .size_m = 0.16};
  }
  return map;
}

struct Step {
  Odometry odometry{};
  TagFrame frame{};
};

/// A circle with the given number of steps.
std::vector<Step> circle(int count) {
  Random random(1);
  const TagMap map = ring();
  const MountedSensor sensor = camera();
  std::vector<Step> steps;
  SE2 truth(0, -1, 0);
  for (int i = 0; i < count; ++i) {
    const double dt_s = 1.0 / 15;
    truth = truth * SE2::exp({0.3 * dt_s, 0, 0.3 * dt_s});
    const SensorTime now{Duration(std::llround((10 + i * dt_s) * 1e9))};
    Step step{{.stamp = now, .odom_T_base = truth}, {.stamp = now}};
    const SE3 cam_T_map = (lift(truth) * sensor.base_T_sensor).inverse();
    for (const auto& [id, tag] : map.tags) {
      const auto corners = visible_corners(*sensor.camera, cam_T_map * tag.map_T_tag, tag.size_m);
      if (!corners) continue;
      TagDetection seen{.tag = id, .corners_px = *corners};
      for (auto& corner : seen.corners_px) corner += 0.15 * Eigen::Vector2d(random.normal(), random.normal());
      seen.corner_covariance_px2 = CornerCovariance::Identity() * 0.15 * 0.15;
      step.frame.detections.push_back(seen);
    }
    steps.push_back(step);
  }
  return steps;
}

/// x, y, yaw; corners stacked; (I - K H) P.
class PlainEkf {
 public:
  explicit PlainEkf(TagMap map) : map_(std::move(map)), sensor_(camera()) {
    x_ << 0, -1, 0;
    P_ = Eigen::Matrix3d::Identity() * 0.01;
  }
  void step(const Step& step) {
    const SE2 odom = step.odometry.odom_T_base;
    if (started_) predict((last_.inverse() * odom).log());
    started_ = true;
    last_ = odom;
    update(step.frame);
  }
  [[nodiscard]] const Eigen::Vector3d& state() const { return x_; }

 private:
  void predict(const Eigen::Vector3d& u) {
    const double c = std::cos(x_[2]);
    const double s = std::sin(x_[2]);
    x_ += Eigen::Vector3d(c * u.x() - s * u.y(), s * u.x() + c * u.y(), u.z());
    Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
    F(0, 2) = -s * u.x() - c * u.y();
    F(1, 2) = c * u.x() - s * u.y();
    P_ = F * P_ * F.transpose();
    P_.diagonal().array() += 1e-5;
  }
  void update(const TagFrame& frame) {
    Eigen::MatrixXd H(8 * static_cast<Eigen::Index>(frame.detections.size()), 3);
    Eigen::VectorXd r(H.rows());
    Eigen::Index rows = 0;
    const SE2 X(x_[0], x_[1], x_[2]);
    for (const TagDetection& seen : frame.detections) {
      const MappedTag* tag = map_.find(seen.tag);
      const auto factor = corner_factor(seen, tag->size_m, 0.3);
      CornerJacobians J;
      const auto residual = corner_residual(
          *factor, *sensor_.camera,
          {.map_T_rig = lift(X), .rig_T_cam = sensor_.base_T_sensor, .body_T_tag = tag->map_T_tag}, &J);
      if (!residual) continue;
      r.segment<8>(rows) = *residual;
      H.block<8, 2>(rows, 0) = J.rig.leftCols<2>();
      H.block<8, 1>(rows, 2) = J.rig.col(5) + J.rig.leftCols<2>() * Eigen::Vector2d(X.y(), -X.x());
      rows += 8;
    }
    const Eigen::MatrixXd Hs = H.topRows(rows);
    const Eigen::MatrixXd S = Hs * P_ * Hs.transpose() + Eigen::MatrixXd::Identity(rows, rows);
    const Eigen::MatrixXd K = S.llt().solve(Hs * P_).transpose();
    x_ -= K * r.head(rows);
    P_ = (Eigen::Matrix3d::Identity() - K * Hs) * P_;
  }

  TagMap map_;
  MountedSensor sensor_;
  Eigen::Vector3d x_;
  Eigen::Matrix3d P_;
  SE2 last_{};
  bool started_ = false;
};

/// Of this thread alone, excluding other load on the machine.
double thread_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

void take(const Step& step, RiekfLocalizer& filter) {
  filter.add(step.odometry);
  filter.add(step.frame);
  filter.clear_comparisons();
}

void ours(benchmark::State& state) {
  const std::vector<Step> steps = circle(300);
  for (auto _ : state) {
    RiekfLocalizer filter(Landmarks(ring()), camera());
    filter.start_from(SE2(0.02, -1, 0.02), 0.05, 0.05);
    for (const Step& step : steps) take(step, filter);
    benchmark::DoNotOptimize(filter.estimate());
  }
}

/// Duration of single frames. Reading the clock twice per frame takes a fifth of a frame, so this is not used
/// for the comparison.
void each(benchmark::State& state) {
  const std::vector<Step> steps = circle(300);
  std::vector<double> each_us;
  for (auto _ : state) {
    RiekfLocalizer filter(Landmarks(ring()), camera());
    filter.start_from(SE2(0.02, -1, 0.02), 0.05, 0.05);
    for (const Step& step : steps) {
      const double begin_us = thread_us();
      take(step, filter);
      each_us.push_back(thread_us() - begin_us);
    }
    benchmark::DoNotOptimize(filter.estimate());
  }
  std::ranges::sort(each_us);
  state.counters["p50_us"] = each_us[each_us.size() / 2];
  state.counters["p99_us"] = each_us[each_us.size() * 99 / 100];
}

void peer(benchmark::State& state) {
  const std::vector<Step> steps = circle(300);
  for (auto _ : state) {
    PlainEkf filter(ring());
    for (const Step& step : steps) filter.step(step);
    benchmark::DoNotOptimize(filter.state());
  }
}

BENCHMARK(ours)->Name("localization/ours/frame");
BENCHMARK(each)->Name("localization_single/ours/frame");
BENCHMARK(peer)->Name("localization/peer:plain_eigen_ekf/frame");

}  // namespace
}  // namespace waymark
