#include "waymark/config/share.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

TEST(Share, FindsNamesAndPaths) {
  const auto folder = testing::fresh_folder("share");
  std::filesystem::create_directories(folder / "worlds");
  std::ofstream(folder / "worlds/garden.yaml") << "name: garden\n";
  ASSERT_EQ(setenv("WAYMARK_SHARE", folder.c_str(), 1), 0);
  EXPECT_EQ(*find_shared("worlds", "garden"), folder / "worlds/garden.yaml");
  EXPECT_EQ(*find_shared("worlds", "./garden"), "./garden");
  EXPECT_EQ(*find_shared("worlds", "my.yaml"), "my.yaml");
  const Error unknown = find_shared("worlds", "gardn").error();
  EXPECT_EQ(unknown.place.key, "world");
  EXPECT_NE(to_string(unknown).find("'garden'"), std::string::npos);
  testing::expect_on_page("config", unknown);
  EXPECT_EQ(find_shared("worlds", "gardn", "place").error().place.key, "place");
  std::filesystem::create_directories(folder / "place");
  std::ofstream(folder / "place/world.yaml") << "name: place\n";
  EXPECT_NE(to_string(find_shared("worlds", (folder / "place").string()).error())
                .find((folder / "place/world.yaml").string() + "?"),
            std::string::npos);
  testing::expect_on_page("config", find_shared("worlds", (folder / "worlds").string()).error());
  EXPECT_FALSE(find_shared("robots", "limo"));
  ASSERT_EQ(setenv("WAYMARK_SHARE", "/nowhere", 1), 0);
  EXPECT_EQ(share_folder().error().place.source, "/nowhere");
  testing::expect_on_page("config", share_folder().error());
  ASSERT_EQ(unsetenv("WAYMARK_SHARE"), 0);
  EXPECT_TRUE(std::filesystem::exists(*find_shared("robots", "limo"))) << "in the source tree";
}

}  // namespace
}  // namespace waymark
