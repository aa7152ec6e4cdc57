#include "waymark/modules/arrival_queue.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

struct Numbered {
  std::size_t subscription = 0;
  int number = 0;
};

constexpr Duration kNoWait{0};

std::vector<Numbered> take_all(ArrivalQueue<Numbered>& queue) {
  std::vector<Numbered> all;
  while (auto message = queue.take(kNoWait)) all.push_back(*message);
  return all;
}

TEST(ArrivalQueue, KeepsTheNewestOfEachSubscriptionInOrderOfArrival) {
  Random random(20261124);
  for (int trial = 0; trial < 20; ++trial) {
    ArrivalQueue<Numbered> queue;
    const std::vector<int> depths = {1, 3, 10};
    for (const int depth : depths) (void)queue.add(depth);
    std::vector<std::uint64_t> pushed(depths.size());
    for (int number = 0; number < 60; ++number) {
      const auto from = static_cast<std::size_t>(random.uniform(0, 2.999));
      queue.push({from, number});
      ++pushed[from];
    }
    const auto taken = take_all(queue);
    EXPECT_TRUE(std::ranges::is_sorted(taken, {}, &Numbered::number));
    for (std::size_t i = 0; i < depths.size(); ++i) {
      const auto count = static_cast<std::uint64_t>(std::ranges::count(taken, i, &Numbered::subscription));
      EXPECT_EQ(count, std::min<std::uint64_t>(pushed[i], static_cast<std::uint64_t>(depths[i])));
      EXPECT_EQ(count + queue.dropped(i), pushed[i]) << "every dropped message is counted";
    }
  }
}

TEST(ArrivalQueue, ABusySubscriptionDoesNotDisplaceOthers) {
  ArrivalQueue<Numbered> queue;
  const std::size_t rare = queue.add(1);
  const std::size_t busy = queue.add(2);
  queue.push({rare, 7});
  for (int i = 0; i < 1000; ++i) queue.push({busy, i});
  const auto taken = take_all(queue);
  ASSERT_EQ(taken.size(), 3U);
  EXPECT_EQ(taken[0].number, 7);
  EXPECT_EQ(taken[1].number, 998);
  EXPECT_EQ(queue.dropped(rare), 0U);
  EXPECT_EQ(queue.dropped(busy), 998U);
}

TEST(ArrivalQueue, ADepthOfZeroIsOne) {
  ArrivalQueue<Numbered> queue;
  const std::size_t only = queue.add(0);
  EXPECT_TRUE(queue.empty());
  EXPECT_FALSE(queue.take(kNoWait));
  queue.push({only, 1});
  EXPECT_FALSE(queue.empty());
  EXPECT_EQ(queue.take(kNoWait)->number, 1);
  EXPECT_TRUE(queue.empty());
}

TEST(ArrivalQueue, ThreadsPushWhileAnotherTakes) {
  ArrivalQueue<Numbered> queue;
  constexpr int kEach = 2000;
  std::vector<std::thread> network;
  for (int i = 0; i < 3; ++i) {
    const std::size_t from = queue.add(kEach);
    network.emplace_back([&queue, from] {
      for (int number = 0; number < kEach; ++number) queue.push({from, number});
    });
  }
  std::vector<int> next(3);
  for (int i = 0; i < 3 * kEach; ++i) {
    const auto message = queue.take(std::chrono::seconds(10));
    ASSERT_TRUE(message);
    EXPECT_EQ(message->number, next[message->subscription]++);
  }
  for (std::thread& thread : network) thread.join();
}

}  // namespace
}  // namespace waymark
