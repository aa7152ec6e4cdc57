#include "waymark/server/live_protocol.hpp"

#include <string>

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(ClientMessage, ParsesMessagesOfFoxglove) {
  const auto wanted = parse_client_text(R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":7}]})");
  ASSERT_TRUE(wanted);
  const auto& list = std::get<ClientSubscribe>(*wanted).wanted;
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].channel, 7u);
  const auto channels = parse_client_text(
      R"({"op":"advertise","channels":[{"id":1,"topic":"/cmd_vel","encoding":"json","schemaName":"x"}]})");
  ASSERT_TRUE(channels);
  EXPECT_EQ(std::get<ClientAdvertise>(*channels).channels.at(0).topic, "/cmd_vel");
  const auto other = parse_client_text(R"({"op":"getParameters","parameterNames":[]})");
  ASSERT_TRUE(other);
  EXPECT_EQ(std::get<ClientUnsupported>(*other).op, "getParameters");
}

TEST(ClientMessage, ParsesMessagesOfThePage) {
  const auto stop = parse_client_text(R"({"op":"order","order":"stop"})");
  ASSERT_TRUE(stop);
  EXPECT_EQ(std::get<ClientOrders>(*stop).order.kind, ViewerOrder::Kind::Stop);
  const auto drive = parse_client_text(R"({"op":"drive","speed_m_s":0.3,"yaw_rate_rad_s":-0.5})");
  ASSERT_TRUE(drive);
  EXPECT_EQ(std::get<ClientOrders>(*drive).order.command, (VelocityCommand{0.3, -0.5}));
  const auto set = parse_client_text(R"({"op":"camera","do":"set","control":"exposure_ms","value":5})");
  ASSERT_TRUE(set);
  EXPECT_EQ(std::get<ClientOrders>(*set).order.kind, ViewerOrder::Kind::SetControl);
  EXPECT_EQ(std::get<ClientOrders>(*set).order.control, "exposure_ms");
  EXPECT_EQ(std::get<ClientOrders>(*set).order.value, 5);
  const auto record = parse_client_text(R"({"op":"camera","do":"record"})");
  ASSERT_TRUE(record);
  EXPECT_EQ(std::get<ClientOrders>(*record).order.kind, ViewerOrder::Kind::Record);
}

TEST(ClientMessage, InvalidMessagesAreErrors) {
  for (const char* text : {"",
                           "{",
                           "[]",
                           "1",
                           "null",
                           "{}",
                           R"({"op":1})",
                           R"({"op":"subscribe"})",
                           R"({"op":"subscribe","subscriptions":{}})",
                           R"({"op":"subscribe","subscriptions":[1]})",
                           R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":0}]})",
                           R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":4294967296}]})",
                           R"({"op":"unsubscribe","subscriptionIds":["0"]})",
                           R"({"op":"advertise","channels":[{"id":1}]})",
                           R"({"op":"order","order":"dance"})",
                           R"({"op":"order"})",
                           R"({"op":"camera"})",
                           R"({"op":"camera","do":"set","control":"gain"})",
                           R"({"op":"camera","do":"set","value":1})",
                           R"({"op":"drive"})",
                           R"({"op":"drive","speed_m_s":1e300,"yaw_rate_rad_s":0})",
                           R"({"op":"drive","speed_m_s":"1","yaw_rate_rad_s":0})",
                           R"({"op":"drive","speed_m_s":11,"yaw_rate_rad_s":0})"}) {
    const auto message = parse_client_text(text);
    ASSERT_FALSE(message) << text;
    EXPECT_FALSE(message.error().message.empty());
  }
  std::string many = R"({"op":"unsubscribe","subscriptionIds":[0)";
  for (std::size_t i = 0; i < kMaxNamed; ++i) many += ",0";
  EXPECT_FALSE(parse_client_text(many + "]}"));
  EXPECT_FALSE(parse_client_text(std::string(60000, '[')));
}

TEST(ClientMessage, ParsesPublishedMessages) {
  const std::uint8_t bytes[] = {1, 2, 1, 0, 0, '{', '}'};
  const auto published = parse_client_binary(bytes);
  ASSERT_TRUE(published);
  EXPECT_EQ(published->channel, 258u);
  EXPECT_EQ(published->message.size(), 2u);
  EXPECT_FALSE(parse_client_binary({bytes, 4}));
  EXPECT_FALSE(parse_client_binary({}));
  const auto drive =
      parse_published("/cmd_vel", R"({"linear":{"x":0.2,"y":0,"z":0},"angular":{"x":0,"y":0,"z":1}})");
  ASSERT_TRUE(drive);
  EXPECT_EQ(drive->command, (VelocityCommand{0.2, 1}));
  EXPECT_EQ(parse_published("/waymark/order", R"({"data":"go"})")->kind, ViewerOrder::Kind::Go);
  EXPECT_FALSE(parse_published("/other", R"({"data":"go"})"));
  EXPECT_FALSE(parse_published("/cmd_vel", R"({"linear":1,"angular":2})"));
  EXPECT_FALSE(parse_published("/cmd_vel", "\xff\xff"));
}

}  // namespace
}  // namespace waymark
