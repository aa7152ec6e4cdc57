#include "tests/support/camera_chain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "tests/support/draw_tag.hpp"
#include "tests/support/plane.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/families/family.hpp"

namespace waymark::testing {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;
constexpr int kFine = 3;  ///< samples along a pixel

/// All random draws of one image.
struct Setting {
  TrueTag truth;
  Eigen::Matrix3d cell_H_px;
  int size_px = 0;  ///< of the image
  Vector2d slope_direction{1, 0};
  Vector2d light_direction{1, 0};
  double behind = 0;  ///< fraction of white
  Vector2d gloss_at{4, 4};
  double gloss_radius = 1;
  int covered_side = 0;
  double motion_rad = 0;
};

Vector2d direction(Random& random) {
  const double angle = random.uniform(0, 2 * kPi);
  return {std::cos(angle), std::sin(angle)};
}

/// A tag in the middle of an image just large enough, off the axis of a camera of 900 px.
Setting arrange(const CameraChain& chain, Random& random) {
  constexpr double kFocal = 900;
  Setting setting;
  const double size = chain.min_size_px * std::pow(chain.max_size_px / chain.min_size_px, random.uniform());
  const double tilt = random.uniform(0, chain.max_tilt_deg) * kPi / 180;
  const Vector2d about = direction(random);
  const double roll = chain.level ? 0 : random.uniform(0, 2 * kPi);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(tilt, Eigen::Vector3d(about.x(), about.y(), 0)) *
                                Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()));
  setting.size_px = static_cast<int>(std::ceil(1.9 * size)) + 24;
  const Vector2d phase(random.uniform(), random.uniform());
  TagCorners corners;
  const std::array<Vector2d, 4> unit = {Vector2d(-0.5, -0.5), {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d p =
        Eigen::Vector3d(0, 0, kFocal / size) + turn * Eigen::Vector3d(unit.at(k).x(), unit.at(k).y(), 0);
    corners.at(k) = kFocal * p.head<2>() / p.z() + Vector2d::Constant(0.5 * setting.size_px) + phase;
  }
  const Family& table = family(FamilyId::Tag36h11);
  setting.truth.tag = {FamilyId::Tag36h11, static_cast<int>(random.index(table.codes.size()))};
  setting.truth.corners_px = corners;
  setting.truth.size_px = size;
  setting.truth.tilt_deg = tilt * 180 / kPi;
  setting.cell_H_px = homography_of_square(table.width_at_border, corners).inverse();
  setting.slope_direction = direction(random);
  setting.light_direction = direction(random);
  setting.behind = random.uniform(0.1, 1.0);
  setting.gloss_at = {random.uniform(0, 8), random.uniform(0, 8)};
  setting.gloss_radius = random.uniform(1, 3);
  setting.covered_side = static_cast<int>(random.index(4));
  setting.motion_rad = random.uniform(0, 2 * kPi);
  return setting;
}

/// Overlap of [at - half, at + half] with each cell of unit width, starting at `first`.
std::array<double, 12> overlaps(double at, double half, int first, int count) {
  std::array<double, 12> share{};
  for (int i = 0; i < count; ++i) {
    const double low = std::max(at - half, static_cast<double>(first + i));
    const double high = std::min(at + half, static_cast<double>(first + i + 1));
    share.at(static_cast<std::size_t>(i)) = std::max(0.0, high - low) / (2 * half);
  }
  return share;
}

double overlap(double at, double half, double low, double high) {
  return std::max(0.0, std::min(at + half, high) - std::max(at - half, low)) / (2 * half);
}

/// The tag and its surroundings as reflected light, averaged over areas of 2 half_u by 2 half_v cells.
class Paper {
 public:
  Paper(const CameraChain& chain, const Setting& setting)
      : chain_(chain), setting_(setting), cells_(bitmap(setting.truth.tag)) {}

  [[nodiscard]] double light(double u, double v, double half_u, double half_v) const {
    const auto x = overlaps(u, half_u, -1, kCells);
    const auto y = overlaps(v, half_v, -1, kCells);
    double ink = 0;
    for (std::size_t row = 0; row < kCells; ++row) {
      for (std::size_t column = 0; column < kCells; ++column) {
        if (cells_[row * kCells + column] == 0) ink += x.at(column) * y.at(row);
      }
    }
    const double black = chain_.black / 255;
    const double white = chain_.white / 255;
    const double paper = overlap(u, half_u, -chain_.margin_cells, kSide + chain_.margin_cells) *
                         overlap(v, half_v, -chain_.margin_cells, kSide + chain_.margin_cells);
    double level = white + ink * (black - white);
    level = paper * level + (1 - paper) * std::min(1.0, white) * setting_.behind;
    const double covered = paper_over(u, v, half_u, half_v);
    level += covered * (white - level);
    const double thing = corner_cover(u, v, half_u, half_v);
    level += thing * (110.0 / 255 - level);
    const Vector2d place(2 * u / kSide - 1, 2 * v / kSide - 1);
    level *= 1 + chain_.light_slope * place.dot(setting_.light_direction);
    level += chain_.black_slope / 255 * place.dot(setting_.slope_direction);
    const double r = (Vector2d(u, v) - setting_.gloss_at).norm() / setting_.gloss_radius;
    return std::max(0.0, level + chain_.gloss / 255 * std::exp(-0.5 * r * r));
  }

 private:
  static constexpr int kCells = 10;
  static constexpr double kSide = 8;

  /// White paper over one border.
  [[nodiscard]] double paper_over(double u, double v, double half_u, double half_v) const {
    if (chain_.paper_over_cells <= 0) return 0;
    const double edge = chain_.paper_over_cells;
    const double whole_u = overlap(u, half_u, -1.5, kSide + 1.5);
    const double whole_v = overlap(v, half_v, -1.5, kSide + 1.5);
    switch (setting_.covered_side) {
      case 0:
        return whole_u * overlap(v, half_v, -1.5, edge);
      case 1:
        return whole_v * overlap(u, half_u, kSide - edge, kSide + 1.5);
      case 2:
        return whole_u * overlap(v, half_v, kSide - edge, kSide + 1.5);
      default:
        return whole_v * overlap(u, half_u, -1.5, edge);
    }
  }

  [[nodiscard]] double corner_cover(double u, double v, double half_u, double half_v) const {
    if (!chain_.corner_covered) return 0;
    const int k = setting_.covered_side;
    const bool right = k == 1 || k == 2;
    const bool low = k == 2 || k == 3;
    return overlap(u, half_u, right ? kSide - 1.0 : -3.0, right ? kSide + 3.0 : 1.0) *
           overlap(v, half_v, low ? kSide - 1.0 : -3.0, low ? kSide + 3.0 : 1.0);
  }

  const CameraChain& chain_;
  const Setting& setting_;
  std::vector<std::uint8_t> cells_;
};

/// The scene on the fine grid. `sensor_scale` sensor pixels are one pixel of the image.
Plane scene(const CameraChain& chain, const Setting& setting) {
  const int side = static_cast<int>(std::lround(setting.size_px * chain.scale));
  const double step = setting.size_px / (static_cast<double>(side) * kFine);
  Plane fine(side * kFine, side * kFine);
  const Paper paper(chain, setting);
  const Eigen::Matrix3d& H = setting.cell_H_px;
  fine.each([&](int x, int y) {
    const Eigen::Vector3d p = H * Eigen::Vector3d((x + 0.5) * step, (y + 0.5) * step, 1);
    const double u = p.x() / p.z();
    const double v = p.y() / p.z();
    const double du = (std::abs(H(0, 0) - u * H(2, 0)) + std::abs(H(0, 1) - u * H(2, 1))) / std::abs(p.z());
    const double dv = (std::abs(H(1, 0) - v * H(2, 0)) + std::abs(H(1, 1) - v * H(2, 1))) / std::abs(p.z());
    return static_cast<float>(paper.light(u, v, 0.5 * step * du, 0.5 * step * dv));
  });
  return fine;
}

Plane through_lens(const CameraChain& chain, const Setting& setting, Plane fine) {
  const double samples = kFine * chain.scale;  // a pixel of the image
  fine = blurred(fine, chain.blur_px * samples);
  if (chain.disc_px > 0) fine = smeared(fine, disc(chain.disc_px * samples));
  if (chain.motion_px > 0) fine = smeared(fine, line(chain.motion_px * samples, setting.motion_rad));
  if (chain.bloom > 0) {
    const Plane spread = blurred(fine, 3 * samples);
    for (std::size_t i = 0; i < fine.value.size(); ++i) {
      fine.value[i] += static_cast<float>(chain.bloom) * (spread.value[i] - fine.value[i]);
    }
  }
  return fine;
}

Plane exposed(const CameraChain& chain, Plane& fine, Random& random) {
  Plane sensor(fine.width / kFine, fine.height / kFine);
  for (int y = 0; y < sensor.height; ++y) {
    for (int x = 0; x < sensor.width; ++x) {
      double sum = 0;
      for (int i = 0; i < kFine * kFine; ++i) {
        const int row = i / kFine;
        sum += static_cast<double>(fine.at(kFine * x + i % kFine, kFine * y + row));
      }
      const double value = sum / (kFine * kFine) + chain.noise / 255 * random.normal();
      sensor.at(x, y) = static_cast<float>(std::clamp(value, 0.0, 1.0));
    }
  }
  return sensor;
}

/// Grey values of a sensor whose pixels each measure one colour (RGGB), with the other colours interpolated
/// from neighbours. The paper is grey; the sensor's colours differ in sensitivity and are balanced.
Plane demosaiced(const Plane& sensor) {
  Plane grey(sensor.width, sensor.height);
  const auto colour = [](int x, int y) { return (x & 1) + (y & 1); };  // 0 red, 1 green, 2 blue
  grey.each([&](int x, int y) {
    std::array<float, 3> sum{};
    std::array<float, 3> count{};
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        const auto c = static_cast<std::size_t>(colour(x + i, y + j));
        sum.at(c) += sensor.near(x + i, y + j);
        count.at(c) += 1;
      }
    }
    const auto own = static_cast<std::size_t>(colour(x, y));
    sum.at(own) = sensor.near(x, y);
    count.at(own) = 1;
    return 0.299F * sum[0] / count[0] + 0.587F * sum[1] / count[1] + 0.114F * sum[2] / count[2];
  });
  return grey;
}

/// Bilinear, like scalers in cameras; image pixels are sampled at their centres.
Plane scaled(const Plane& from, int side) {
  const double step = static_cast<double>(from.width) / side;
  Plane to(side, side);
  to.each([&](int x, int y) {
    const double fx = (x + 0.5) * step - 0.5;
    const double fy = (y + 0.5) * step - 0.5;
    const int ix = static_cast<int>(std::floor(fx));
    const int iy = static_cast<int>(std::floor(fy));
    const auto dx = static_cast<float>(fx - ix);
    const auto dy = static_cast<float>(fy - iy);
    return (1 - dy) * ((1 - dx) * from.near(ix, iy) + dx * from.near(ix + 1, iy)) +
           dy * ((1 - dx) * from.near(ix, iy + 1) + dx * from.near(ix + 1, iy + 1));
  });
  return to;
}

Plane developed(const CameraChain& chain, int side, Plane sensor) {
  if (chain.mosaic) sensor = demosaiced(sensor);
  if (chain.gamma != 1) {
    for (float& value : sensor.value) value = std::pow(value, static_cast<float>(1 / chain.gamma));
  }
  sensor = blurred(sensor, chain.denoising_px);
  if (chain.sharpening > 0) {
    const Plane soft = blurred(sensor, 1.0);
    for (std::size_t i = 0; i < sensor.value.size(); ++i) {
      sensor.value[i] += static_cast<float>(chain.sharpening) * (sensor.value[i] - soft.value[i]);
    }
  }
  return sensor.width == side ? sensor : scaled(sensor, side);
}

Image encoded(const CameraChain& chain, const Plane& plane) {
  Image image(plane.width, plane.height);
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) {
      image.row(y)[x] = static_cast<std::uint8_t>(
          std::lround(std::clamp(255.0 * static_cast<double>(plane.near(x, y)), 0.0, 255.0)));
    }
  }
  if (chain.jpeg_quality == 0) return image;
  const auto bytes = encode_jpeg(image, chain.jpeg_quality);
  EXPECT_TRUE(bytes);
  auto decoded = decode_image(*bytes, "compressed");
  EXPECT_TRUE(decoded);
  return std::move(*decoded);
}

}  // namespace

ChainedTag photographed_tag(const CameraChain& chain, std::uint64_t seed) {
  Random random(seed);
  const Setting setting = arrange(chain, random);
  Plane fine = through_lens(chain, setting, scene(chain, setting));
  const Plane sensor = exposed(chain, fine, random);
  return {encoded(chain, developed(chain, setting.size_px, sensor)), setting.truth};
}

}  // namespace waymark::testing
