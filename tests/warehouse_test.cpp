// A corner of a generated warehouse is mapped whole, and knows how well; benchmarks/warehouse_mapping.cpp
// measures the large one.
#include <cstdlib>

#include <gtest/gtest.h>

#include "tests/support/warehouse.hpp"
#include "waymark/mapping/map_checks.hpp"

namespace waymark {
namespace {

TEST(Warehouse, IsMappedWholeAndKnowsHowWell) {
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  const test::Warehouse house = test::drive_warehouse(
      {.tags = full ? 400 : 60, .aisle_m = full ? 35.0 : 8.0, .frame_m = full ? 0.035 : 0.1});
  const auto map = map_by_bundle(house.lap);
  ASSERT_TRUE(map) << to_string(map.error());
  ASSERT_EQ(map->map.tags.size(), house.truth.tags.size());
  EXPECT_EQ(map->frames_without_pose, 0);
  EXPECT_NEAR(map->noise_ratio, 1, 0.05);
  double chi2 = 0;
  int inside = 0;
  int count = 0;
  for (const auto& [id, tag] : map->map.tags) {
    if (!tag.covariance) continue;
    const Vector6 off = minus(tag.map_T_tag, house.truth.tags.at(id).map_T_tag);
    const double nees = off.dot(tag.covariance->llt().solve(off));
    chi2 += nees;
    inside += nees < 22.5 ? 1 : 0;
    ++count;
  }
  std::printf("%zu detections; NEES %.2f of 6\n", house.detections, chi2 / count);
  EXPECT_GT(static_cast<double>(inside) / count, 0.95);
  EXPECT_LT(chi2 / count, 12.0) << "errors of neighbours are shared: this is one draw, not many";
}

}  // namespace
}  // namespace waymark
