#include "waymark/tags/refinement/inner_bits.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/support/facing_tag.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

using testing::corners_of;
using testing::detection_at;
using testing::Print;
using testing::render;
using testing::worst_error;

/// Changes each grey level to `of(level, x, y)`, limited to [0, 255].
template <class Change>
void change(Image& image, const Change& of) {
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      std::uint8_t& pixel = image.row(y)[x];
      pixel = static_cast<std::uint8_t>(std::clamp(std::lround(of(pixel, x, y)), 0L, 255L));
    }
  }
}

double encoded(double level) { return 255 * std::pow(level / 255, 1 / 2.2); }

Print print_of(FamilyId id) {
  Print print;
  print.tag = {id, 3};
  print.roll_rad = 0.2;
  print.side_px = 6.5 * family(id).width_at_border;
  print.black = 20;
  print.noise = 1;
  return print;
}

/// Without the correction, the corners would be 0.35 px too far inside.
TEST(InnerCorrection, UndoesGammaInEveryFamily) {
  Random random(4);
  for (const FamilyId id : kAllFamilies) {
    if (id == FamilyId::TagCustom48h12)
      continue;  // its middle is free, so no bit has neighbours with known colours
    const Print print = print_of(id);
    Image image = render(print);
    change(image, [](double level, int, int) { return encoded(level); });
    const auto result = refine_corners(image, detection_at(print, 0.1, random));
    ASSERT_TRUE(result.refined()) << to_string(id) << " " << to_string(result.outcome);
    EXPECT_LT(worst_error(result.corners_px, print), 0.07) << to_string(id);
    EXPECT_LT(testing::nees(result.corners_px, result.covariance_px2, print), 24)
        << to_string(id);  // the expected value is 8
  }
}

TEST(InnerCorrection, UndoesAddedIllumination) {
  Random random(5);
  for (const FamilyId id : {FamilyId::Tag36h11, FamilyId::Tag25h9}) {
    for (const double roll_rad : {0.2, 1.8, 3.3, 5.0}) {
      Print print = print_of(id);
      print.roll_rad = roll_rad;
      Image image = render(print);
      const double per_px = 20 / print.side_px;
      change(image, [&](double level, int x, int) { return level + per_px * (x - print.center_px.x()); });
      const auto result = refine_corners(image, detection_at(print, 0.1, random));
      ASSERT_TRUE(result.refined()) << to_string(id) << " " << to_string(result.outcome);
      EXPECT_LT(worst_error(result.corners_px, print), 0.05) << to_string(id) << " " << roll_rad;
    }
  }
}

}  // namespace
}  // namespace waymark
