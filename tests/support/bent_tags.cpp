#include "tests/support/bent_tags.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <Eigen/Dense>

#include "waymark/base/random.hpp"

namespace waymark::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFocalPx = 1100;
constexpr double kPi = std::numbers::pi;
constexpr std::array<std::array<double, 2>, 4> kCorners = {
    {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}};

/// A sine over the sheet, or over the rows of the image.
struct Wave {
  Vector2d per_side{0, 0};
  double phase = 0;
  Vector3d sides{0, 0, 0};

  [[nodiscard]] Vector3d at(const Vector2d& place) const {
    return std::sin(2 * kPi * per_side.dot(place) + phase) * sides;
  }
};

/// A sheet in front of a camera. Places on it are in sides of the tag, from its middle.
class Sheet {
 public:
  Sheet(const BentTagOptions& options, Random& random)
      : options_(options), distance_(kFocalPx / options.size_px) {
    middle_px_ = Vector2d::Constant(std::ceil(1.25 * options.size_px) + 12);
    middle_px_.x() += random.uniform(-0.5, 0.5);
    middle_px_.y() += random.uniform(-0.5, 0.5);
    const double about = random.uniform(0, 2 * kPi);
    const double tilt = random.uniform(0, options.max_tilt_deg) * kPi / 180;
    const double roll = random.uniform(0, 2 * kPi);
    turn_ = Eigen::AngleAxisd(tilt, Vector3d(std::cos(about), std::sin(about), 0)) *
            Eigen::AngleAxisd(roll, Vector3d::UnitZ());
    if (options.bend == Bend::Cylinder) {
      const double quarter_turns = static_cast<double>(random.index(2));
      axis_ = Eigen::Rotation2Dd(kPi / 2 * quarter_turns + random.uniform(-0.25, 0.25));
    }
    if (options.bend == Bend::Wobble) draw_wobble(random);
    if (options.bend == Bend::Crumpled) draw_creases(random);
  }

  [[nodiscard]] int side_px() const { return 2 * static_cast<int>(middle_px_.x()); }

  [[nodiscard]] Vector2d px(const Vector2d& place) const {
    const Vector3d p = turn_ * bent(place) + Vector3d(0, 0, distance_);
    Vector2d px = kFocalPx * p.head<2>() / p.z();
    if (options_.bend != Bend::Wobble) return middle_px_ + px;
    const double row = px.y() / options_.size_px;
    for (const Wave& wave : waves_) px += options_.size_px * wave.at({0, row}).head<2>();
    return middle_px_ + px;
  }

  /// The place at a pixel, by Newton's method from a nearby place.
  [[nodiscard]] Vector2d place(const Vector2d& px, Vector2d near) const {
    constexpr int kMaxIterations = 8;
    constexpr double kStep = 1e-4;
    for (int i = 0; i < kMaxIterations; ++i) {
      const Vector2d here = this->px(near);
      Eigen::Matrix2d J;
      J.col(0) = (this->px(near + Vector2d(kStep, 0)) - here) / kStep;
      J.col(1) = (this->px(near + Vector2d(0, kStep)) - here) / kStep;
      Vector2d step = J.inverse() * (px - here);
      if (!step.allFinite()) break;
      step *= std::min(1.0, 0.2 / std::max(step.norm(), 1e-12));
      near += step;
      if (step.norm() < 1e-5) break;
    }
    return near;
  }

 private:
  void draw_wobble(Random& random) {
    for (const double share : {0.8, 0.6}) {
      Wave wave;
      wave.per_side.y() = 1 / random.uniform(0.9, 2.5);
      wave.phase = random.uniform(0, 2 * kPi);
      wave.sides.x() = share * options_.amount;
      wave.sides.y() = 0.3 * random.uniform(-1, 1) * options_.amount;
      waves_.push_back(wave);
    }
  }

  void draw_creases(Random& random) {
    constexpr int kWaves = 5;
    for (int i = 0; i < kWaves; ++i) {
      Wave wave;
      const double direction = random.uniform(0, 2 * kPi);
      wave.per_side = Vector2d(std::cos(direction), std::sin(direction)) / random.uniform(0.9, 2.5);
      wave.phase = random.uniform(0, 2 * kPi);
      wave.sides.x() = 0.3 * random.normal();
      wave.sides.y() = 0.3 * random.normal();
      wave.sides.z() = random.normal();
      wave.sides *= options_.amount * std::sqrt(2.0 / kWaves);
      waves_.push_back(wave);
    }
  }

  [[nodiscard]] Vector3d bent(const Vector2d& place) const {
    Vector3d p(place.x(), place.y(), 0);
    if (options_.bend == Bend::Cylinder) {
      const double per_side = options_.amount * kPi / 180;
      const Vector2d along = axis_.inverse() * place;
      const Vector2d seen = axis_ * Vector2d(std::sin(per_side * along.x()) / per_side, along.y());
      p = {seen.x(), seen.y(), (1 - std::cos(per_side * along.x())) / per_side};
    }
    if (options_.bend == Bend::Crumpled)
      for (const Wave& wave : waves_) p += wave.at(place);
    return p;
  }

  BentTagOptions options_;
  double distance_ = 0;
  Vector2d middle_px_{0, 0};
  Eigen::Matrix3d turn_ = Eigen::Matrix3d::Identity();
  Eigen::Rotation2Dd axis_{0};
  std::vector<Wave> waves_;
};

/// Grey levels of a square image before noise and rounding.
struct Canvas {
  int side = 0;
  std::vector<double> level;

  explicit Canvas(int side_px, double value)
      : side(side_px), level(static_cast<std::size_t>(side_px) * static_cast<std::size_t>(side_px), value) {}
  [[nodiscard]] double& at(int x, int y) {
    return level[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x)];
  }
};

struct Print {
  const Family& family;
  std::vector<std::uint8_t> cells;
  double black = 40;
  double white = 200;
  double behind = 120;

  [[nodiscard]] double level(const Vector2d& place) const {
    const int width = family.total_width;
    const int x = static_cast<int>(std::floor(place.x() * family.width_at_border + 0.5 * width));
    const int y = static_cast<int>(std::floor(place.y() * family.width_at_border + 0.5 * width));
    if (x < 0 || y < 0 || x >= width || y >= width) return behind;
    return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                 static_cast<std::size_t>(x)] != 0
               ? white
               : black;
  }
};

/// Places at the corners of the pixels, interpolated within a pixel.
void paint(const Sheet& sheet, const Print& print, Canvas& canvas) {
  constexpr int kGrid = 6;
  const int count = canvas.side + 1;
  std::vector<Vector2d> places(static_cast<std::size_t>(count) * static_cast<std::size_t>(count));
  const auto at = [&](int x, int y) -> Vector2d& {
    return places[static_cast<std::size_t>(y) * static_cast<std::size_t>(count) +
                  static_cast<std::size_t>(x)];
  };
  // Starts in the middle, so that each place is near one that is known.
  const int middle = count / 2;
  const auto fill_row = [&](int y, int from) {
    at(middle, y) = sheet.place(Vector2d(middle, y), from == y ? Vector2d(0, 0) : at(middle, from));
    for (int x = middle + 1; x < count; ++x) at(x, y) = sheet.place(Vector2d(x, y), at(x - 1, y));
    for (int x = middle - 1; x >= 0; --x) at(x, y) = sheet.place(Vector2d(x, y), at(x + 1, y));
  };
  fill_row(middle, middle);
  for (int y = middle + 1; y < count; ++y) fill_row(y, y - 1);
  for (int y = middle - 1; y >= 0; --y) fill_row(y, y + 1);
  for (int y = 0; y < canvas.side; ++y) {
    for (int x = 0; x < canvas.side; ++x) {
      double sum = 0;
      for (int i = 0; i < kGrid * kGrid; ++i) {
        const double a = (i % kGrid + 0.5) / kGrid;
        const double b = (i / kGrid + 0.5) / kGrid;  // NOLINT(bugprone-integer-division): a grid of points
        sum += print.level((1 - b) * ((1 - a) * at(x, y) + a * at(x + 1, y)) +
                           b * ((1 - a) * at(x, y + 1) + a * at(x + 1, y + 1)));
      }
      canvas.at(x, y) = sum / (kGrid * kGrid);
    }
  }
}

void blur(Canvas& canvas, double sigma_px, bool along_x) {
  const int reach = std::max(1, static_cast<int>(std::ceil(4 * sigma_px)));
  std::vector<double> kernel;
  double total = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(std::exp(-0.5 * i * i / (sigma_px * sigma_px)));
    total += kernel.back();
  }
  Canvas out(canvas.side, 0);
  for (int y = 0; y < canvas.side; ++y) {
    for (int x = 0; x < canvas.side; ++x) {
      double sum = 0;
      for (int i = -reach; i <= reach; ++i) {
        const auto near = [&](int k) { return std::clamp(k + i, 0, canvas.side - 1); };
        sum += kernel[static_cast<std::size_t>(i + reach)] *
               (along_x ? canvas.at(near(x), y) : canvas.at(x, near(y)));
      }
      out.at(x, y) = sum / total;
    }
  }
  canvas = std::move(out);
}

}  // namespace

std::string_view to_string(Bend bend) {
  switch (bend) {
    case Bend::Flat:
      return "flat";
    case Bend::Cylinder:
      return "cylinder";
    case Bend::Wobble:
      return "wobble";
    case Bend::Crumpled:
      return "crumpled";
  }
  return "unknown";
}

BentTag bent_tag(const BentTagOptions& options, std::uint64_t seed) {
  Random random(7919 * seed + 17 * static_cast<std::uint64_t>(options.bend));
  const Family& family = waymark::family(FamilyId::Tag36h11);
  const TagId tag{FamilyId::Tag36h11, static_cast<int>(random.index(family.codes.size()))};
  const Sheet sheet(options, random);
  const Print print{family, bitmap(tag), 40, 200, random.uniform(70, 170)};
  Canvas canvas(sheet.side_px(), print.behind);
  paint(sheet, print, canvas);
  blur(canvas, options.blur_px, true);
  blur(canvas, options.blur_px, false);
  BentTag made;
  made.truth.tag = tag;
  made.truth.size_px = options.size_px;
  for (std::size_t i = 0; i < 4; ++i)
    made.truth.corners_px.at(i) = sheet.px({kCorners.at(i)[0], kCorners.at(i)[1]});
  made.image = Image(canvas.side, canvas.side);
  for (int y = 0; y < canvas.side; ++y) {
    for (int x = 0; x < canvas.side; ++x) {
      const double value = canvas.at(x, y) + random.normal(0, options.noise);
      made.image.row(y)[x] = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
    }
  }
  return made;
}

}  // namespace waymark::testing
