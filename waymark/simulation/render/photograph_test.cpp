#include "waymark/simulation/render/photograph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/image/image.hpp"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

const CameraModel kCamera =
    CameraModel::make(PinholeRadtan{.fx = 400, .fy = 400, .cx = 160, .cy = 120}, 320, 240).value();
const CameraModel kBent =
    CameraModel::make(
        PinholeRadtan{
            .fx = 250, .fy = 255, .cx = 162, .cy = 117, .k = {-0.25, 0.05, 0.001, 0.002}, .coefficients = 4},
        320, 240)
        .value();

/// No noise, even illumination and a flat background, so the grey levels are those of the scene.
PhotographOptions quiet() {
  return {.black_level_dn = 0,
          .white_level_dn = 250,
          .read_noise_dn = 0,
          .shot_noise_dn = 0,
          .background = "flat",
          .illumination_gradient = 0};
}

Photograph take(const CameraModel& camera, const PhotographScene& scene, const PhotographOptions& options,
                std::uint64_t seed = 1) {
  Random random(seed);
  Result<Photograph> result = photograph(camera, scene, options, random);
  EXPECT_TRUE(result) << to_string(result.error());
  return result ? *result : Photograph{};
}

SE3 facing(double x, double y, double z, double tilt = 0, double roll = 0) {
  return {SO3::from_rpy(0, 0, roll) * SO3::from_rpy(tilt, 0, 0), {x, y, z}};
}

TEST(Photograph, TruthIsTheProjectionOfTheCorners) {
  // The pinhole model is written out here, so that no code is shared with the camera room.
  const SE3 cam_T_tag(SO3::from_rpy(0.4, -0.7, 1.1), {0.05, -0.02, 1.3});
  const Photograph photo =
      take(kCamera, {.tags = {{{FamilyId::Tag36h11, 5}, cam_T_tag, 0.2}}, .sheets = {}}, quiet());
  ASSERT_EQ(photo.tags.size(), 1U);
  const Eigen::Matrix4d T = cam_T_tag.matrix();
  const double signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector4d p = T * Eigen::Vector4d(0.1 * signs[i][0], 0.1 * signs[i][1], 0, 1);
    EXPECT_NEAR(photo.tags[0].corners_px[i].x(), 400 * p.x() / p.z() + 160, 1e-9);
    EXPECT_NEAR(photo.tags[0].corners_px[i].y(), 400 * p.y() / p.z() + 120, 1e-9);
  }
  EXPECT_EQ(photo.tags[0].visible_fraction, 1.0);
}

TEST(Photograph, SizeAndTiltMatchARotatedTag) {
  for (const double tilt : {0.0, 0.5, 1.2}) {
    const Photograph photo =
        take(kCamera, {.tags = {{{FamilyId::Tag36h11, 5}, facing(0, 0, 2, tilt, 0.3), 0.25}}, .sheets = {}},
             quiet());
    EXPECT_NEAR(photo.tags.at(0).tilt_rad, tilt, 1e-12);
    EXPECT_NEAR(photo.tags.at(0).size_px, 400 * 0.25 / 2, 1e-9);
  }
  // Off the axis, the projection stretches a tag that faces the camera; the size is then the square root of
  // the area of its image.
  const Vector3d to_side(0.6, 0, 2);
  const SE3 turned(SO3::from_rpy(0, std::atan2(0.6, 2), 0), to_side);
  const Photograph photo =
      take(kCamera, {.tags = {{{FamilyId::Tag36h11, 5}, turned, 0.001}}, .sheets = {}}, quiet());
  const auto& c = photo.tags.at(0).corners_px;
  const Vector2d a = c[2] - c[0];
  const Vector2d b = c[3] - c[1];
  EXPECT_NEAR(photo.tags.at(0).size_px, std::sqrt(std::abs(a.x() * b.y() - a.y() * b.x()) / 2), 1e-5);
  EXPECT_NEAR(photo.tags.at(0).tilt_rad, 0, 1e-9);
}

/// The middle of every tag cell must have the value from its bitmap; the corners of circular families show
/// paper.
TEST(Photograph, EveryFamilyMatchesItsBitmap) {
  for (const FamilyId id : kAllFamilies) {
    for (const CameraModel* camera : {&kCamera, &kBent}) {
      const Family& tags = family(id);
      const TagInScene tag{
          {id, 7}, facing(0.02, -0.03, 1, 0.5, 0.4), 0.35 * tags.width_at_border / tags.total_width};
      const Photograph photo = take(*camera, {.tags = {tag}, .sheets = {}}, quiet());
      const std::vector<std::uint8_t> cells = bitmap(tag.tag);
      const double cell_m = tag.size_m / tags.width_at_border;
      for (int y = 0; y < tags.total_width; ++y) {
        for (int x = 0; x < tags.total_width; ++x) {
          const Vector3d tag_p((x + 0.5 - tags.total_width / 2.0) * cell_m,
                               (y + 0.5 - tags.total_width / 2.0) * cell_m, 0);
          const Vector2d px = camera->project(tag.cam_T_tag * tag_p).value();
          const bool ink = cells[static_cast<std::size_t>(y * tags.total_width + x)] == 0;
          EXPECT_NEAR(sample_bilinear(photo.image, px.x(), px.y()), ink ? 0 : 250, 3)
              << to_string(tag.tag) << x << " " << y;
        }
      }
    }
  }
}

constexpr double kInk = 20;

/// Position of the border across a side of a tag, measured from grey levels as the white length along many
/// lines across the side, minus the true length. Positive if the ink appears too large.
double border_offset_px(const Photograph& photo, std::size_t side, double reach_px) {
  const auto& corners = photo.tags.at(0).corners_px;
  const Vector2d a = corners[side];
  const Vector2d b = corners[(side + 1) % 4];
  const Vector2d along = (b - a).normalized();
  const Vector2d outwards(along.y(), -along.x());
  constexpr int kLines = 400;
  constexpr int kSteps = 400;
  double sum = 0;
  for (int line = 0; line < kLines; ++line) {
    const Vector2d foot = a + (b - a) * (0.1 + 0.8 * line / kLines);
    double white = 0;
    for (int step = 0; step < kSteps; ++step) {
      const Vector2d at = foot + outwards * reach_px * (2 * (step + 0.5) / kSteps - 1);
      white += (sample_bilinear(photo.image, at.x(), at.y()) - kInk) / (250 - kInk) * (2 * reach_px / kSteps);
    }
    sum += reach_px - white;
  }
  return sum / kLines;
}

TEST(Photograph, BordersAreWithinAThousandthOfAPixelOfTheTruth) {
  Random random(3);
  double mean = 0;
  double squares = 0;
  int sides = 0;
  for (int i = 0; i < 24; ++i) {
    const double tilt = i < 4 ? 0 : random.uniform(0, 0.9);
    const double roll = i < 2 ? 0 : random.uniform(-3, 3);  // vertical sides are hardest to sample
    const double z = random.uniform(0.9, 1.1);
    const double y = random.uniform(-0.01, 0.01);
    const SE3 pose = facing(random.uniform(-0.01, 0.01), y, z, tilt, roll);
    PhotographOptions options = quiet();
    options.read_noise_dn = 0.5;    // without noise, a vertical side is rounded in the same way in every row
    options.black_level_dn = kInk;  // keeps the noise from being clipped, so that its mean is preserved
    options.blur_sigma_px = i % 3 == 0 ? 0.0 : (i % 3 == 1 ? 0.6 : 1.1);
    // Less than half a cell of the most tilted tag, because the next row of bits must not blur into it. The
    // reach cuts off equal parts on both sides.
    const double reach_px = 1.5 + 2 * options.blur_sigma_px;
    const Photograph photo =
        take(kCamera, {.tags = {{{FamilyId::Tag36h11, 11}, pose, 0.3}}, .sheets = {}}, options);
    for (const Vector2d& corner : photo.tags.at(0).corners_px) {
      ASSERT_GT(std::min(corner.x(), corner.y()), reach_px) << "tag " << i << " is entirely in the image";
      ASSERT_LT(std::max(corner.x() - 80, corner.y()), 240 - reach_px) << "tag " << i;
    }
    for (std::size_t side = 0; side < 4; ++side) {
      const double offset = border_offset_px(photo, side, reach_px);
      EXPECT_NEAR(offset, 0, 0.003) << "tag " << i << ", side "
                                    << side;  // noise contributes a standard deviation of 0.0007
      mean += offset;
      squares += offset * offset;
      ++sides;
    }
  }
  EXPECT_NEAR(mean / sides, 0, 0.0005);
  EXPECT_LT(std::sqrt(squares / sides), 0.001);
}

TEST(Photograph, APrintedSheetEqualsTheTag) {
  const TagInScene tag{{FamilyId::Tag36h11, 42}, facing(0.03, 0.02, 1, 0.6, 0.7), 0.2};
  const Family& tags = family(tag.tag.family);
  const int cell_px = 5;
  const int cells = tags.total_width + 2;  // including a margin of one cell
  SheetInScene sheet{Image(cells * cell_px, cells * cell_px, 255),
                     tag.size_m / tags.width_at_border / cell_px, tag.cam_T_tag};
  const std::vector<std::uint8_t> print = bitmap(tag.tag);
  for (int y = 0; y < tags.total_width * cell_px; ++y) {
    for (int x = 0; x < tags.total_width * cell_px; ++x) {
      sheet.raster.row(y + cell_px)[x + cell_px] =
          print[static_cast<std::size_t>((y / cell_px) * tags.total_width + x / cell_px)];
    }
  }
  const Photograph of_tag = take(kBent, {.tags = {tag}, .sheets = {}}, quiet());
  const Photograph of_sheet = take(kBent, {.tags = {}, .sheets = {sheet}}, quiet());
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x)
      ASSERT_NEAR(of_tag.image.row(y)[x], of_sheet.image.row(y)[x], 1) << x << " " << y;
  }
  EXPECT_TRUE(of_sheet.tags.empty());
}

TEST(Photograph, TheSameSeedGivesTheSameImage) {
  const PhotographScene scene{.tags = {{{FamilyId::Tag36h11, 1}, facing(0, 0, 1, 0.3), 0.1}}, .sheets = {}};
  EXPECT_EQ(take(kCamera, scene, {}, 5).image, take(kCamera, scene, {}, 5).image);
  EXPECT_NE(take(kCamera, scene, {}, 5).image, take(kCamera, scene, {}, 6).image);
}

TEST(Photograph, NoiseHasTheRequestedVariance) {
  PhotographOptions options = quiet();
  options.background_level_dn = 100;
  options.read_noise_dn = 3;
  options.shot_noise_dn = 0.07;
  const Image image = take(kCamera, {}, options).image;
  double sum = 0;
  double squares = 0;
  const double count = 320.0 * 240;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      sum += image.row(y)[x];
      squares += std::pow(image.row(y)[x] - 100.0, 2);
    }
  }
  const double variance = 9 + 0.07 * 100 + 1.0 / 12;  // including rounding
  EXPECT_NEAR(sum / count, 100, 4 * std::sqrt(variance / count));
  EXPECT_NEAR(squares / count, variance, 4 * variance * std::sqrt(2 / count));
}

TEST(Photograph, IlluminationFallsOffAsRequested) {
  PhotographOptions options = quiet();
  options.background_level_dn = 100;
  options.illumination_gradient = 0.5;
  options.illumination_direction_deg = 0;
  const Image image = take(kCamera, {}, options).image;
  EXPECT_NEAR(image.row(10)[0], 75, 1);
  EXPECT_NEAR(image.row(10)[160], 100, 1);
  EXPECT_NEAR(image.row(200)[319], 125, 1);
}

TEST(Photograph, BackgroundsAreAsRequested) {
  PhotographOptions options = quiet();
  options.background_level_dn = 120;
  options.background_contrast_dn = 50;
  const auto range = [&](const char* background) {
    options.background = background;
    const Image image = take(kCamera, {}, options).image;
    const auto [low, high] = std::minmax_element(image.row(0), image.row(239) + 320);
    return std::pair{int{*low}, int{*high}};
  };
  EXPECT_EQ(range("flat"), (std::pair{120, 120}));
  EXPECT_EQ(range("gradient"), (std::pair{70, 170}));
  const auto [low, high] = range("clutter");
  EXPECT_GE(low, 70);
  EXPECT_LE(high, 170);
  EXPECT_GT(high - low, 40);
}

TEST(Photograph, VisibleFractionAccountsForImageBorderAndOcclusion) {
  const TagInScene half_out{{FamilyId::Tag36h11, 1}, facing(-0.4, 0, 1), 0.1};  // the centre is at x = 0
  const TagInScene away{
      {FamilyId::Tag36h11, 2}, {SO3::from_rpy(0, std::numbers::pi, 0), Vector3d(0.2, 0, 1)}, 0.1};
  const TagInScene covered{{FamilyId::Tag36h11, 3}, facing(0, 0, 2), 0.1};
  const TagInScene cover{{FamilyId::Tag36h11, 4}, facing(0, 0, 1), 0.1};
  const TagInScene behind{{FamilyId::Tag36h11, 5}, facing(0, 0, -1), 0.1};
  const Photograph photo =
      take(kCamera, {.tags = {half_out, away, covered, cover, behind}, .sheets = {}}, quiet());
  ASSERT_EQ(photo.tags.size(), 4U);  // the tag behind the camera has no corners
  EXPECT_NEAR(photo.tags[0].visible_fraction, 0.5, 0.02);
  EXPECT_EQ(photo.tags[1].visible_fraction, 0.0);
  EXPECT_EQ(photo.tags[2].visible_fraction, 0.0);
  EXPECT_EQ(photo.tags[3].visible_fraction, 1.0);
}

TEST(Photograph, InvalidInputIsRejected) {
  const auto expect_error = [](const PhotographScene& scene, const char* key, const char* text,
                               const PhotographOptions& options = {}) {
    Random random(1);
    const auto result = photograph(kCamera, scene, options, random);
    ASSERT_FALSE(result) << text;
    EXPECT_EQ(result.error().code, ErrorCode::InvalidArgument) << text;
    EXPECT_EQ(result.error().place.key, key);
    EXPECT_THAT(to_string(result.error()), HasSubstr(text));
    testing::expect_on_page("simulation", result.error());
  };
  const TagInScene good{{FamilyId::Tag36h11, 1}, facing(0, 0, 1), 0.1};
  const auto with = [&](auto change) {
    PhotographScene scene{.tags = {good, good}, .sheets = {}};
    change(scene.tags[1]);
    return scene;
  };
  Random random(1);
  EXPECT_TRUE(photograph(kCamera, {.tags = {good}, .sheets = {}}, {}, random));
  expect_error(with([](TagInScene& t) { t.tag.number = 587; }), "tags[1].tag", "587");
  expect_error(with([](TagInScene& t) { t.tag.number = -1; }), "tags[1].tag", "-1");
  expect_error(with([](TagInScene& t) { t.size_m = 0; }), "tags[1].size_m", "0 m");
  expect_error(with([](TagInScene& t) { t.size_m = std::numeric_limits<double>::quiet_NaN(); }),
               "tags[1].size_m", "nan");
  expect_error(with([](TagInScene& t) { t.margin_cells = -1; }), "tags[1].margin_cells", "-1");
  expect_error(with([](TagInScene& t) {
                 t.cam_T_tag = SE3(SO3(), {0, std::numeric_limits<double>::infinity(), 1});
               }),
               "tags[1].cam_T_tag", "pose");
  expect_error({.tags = {}, .sheets = {{Image(), 0.001, facing(0, 0, 1)}}}, "sheets[0].raster", "pixels");
  expect_error({.tags = {}, .sheets = {{Image(2, 2), -1, facing(0, 0, 1)}}}, "sheets[0].metres_per_pixel",
               "-1 m");
  expect_error({}, "background", "'clutter'", {.background = "cluter"});
  expect_error({}, "blur_sigma_px", "-1", {.blur_sigma_px = -1});
}

}  // namespace
}  // namespace waymark
