// Tests that the order contains each unknown once, and that poses of a long drive past the same tags are
// coupled to few of them.
#include "waymark/mapping/solver/elimination_order.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/mapping/solver/front_cholesky.hpp"

namespace waymark::internal {
namespace {

using Couplings = std::vector<std::pair<int, int>>;

/// A drive past `tags` tags again and again. Each pose is coupled to the next one, to two tags, and to a
/// scale that all poses share. The tags and the scale are the last unknowns.
Couplings drive(int poses, int tags) {
  constexpr int kPosesPerTag = 8;
  Couplings couplings;
  for (int i = 0; i < poses; ++i) {
    if (i + 1 < poses) couplings.emplace_back(i, i + 1);
    const int first = i / kPosesPerTag % tags;
    couplings.emplace_back(i, poses + first);
    couplings.emplace_back(i, poses + (first + 1) % tags);
    couplings.emplace_back(i, poses + tags);
  }
  return couplings;
}

bool has_each_once(std::vector<int> order, int unknowns) {
  std::ranges::sort(order);
  if (std::ssize(order) != unknowns) return false;
  for (int i = 0; i < unknowns; ++i) {
    if (order[static_cast<std::size_t>(i)] != i) return false;
  }
  return true;
}

/// Mean number of entries in a column of the factor.
double mean_column(int poses, int tags) {
  const int unknowns = poses + tags + 1;
  const BlockSystem system(std::vector<int>(static_cast<std::size_t>(unknowns), 1), drive(poses, tags));
  double entries = 0;
  for (const FrontPlan::Front& front : front_plan(system).fronts)
    entries += static_cast<double>(front.own_size) * static_cast<double>(front.size);
  return entries / unknowns;
}

TEST(EliminationOrder, ContainsEachUnknownOnce) {
  EXPECT_TRUE(has_each_once(elimination_order(3, {}), 3));
  for (const auto& [poses, tags] : {std::pair(5, 2), std::pair(500, 24), std::pair(5000, 4)})
    EXPECT_TRUE(has_each_once(elimination_order(poses + tags + 1, drive(poses, tags)), poses + tags + 1));
  Couplings ring = drive(3000, 2);
  ring.emplace_back(0, 2999);
  EXPECT_TRUE(has_each_once(elimination_order(3003, ring), 3003));
}

TEST(EliminationOrder, PutsTagsThatAllPosesShareLast) {
  const std::vector<int> order = elimination_order(5005, drive(5000, 4));
  EXPECT_TRUE(std::all_of(order.end() - 5, order.end(), [](int i) { return i >= 5000; }));
}

TEST(EliminationOrder, CouplesPosesOfALongDriveToFewTags) {
  // Eliminated from one end to the other, each pose would be coupled to all 20 tags.
  const double of_short_drive = mean_column(12'000, 20);
  EXPECT_LT(of_short_drive, 12);
  EXPECT_LT(mean_column(36'000, 20), 1.1 * of_short_drive);
}

}  // namespace
}  // namespace waymark::internal
