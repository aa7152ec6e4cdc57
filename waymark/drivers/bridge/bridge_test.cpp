#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "waymark/drivers/bridge/picture_ring.hpp"

namespace waymark {
namespace {

TEST(PictureRing, HoldsTheLastTenPicturesAndLeavesNothing) {
  std::filesystem::path folder;
  {
    auto ring = PictureRing::make();
    ASSERT_TRUE(ring);
    folder = ring->folder();
    std::vector<std::string> paths;
    for (std::uint8_t i = 0; i < 25; ++i)
      paths.push_back(ring->put(std::vector<std::uint8_t>(1000, i)).value());
    for (std::size_t i = 15; i < 25; ++i) {
      std::ifstream file(paths[i], std::ios::binary);
      const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
      EXPECT_EQ(bytes, std::string(1000, static_cast<char>(i)));
    }
    EXPECT_EQ(paths[5], paths[15]);
  }
  EXPECT_FALSE(std::filesystem::exists(folder));
}

}  // namespace
}  // namespace waymark
