// Tests the errors for missing and invalid files.
#include "waymark/sdf/read_sdf.hpp"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

TEST(ReadSdf, ReportsInvalidFilesBeforeLoadingTheModule) {
  const auto missing = read_sdf("/nowhere/world.sdf");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_EQ(missing.error().place.source, "/nowhere/world.sdf");
  const fs::path folder = testing::fresh_folder("read_sdf");
  const auto no_file = read_sdf(folder);
  ASSERT_FALSE(no_file);
  testing::expect_on_page("world", no_file.error());
  std::ofstream(folder / "large.sdf") << "x";
  fs::resize_file(folder / "large.sdf", (64U << 20U) + 1U);  // a sparse file
  const auto large = read_sdf(folder / "large.sdf");
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().code, ErrorCode::LimitExceeded);
}

}  // namespace
}  // namespace waymark
