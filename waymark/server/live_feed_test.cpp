#include "waymark/server/live_feed.hpp"

#include <atomic>
#include <thread>

#include <gtest/gtest.h>

namespace waymark {
namespace {

Sample odometry_at(std::int64_t ns) { return Odometry{.stamp = SensorTime(Duration(ns))}; }

TEST(LiveFeed, KeepsNoSamplesWithoutViewers) {
  LiveFeed feed;
  feed.publish(odometry_at(1), 1);
  feed.set_listening(true);
  EXPECT_TRUE(feed.take().samples.empty());
  feed.publish(odometry_at(2), 2);
  const auto updates = feed.take();
  ASSERT_EQ(updates.samples.size(), 1u);
  EXPECT_EQ(updates.samples[0].host_ns, 2);
}

TEST(LiveFeed, StateAndTextsAreKeptForLaterViewers) {
  LiveFeed feed;
  feed.set_status({.phase = "ready"});
  feed.show_text("map.yaml", "tags: []");
  EXPECT_EQ(feed.take().status.phase, "ready");
  EXPECT_EQ(feed.take().texts->by_name.at("map.yaml"), "tags: []");  // the text is kept
  feed.show_text("map.yaml", "tags: []");
  EXPECT_EQ(feed.take().texts->version, 1u);
}

TEST(LiveFeed, RewritesReasonsForUsers) {
  LiveFeed feed;
  feed.set_for_users([](std::string_view text) { return "<" + std::string(text) + ">"; });
  feed.set_status({.phase = "paused", .reason = "a", .halted = "b"});
  const LiveStatus status = feed.take().status;
  EXPECT_EQ(status.phase, "paused");
  EXPECT_EQ(status.reason, "<a>");
  EXPECT_EQ(status.halted, "<b>");
}

TEST(LiveFeed, MemoryIsBoundedWithoutAServer) {
  LiveFeed feed;
  feed.set_listening(true);
  for (int i = 0; i < 5000; ++i) feed.publish(odometry_at(i), i);
  EXPECT_EQ(feed.take().samples.size(), LiveFeed::kMaxWaiting);
  EXPECT_EQ(feed.dropped(), 5000 - LiveFeed::kMaxWaiting);
}

TEST(LiveFeed, ReusesTheMemoryOfReturnedImages) {
  LiveFeed feed;
  feed.set_listening(true);
  const auto image_of = [](std::uint8_t grey) {
    CameraFrame frame{.image = Image(64, 48)};
    frame.image.row(47)[63] = grey;
    return frame;
  };
  const auto taken = [&] { return std::get<CameraFrame>(std::get<Sample>(feed.take().samples.at(0).value)); };
  const std::uint8_t* place = nullptr;
  for (std::uint8_t grey = 1; grey < 10; ++grey) {
    feed.publish(Sample(image_of(grey)), grey);
    LiveFeed::Updates updates = feed.take();
    ASSERT_EQ(updates.samples.size(), 1u);
    auto& frame = std::get<CameraFrame>(std::get<Sample>(updates.samples[0].value));
    EXPECT_EQ(frame.image.row(47)[63], grey);
    if (place != nullptr) {
      EXPECT_EQ(frame.image.row(0), place);  // the memory is reused
    }
    place = frame.image.row(0);
    feed.give_back(std::move(frame));
    feed.publish(odometry_at(grey), grey);  // hands over the queue
    static_cast<void>(feed.take());
  }
  feed.publish(Sample(CameraFrame{.image = Image(8, 4)}), 1);
  EXPECT_EQ(taken().image.width(), 8);  // images with a different size
}

TEST(LiveFeed, OrdersAreBoundedAndAStopIsNeverDropped) {
  LiveFeed feed;
  for (int i = 0; i < 1000; ++i) feed.order({.kind = ViewerOrder::Kind::Velocity});
  feed.order({.kind = ViewerOrder::Kind::Stop});
  const auto orders = feed.take_orders();
  EXPECT_LE(orders.size(), 64u);
  ASSERT_FALSE(orders.empty());
  EXPECT_EQ(orders.back().kind, ViewerOrder::Kind::Stop);
  EXPECT_TRUE(feed.take_orders().empty());
}

/// The robot's side continues while the server holds the lock, and every lost sample is counted.
TEST(LiveFeedThreads, EveryLostSampleIsCounted) {
  constexpr std::int64_t kSamples = 20000;
  std::atomic<int> rings{0};
  LiveFeed feed([&] { ++rings; });
  feed.set_listening(true);
  std::atomic<bool> over{false};
  std::uint64_t received = 0;
  std::int64_t last = -1;
  bool in_order = true;
  const auto listen = [&] {
    for (const LiveSample& sample : feed.take().samples) {
      in_order = in_order && sample.host_ns > last;
      last = sample.host_ns;
      ++received;
    }
  };
  std::thread server([&] {
    while (!over) listen();
  });
  for (std::int64_t i = 0; i < kSamples; ++i) {
    feed.publish(odometry_at(i), i);
    feed.set_status({.phase = i % 2 == 0 ? "a" : "b"});
  }
  over = true;
  server.join();
  feed.publish(odometry_at(kSamples), kSamples);  // hands over the samples that were kept
  listen();
  EXPECT_TRUE(in_order);
  EXPECT_EQ(received + feed.dropped(), static_cast<std::uint64_t>(kSamples) + 1);
  EXPECT_GT(rings, 0);
}

}  // namespace
}  // namespace waymark
