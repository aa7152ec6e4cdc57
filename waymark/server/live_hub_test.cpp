#include "waymark/server/live_hub.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

OutFrame data(std::size_t size, std::optional<std::uint32_t> newest_of = {}) {
  return {.head = "h", .body = std::make_shared<const Bytes>(size), .newest_of = newest_of};
}

TEST(Outbox, DropsAndCountsTheOldest) {
  Outbox box;
  for (std::size_t i = 0; i < Outbox::kMaxFrames + 10; ++i) EXPECT_TRUE(box.put(data(i)));
  EXPECT_EQ(box.dropped(), 10u);
  EXPECT_EQ(box.next()->body->size(), 10u);
}

TEST(Outbox, BytesAreBounded) {
  Outbox box;
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(box.put(data(1 << 20)));
    EXPECT_LE(box.bytes(), Outbox::kMaxBytes);
  }
  while (box.next()) {
  }
  EXPECT_EQ(box.bytes(), 0u);
  EXPECT_TRUE(box.put(data(Outbox::kMaxBytes + 1)));  // too large on its own, so it is dropped
  EXPECT_TRUE(box.empty());
}

TEST(Outbox, KeepsTheNewestImage) {
  Outbox box;
  EXPECT_TRUE(box.put(data(1, 5)));
  EXPECT_TRUE(box.put(data(2)));
  EXPECT_TRUE(box.put(data(3, 5)));
  EXPECT_EQ(box.next()->body->size(), 2u);
  EXPECT_EQ(box.next()->body->size(), 3u);
  EXPECT_TRUE(box.empty());
  EXPECT_EQ(box.dropped(), 1u);
}

TEST(Outbox, KeepsFramesThatMustArrive) {
  Outbox box;
  const OutFrame word{.text = true, .head = "word", .must_arrive = true};
  for (std::size_t i = 0; i < Outbox::kMaxFrames; ++i) EXPECT_TRUE(box.put(word));
  EXPECT_TRUE(box.put(data(1)));  // dropped immediately
  EXPECT_EQ(box.dropped(), 1u);
  EXPECT_FALSE(box.put(word));
}

using Json = nlohmann::json;
using Control = LiveFeed::Control;

constexpr const char* kGo = R"({"op":"order","order":"go"})";
constexpr const char* kRelease = R"({"op":"release"})";

class Hub : public ::testing::Test {
 protected:
  LiveHub::Id join(std::string_view protocol, bool may_command = true) {
    return hub_.join(protocol, may_command, now_).value();
  }
  void send(LiveHub::Id id, std::string_view text) { hub_.receive_text(id, text, now_); }
  void pass(double seconds) {
    now_ += Duration(static_cast<std::int64_t>(seconds * 1e9));
    hub_.tick(now_);
  }
  /// Everything sent to a viewer since the last call: parsed texts and binary frames.
  struct Output {
    std::vector<Json> texts;
    std::vector<OutFrame> messages;
    [[nodiscard]] std::vector<Json> of(const std::string& op) const {
      std::vector<Json> found;
      std::ranges::copy_if(texts, std::back_inserter(found), [&](const Json& t) { return t["op"] == op; });
      return found;
    }
  };
  Output output_of(LiveHub::Id id) {
    Output out;
    while (auto frame = hub_.next(id)) {
      if (frame->text)
        out.texts.push_back(Json::parse(frame->head));
      else
        out.messages.push_back(std::move(*frame));
    }
    return out;
  }
  void odometry(double x) {
    feed_.publish(Sample(Odometry{.stamp = SensorTime(now_), .odom_T_base = SE2(x, 0, 0)}), now_.count());
  }
  std::uint32_t channel_of(const Output& received, const std::string& topic) {
    for (const Json& message : received.of("advertise")) {
      for (const Json& channel : message["channels"]) {
        if (channel["topic"] == topic) return channel["id"];
      }
    }
    ADD_FAILURE() << topic << " was not advertised";
    return 0;
  }
  static std::string subscription(std::uint32_t channel) {
    return Json{{"op", "subscribe"}, {"subscriptions", {{{"id", 9}, {"channelId", channel}}}}}.dump();
  }

  LiveFeed feed_;
  LiveHub hub_{feed_, "limo"};
  Duration now_ = std::chrono::seconds(1000);
};

TEST(Protocol, ChoosesTheFirstSupportedOne) {
  EXPECT_EQ(choose_protocol("foxglove.sdk.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(choose_protocol("x, foxglove.websocket.v1 ,waymark.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(choose_protocol("waymark.v1"), kPageProtocol);
  EXPECT_EQ(choose_protocol(""), "");
  EXPECT_EQ(choose_protocol(",,"), "");
}

TEST_F(Hub, FoxgloveReceivesItsSubscriptions) {
  const auto id = join("foxglove.sdk.v1");
  const Json info = output_of(id).of("serverInfo").at(0);
  EXPECT_EQ(info["name"], "limo");
  EXPECT_EQ(info["capabilities"], Json::array({"clientPublish"}));
  odometry(1);
  pass(0.01);
  const Output first = output_of(id);
  EXPECT_TRUE(first.messages.empty());  // there is no subscription yet
  const std::uint32_t odom = channel_of(first, "/odom");
  send(id, subscription(odom));
  odometry(2);
  pass(0.01);
  const Output then = output_of(id);
  ASSERT_EQ(then.messages.size(), 1u);
  const OutFrame& frame = then.messages[0];
  EXPECT_EQ(frame.head.size(), 13u);
  EXPECT_EQ(frame.head[0], '\x01');
  EXPECT_EQ(frame.head[1], '\x09');
  EXPECT_GT(frame.body->size(), 100u);
  send(id, R"({"op":"unsubscribe","subscriptionIds":[9]})");
  odometry(3);
  pass(0.01);
  EXPECT_TRUE(output_of(id).messages.empty());
}

TEST_F(Hub, LaterViewersReceiveLatchedMessages) {
  feed_.set_status({.phase = "ready"});
  feed_.show_text("map.yaml", "tags: []");
  pass(0.01);
  const auto id = join(kPageProtocol);
  const Output received = output_of(id);
  EXPECT_EQ(received.of("text").at(0)["text"], "tags: []");
  send(id, subscription(channel_of(received, "/waymark/state")));
  const Output then = output_of(id);
  ASSERT_EQ(then.messages.size(), 1u);
  const Bytes& body = *then.messages[0].body;
  EXPECT_EQ(Json::parse(body.begin(), body.end())["phase"], "ready");
}

TEST_F(Hub, MapMarkersAreLatchedAndSentAgainOnChange) {
  const auto shapes = [](std::size_t count) {
    ros2::MarkerArray array;
    array.markers.resize(count);
    return array;
  };
  feed_.show_shapes(shapes(1));
  pass(0.01);
  const auto id = join("foxglove.sdk.v1");
  send(id, subscription(channel_of(output_of(id), "/waymark/map")));
  const Output first = output_of(id);
  ASSERT_EQ(first.messages.size(), 1u);
  pass(0.01);
  EXPECT_TRUE(output_of(id).messages.empty());  // the map is unchanged
  feed_.show_shapes(shapes(3));
  pass(0.01);
  const Output then = output_of(id);
  ASSERT_EQ(then.messages.size(), 1u);
  EXPECT_GT(then.messages[0].body->size(), first.messages[0].body->size());
}

TEST_F(Hub, ComparisonsAreSentToSubscribers) {
  const auto id = join(kPageProtocol);
  ros2::DiagnosticArray compared;
  compared.status.push_back({.level = 0, .name = "tag36h11:7", .values = {{"nis", "1.5"}}});
  feed_.publish(compared, now_.count());
  pass(0.01);
  send(id, subscription(channel_of(output_of(id), "/waymark/nis")));
  feed_.publish(compared, now_.count());
  pass(0.01);
  const Output received = output_of(id);
  ASSERT_EQ(received.messages.size(), 1u);
  const Bytes& body = *received.messages[0].body;
  EXPECT_NE(std::string(body.begin(), body.end()).find("tag36h11:7"), std::string::npos);
}

TEST_F(Hub, WithoutTheTokenAViewerMayOnlyWatchAndStop) {
  const auto page = join(kPageProtocol, false);
  const auto studio = join("foxglove.websocket.v1", false);
  EXPECT_EQ(output_of(studio).of("serverInfo").at(0)["capabilities"], Json::array({"clientPublish"}));
  output_of(page);
  send(page, kGo);
  send(page, R"({"op":"drive","speed_m_s":1,"yaw_rate_rad_s":0})");
  send(studio, R"({"op":"advertise","channels":[{"id":1,"topic":"/cmd_vel","encoding":"json"}]})");
  const std::string twist =
      std::string("\x01\x01\x00\x00\x00", 5) + R"({"linear":{"x":1},"angular":{"z":0}})";
  hub_.receive_binary(studio, {reinterpret_cast<const std::uint8_t*>(twist.data()), twist.size()}, now_);
  EXPECT_TRUE(feed_.take_orders().empty());
  EXPECT_EQ(feed_.control(), Control::None);
  EXPECT_EQ(output_of(page).of("status").size(), 2u);
  EXPECT_EQ(output_of(studio).of("status").size(), 2u);
}

TEST_F(Hub, OnlyOneViewerHoldsControl) {
  const auto first = join(kPageProtocol);
  const auto second = join(kPageProtocol);
  send(first, kGo);
  EXPECT_EQ(feed_.take_orders().size(), 1u);
  EXPECT_EQ(feed_.control(), Control::Held);
  send(second, kGo);
  send(second, R"({"op":"take"})");
  EXPECT_TRUE(feed_.take_orders().empty());
  pass(0.01);
  EXPECT_EQ(output_of(second).of("control").back()["yours"], false);
  EXPECT_EQ(output_of(first).of("control").back()["yours"], true);
  send(second, kRelease);  // this viewer is not in control
  EXPECT_EQ(feed_.control(), Control::Held);
  send(first, kRelease);
  EXPECT_EQ(feed_.control(), Control::None);
  send(second, kGo);
  EXPECT_EQ(feed_.take_orders().size(), 1u);
}

TEST_F(Hub, TheRobotIsNotifiedWhenItsViewerDisconnects) {
  const auto id = join(kPageProtocol);
  const auto watcher = join(kPageProtocol);
  send(id, kGo);
  hub_.leave(watcher);
  EXPECT_EQ(feed_.control(), Control::Held);
  hub_.leave(id);
  EXPECT_EQ(feed_.control(), Control::Lost);
}

TEST_F(Hub, ASilentHolderLosesControl) {
  const auto id = join(kPageProtocol);
  send(id, kGo);
  for (int i = 0; i < 10; ++i) {
    pass(0.5);
    send(id, R"({"op":"alive"})");
  }
  EXPECT_EQ(feed_.control(), Control::Held);
  pass(2.9);
  EXPECT_EQ(feed_.control(), Control::Held);
  pass(0.2);
  EXPECT_EQ(feed_.control(), Control::Lost);
  send(id, kGo);  // this viewer sends again
  EXPECT_EQ(feed_.control(), Control::Held);
}

TEST_F(Hub, FoxglovePublishesWithTheToken) {
  const auto id = join("foxglove.sdk.v1");
  send(id, R"({"op":"advertise","channels":[{"id":1,"topic":"/waymark/order","encoding":"json"}]})");
  const std::string stop = std::string("\x01\x01\x00\x00\x00", 5) + R"({"data":"stop"})";
  hub_.receive_binary(id, {reinterpret_cast<const std::uint8_t*>(stop.data()), stop.size()}, now_);
  const auto orders = feed_.take_orders();
  ASSERT_EQ(orders.size(), 1u);
  EXPECT_EQ(orders[0].kind, ViewerOrder::Kind::Stop);
  send(id, R"({"op":"unadvertise","channelIds":[1]})");
  EXPECT_EQ(feed_.control(), Control::None);
}

TEST_F(Hub, EveryViewerCanStopTheRobot) {
  const auto holder = join(kPageProtocol);
  const auto second = join(kPageProtocol);
  const auto watcher = join(kPageProtocol, false);
  const auto studio = join("foxglove.sdk.v1", false);
  send(holder, kGo);
  (void)feed_.take_orders();
  const auto stops = [&] {
    const auto orders = feed_.take_orders();
    return orders.size() == 1 && orders[0].kind == ViewerOrder::Kind::Stop;
  };
  for (const auto id : {second, watcher}) {
    send(id, R"({"op":"order","order":"stop"})");
    EXPECT_TRUE(stops());
  }
  send(studio, R"({"op":"advertise","channels":[{"id":1,"topic":"/waymark/order","encoding":"json"}]})");
  for (const std::string word : {"stop", "go", "quit", "script", "teach"}) {
    const std::string bytes = std::string("\x01\x01\x00\x00\x00", 5) + R"({"data":")" + word + "\"}";
    hub_.receive_binary(studio, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, now_);
    EXPECT_EQ(stops(), word == "stop") << word;
  }
  EXPECT_EQ(hub_.holder(), holder) << "sending a stop does not take control";
}

TEST_F(Hub, ASilentFoxgloveLosesControlWithAnOpenSocket) {
  const auto id = join("foxglove.sdk.v1");
  send(id, R"({"op":"advertise","channels":[{"id":1,"topic":"/cmd_vel","encoding":"json"}]})");
  const std::string twist =
      std::string("\x01\x01\x00\x00\x00", 5) + R"({"linear":{"x":0.3},"angular":{"z":0}})";
  for (int i = 0; i < 10; ++i) {
    hub_.receive_binary(id, {reinterpret_cast<const std::uint8_t*>(twist.data()), twist.size()}, now_);
    pass(0.5);
  }
  EXPECT_EQ(feed_.control(), Control::Held) << "publishing is enough to keep control";
  pass(2.4);
  EXPECT_EQ(feed_.control(), Control::Held);
  pass(0.2);
  EXPECT_EQ(feed_.control(), Control::Lost);
}

TEST_F(Hub, ViewersWithoutTheTokenLeaveRoomForOwners) {
  for (std::size_t i = 0; i < LiveHub::kMaxWatchers; ++i) join(kPageProtocol, false);
  EXPECT_FALSE(hub_.join(kPageProtocol, false, now_));
  for (std::size_t i = LiveHub::kMaxWatchers; i < LiveHub::kMaxClients; ++i) join(kPageProtocol, true);
  EXPECT_FALSE(hub_.join(kPageProtocol, true, now_));
}

TEST_F(Hub, AViewerThatNeverReadsDoesNotAffectOthers) {
  const auto lazy = join("foxglove.sdk.v1");
  const auto keen = join("foxglove.sdk.v1");
  odometry(0);
  pass(0.01);
  const std::uint32_t odom = channel_of(output_of(keen), "/odom");
  send(lazy, subscription(odom));
  send(keen, subscription(odom));
  std::size_t got = 0;
  for (int i = 0; i < 2000; ++i) {
    odometry(i);
    pass(0.01);
    got += output_of(keen).messages.size();
  }
  EXPECT_EQ(got, 2000u);
  EXPECT_LE(output_of(lazy).messages.size(), Outbox::kMaxFrames);
  EXPECT_FALSE(hub_.lost(lazy));
}

TEST_F(Hub, InvalidMessagesAreAnsweredAndBounded) {
  const auto id = join(kPageProtocol);
  for (int i = 0; i < 5000; ++i) {
    send(id, "nonsense");
    hub_.receive_binary(id, {}, now_);
  }
  EXPECT_LE(output_of(id).texts.size(), Outbox::kMaxFrames);
  EXPECT_FALSE(hub_.lost(id));
  send(4711, kGo);  // a viewer that does not exist
  EXPECT_TRUE(feed_.take_orders().empty());
}

TEST_F(Hub, RejectsViewersAboveTheLimit) {
  for (std::size_t i = 0; i < LiveHub::kMaxClients; ++i) join(kPageProtocol);
  EXPECT_FALSE(hub_.join(kPageProtocol, true, now_));
}

TEST_F(Hub, LightsHaveTexts) {
  const auto id = join(kPageProtocol);
  feed_.set_status({.phase = "replaying", .certain = false, .halted = "obstacle ahead"});
  for (int i = 0; i < 50; ++i) {
    odometry(i);
    pass(0.02);
  }
  send(id, subscription(channel_of(output_of(id), "/waymark/state")));
  const Output last = output_of(id);
  const Bytes& body = *last.messages.at(0).body;
  const Json state = Json::parse(body.begin(), body.end());
  const auto light = [&](const std::string& name) {
    for (const Json& one : state["lights"]) {
      if (one["name"] == name) return one;
    }
    return Json();
  };
  EXPECT_EQ(light("odometry")["level"], "good");
  EXPECT_EQ(light("odometry")["message"], "50 per second");
  EXPECT_EQ(light("camera")["level"], "unknown");
  EXPECT_EQ(light("localisation")["level"], "uncertain");
  EXPECT_EQ(light("drive")["message"], "obstacle ahead");
}

}  // namespace
}  // namespace waymark
