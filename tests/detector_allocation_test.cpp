// After the first image, the project's own detector allocates no memory. A separate program, because it
// counts every allocation.
#include <atomic>
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/tags/detector/tag_search.hpp"
#include "waymark/tags/detector/waymark_detector.hpp"

namespace {

std::atomic<long> allocations = 0;

void* counted(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace waymark {
namespace {

Image scene(std::uint64_t seed, bool with_tags) {
  Image image(640, 480, 140);
  Random random(seed);
  for (int i = 0; with_tags && i < 5; ++i)
    testing::paint_tag(image, {FamilyId::Tag36h11, i},
                       testing::square_corners({80.0 + 110 * i, 200}, 60, 0.3 * i));
  testing::add_noise(image, 6, random);
  return image;
}

TEST(Allocation, NoneAfterTheFirstImage) {
  const std::vector<search::ReadableFamily> families = {{family(FamilyId::Tag36h11), 2}};
  search::TagSearch search({});
  const Image image = scene(1, true);
  ASSERT_EQ(search.run(image, families).size(), 5U);
  const long before = allocations;
  ASSERT_EQ(search.run(image, families).size(), 5U);
  EXPECT_EQ(allocations, before);
}

TEST(Allocation, NoneForAnImageWithoutTags) {
  const auto detector = make_waymark_detector().value();
  const Image image = scene(2, false);
  ASSERT_TRUE(detector->detect(image)->empty());
  const long before = allocations;
  ASSERT_TRUE(detector->detect(image)->empty());
  EXPECT_EQ(allocations, before);
}

TEST(Allocation, TheCounterWorks) {
  const long before = allocations;
  const auto memory = std::make_unique<int>(1);
  EXPECT_GT(allocations, before);
}

}  // namespace
}  // namespace waymark
