#include <algorithm>
#include <cmath>
#include <ctime>
#include <thread>
#include <vector>

#include "waymark/app/doctor/doctor.hpp"
#include "waymark/base/random.hpp"
#include "waymark/families/family.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/runtime/robot_loop.hpp"

namespace waymark {
namespace {

constexpr double kNoise = 3;  // grey levels, as a webcam indoors

/// A tag with its white border, `cell_px` from cell to cell.
void draw_tag(Image& image, int id, int left, int top, int cell_px) {
  const std::vector<std::uint8_t> cells = bitmap({FamilyId::Tag36h11, id});
  const int side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(cells.size()))));
  for (int y = 0; y < side * cell_px; ++y)
    for (int x = 0; x < side * cell_px; ++x) {
      const int cell = (y / cell_px) * side + x / cell_px;
      image.row(top + y)[left + x] = cells[static_cast<std::size_t>(cell)] != 0 ? 200 : 40;
    }
}

/// Four tags before a background with structure, and noise.
Image drawn_picture(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.row(y)[x] = static_cast<std::uint8_t>(120 + 30 * std::sin(x / 17.0) * std::cos(y / 23.0));
  const int cell_px = std::max(1, std::min(width, height) / 40);
  const int side = 10 * cell_px;
  for (int i = 0; i < 4; ++i)
    draw_tag(image, i, (i % 2 == 0 ? width / 4 : 3 * width / 4) - side / 2,
             (i < 2 ? height / 4 : 3 * height / 4) - side / 2, cell_px);
  Random random(1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.row(y)[x] =
          static_cast<std::uint8_t>(std::clamp(image.row(y)[x] + random.normal(0, kNoise), 0.0, 255.0));
  return image;
}

/// The picture again and again, at a rate.
class DrawnCamera final : public Source {
 public:
  explicit DrawnCamera(const LoopTrial& trial)
      : picture_(drawn_picture(trial.width, trial.height)),
        period_(static_cast<std::int64_t>(1e9 / trial.rate_hz)),
        due_(steady_now() + period_) {}

  Result<std::optional<RobotEvent>> next(Duration most) override {
    const Duration wait = due_ - steady_now();
    if (wait > most) {
      std::this_thread::sleep_for(most);
      return std::optional<RobotEvent>();
    }
    if (wait > Duration(0)) std::this_thread::sleep_for(wait);
    const CameraFrame frame{.stamp = SensorTime(due_), .image = picture_};
    due_ += period_;
    return std::optional<RobotEvent>(Sample(frame));
  }
  [[nodiscard]] bool more() const override { return steady_now() >= due_; }
  [[nodiscard]] std::optional<SensorTime> now() const override { return SensorTime(steady_now()); }

 private:
  Image picture_;
  Duration period_;
  Duration due_;
};

class StandingRobot final : public Robot {
 public:
  Status command(const VelocityCommand& /*command*/) override { return {}; }
};

double thread_seconds() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace

Result<LoopTrialResult> try_loop(const TagFinder& finder, const LoopTrial& trial,
                                 const DoctorCancelled& cancelled) {
  DrawnCamera source(trial);
  StandingRobot robot;
  RobotLoop loop(source, robot, real_time(), {.finder = &finder}, {.timeout_s = trial.seconds});
  std::vector<double> delays_ms;
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) {
    if (std::holds_alternative<TagFrame>(sample))
      delays_ms.push_back(1e3 * to_seconds(steady_now() - stamp_of(sample).time_since_epoch()));
    return Status();
  };
  listener.should_stop = cancelled;
  listener.decide = [](Duration, SensorTime) { return Result<DriverDecision>(DriverDecision{}); };
  const double began_s = thread_seconds();
  const auto end = loop.drive(listener);
  if (!end) return tl::unexpected(end.error());
  LoopTrialResult result{.pictures = static_cast<int>(delays_ms.size()) + loop.dropped_pictures(),
                         .dropped = loop.dropped_pictures(),
                         .share = (thread_seconds() - began_s) / to_seconds(end->uptime)};
  std::ranges::sort(delays_ms);
  if (!delays_ms.empty()) result.median_ms = delays_ms[delays_ms.size() / 2];
  return result;
}

}  // namespace waymark
