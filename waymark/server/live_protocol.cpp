#include "waymark/server/live_protocol.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/base/json_depth.hpp"
#include "waymark/recording/ros2/messages.hpp"

namespace waymark {
namespace {

using Json = nlohmann::json;

constexpr double kMaxSpeed_m_s = 10;  // sanity limit; the limits of robots are lower
constexpr double kMaxYawRate_rad_s = 20;
constexpr double kMaxControl = 1e9;
constexpr std::size_t kMaxName = 256;

tl::unexpected<Error> invalid_message(std::string text) {
  return fail(ErrorCode::Unreadable, std::move(text));
}

std::optional<std::uint32_t> id_of(const Json& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto id = value.get<std::uint64_t>();
  if (id > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(id);
}

std::optional<std::string> word_of(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_string()) return std::nullopt;
  const auto& text = found->get_ref<const std::string&>();
  return text.size() > kMaxName ? std::nullopt : std::optional(text);
}

std::optional<std::uint32_t> id_of(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? id_of(*found) : std::nullopt;
}

/// A list in a message; nullptr if it is missing or longer than kMaxNamed.
const Json* list_of(const Json& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_array() || found->size() > kMaxNamed) return nullptr;
  return &*found;
}

Result<ClientMessage> subscribe(const Json& message) {
  const Json* list = list_of(message, "subscriptions");
  if (list == nullptr) return invalid_message("subscribe: list 'subscriptions' is missing");
  ClientSubscribe out;
  for (const Json& one : *list) {
    const auto subscription = id_of(one, "id");
    const auto channel = id_of(one, "channelId");
    if (!subscription || !channel)
      return invalid_message("a subscription needs the numbers 'id' and 'channelId'");
    out.wanted.push_back({*subscription, *channel});
  }
  return ClientMessage(std::move(out));
}

Result<std::vector<std::uint32_t>> ids(const Json& message, const char* key) {
  const Json* list = list_of(message, key);
  if (list == nullptr) return invalid_message(fmt::format("the list '{}' is missing", key));
  std::vector<std::uint32_t> out;
  for (const Json& one : *list) {
    const auto id = id_of(one);
    if (!id) return invalid_message(fmt::format("'{}' contains a value that is not a number", key));
    out.push_back(*id);
  }
  return out;
}

Result<ClientMessage> advertise(const Json& message) {
  const Json* list = list_of(message, "channels");
  if (list == nullptr) return invalid_message("advertise: list 'channels' is missing");
  ClientAdvertise out;
  for (const Json& one : *list) {
    const auto channel = id_of(one, "id");
    const auto topic = one.is_object() ? word_of(one, "topic") : std::nullopt;
    const auto encoding = one.is_object() ? word_of(one, "encoding") : std::nullopt;
    if (!channel || !topic || !encoding)
      return invalid_message("a channel needs 'id', 'topic' and 'encoding'");
    out.channels.push_back({*channel, *topic, *encoding});
  }
  return ClientMessage(std::move(out));
}

std::optional<double> number_of(const Json& object, const char* key, double most) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  if (!object.is_object() || found == object.end() || !found->is_number()) return std::nullopt;
  const auto value = found->get<double>();
  return std::isfinite(value) && std::abs(value) <= most ? std::optional(value) : std::nullopt;
}

Result<ViewerOrder> order_named(std::string_view name) {
  using Kind = ViewerOrder::Kind;
  for (const auto& [word, kind] :
       {std::pair{"go", Kind::Go}, std::pair{"stop", Kind::Stop}, std::pair{"quit", Kind::Quit},
        std::pair{"script", Kind::Script}, std::pair{"teach", Kind::Teach}}) {
    if (name == word) return ViewerOrder{.kind = kind};
  }
  return invalid_message("an order must be one of go, stop, script, teach, quit");
}

Result<ViewerOrder> drive_order(std::optional<double> speed_m_s, std::optional<double> yaw_rate_rad_s) {
  if (!speed_m_s || !yaw_rate_rad_s)
    return invalid_message(
        fmt::format("a velocity must be within {} m/s and {} rad/s", kMaxSpeed_m_s, kMaxYawRate_rad_s));
  return ViewerOrder{.kind = ViewerOrder::Kind::Velocity, .command = {*speed_m_s, *yaw_rate_rad_s}};
}

/// Parses {"do": "set", "control": "exposure_ms", "value": 5}, {"do": "snapshot"} or {"do": "record"}.
Result<ViewerOrder> camera_order(const Json& message) {
  using Kind = ViewerOrder::Kind;
  const std::string what = word_of(message, "do").value_or("");
  if (what == "snapshot") return ViewerOrder{.kind = Kind::Snapshot};
  if (what == "record") return ViewerOrder{.kind = Kind::Record};
  const auto control = word_of(message, "control");
  const auto value = number_of(message, "value", kMaxControl);
  if (what != "set" || !control || !value)
    return invalid_message("a camera order must be set (with control and value), snapshot or record");
  return ViewerOrder{.kind = Kind::SetControl, .control = *control, .value = *value};
}

Result<ClientMessage> order_message(Result<ViewerOrder> order) {
  if (!order) return tl::unexpected(order.error());
  return ClientMessage(ClientOrders{*order});
}

/// Maximum nesting depth of a message; a subscription has depth 3.
constexpr std::size_t kMaxJsonDepth = 16;

Json parsed(std::string_view text) {
  if (json_depth(text, kMaxJsonDepth) > kMaxJsonDepth) return Json(Json::value_t::discarded);
  return Json::parse(text.begin(), text.end(), nullptr, false);
}

}  // namespace

Result<ClientMessage> parse_client_text(std::string_view text) {
  const Json message = parsed(text);
  if (!message.is_object()) return invalid_message("not a JSON object");
  const auto op = word_of(message, "op");
  if (!op) return invalid_message("the object has no 'op'");
  if (*op == "subscribe") return subscribe(message);
  if (*op == "advertise") return advertise(message);
  if (*op == "unsubscribe" || *op == "unadvertise") {
    const bool subscriptions = *op == "unsubscribe";
    auto list = ids(message, subscriptions ? "subscriptionIds" : "channelIds");
    if (!list) return tl::unexpected(list.error());
    return subscriptions ? ClientMessage(ClientUnsubscribe{std::move(*list)})
                         : ClientMessage(ClientUnadvertise{std::move(*list)});
  }
  if (*op == "take") return ClientMessage(ClientTakes{});
  if (*op == "release") return ClientMessage(ClientReleases{});
  if (*op == "alive") return ClientMessage(ClientAlive{});
  if (*op == "order") return order_message(order_named(word_of(message, "order").value_or("")));
  if (*op == "camera") return order_message(camera_order(message));
  if (*op == "drive")
    return order_message(drive_order(number_of(message, "speed_m_s", kMaxSpeed_m_s),
                                     number_of(message, "yaw_rate_rad_s", kMaxYawRate_rad_s)));
  return ClientMessage(ClientUnsupported{*op});
}

Result<ClientPublishes> parse_client_binary(std::span<const std::uint8_t> bytes) {
  constexpr std::uint8_t kMessageData = 1;
  constexpr std::size_t kHead = 5;
  if (bytes.size() < kHead || bytes[0] != kMessageData)
    return invalid_message("a binary message must begin with 1 and a channel number");
  std::uint32_t channel = 0;
  for (std::size_t i = 0; i < 4; ++i) channel |= std::uint32_t{bytes[1 + i]} << (8 * i);
  return ClientPublishes{channel, bytes.subspan(kHead)};
}

Result<ViewerOrder> parse_published(std::string_view topic, std::string_view json) {
  const Json message = parsed(json);
  if (!message.is_object()) return invalid_message("not a JSON object");
  if (topic == kOrderTopic) return order_named(word_of(message, "data").value_or(""));
  if (topic != kDriveTopic)
    return invalid_message(fmt::format("only {} and {} are accepted", kOrderTopic, kDriveTopic));
  const auto linear = message.find("linear");
  const auto angular = message.find("angular");
  if (linear == message.end() || angular == message.end())
    return invalid_message("a Twist needs 'linear' and 'angular'");
  return drive_order(number_of(*linear, "x", kMaxSpeed_m_s), number_of(*angular, "z", kMaxYawRate_rad_s));
}

namespace {

using OrderedJson = nlohmann::ordered_json;

/// Names and reasons may contain any bytes; bytes that are not valid UTF-8 are replaced.
std::string written(const OrderedJson& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

template <class Number>
void append_little(std::string& out, Number value) {
  for (std::size_t i = 0; i < sizeof(Number); ++i) out += static_cast<char>((value >> (8 * i)) & 0xffU);
}

}  // namespace

std::string server_info(std::string_view name) {
  OrderedJson info{{"op", "serverInfo"}, {"name", name}};
  info["capabilities"] = OrderedJson::array({"clientPublish"});  // viewers without the token can only stop
                                                                 // the robot
  info["supportedEncodings"] = OrderedJson::array({"json"});
  info["metadata"] = {{"ROS_DISTRO", "humble"}};
  return written(info);
}

std::string advertisement(std::span<const LiveChannel> channels) {
  auto list = OrderedJson::array();
  for (const LiveChannel& channel : channels) {
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", channel.json ? "json" : "cdr"},
                    {"schemaName", channel.type},
                    {"schema", channel.json ? R"({"type":"object"})" : ros2::schema_text(channel.type)},
                    {"schemaEncoding", channel.json ? "jsonschema" : "ros2msg"}});
  }
  return written({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string status_message(std::string_view words) {
  constexpr int kWarning = 1;
  return written({{"op", "status"}, {"level", kWarning}, {"message", words}});
}

std::string message_head(std::uint32_t subscription, std::int64_t host_ns) {
  std::string head(1, '\x01');
  append_little(head, subscription);
  append_little(head, static_cast<std::uint64_t>(host_ns));
  return head;
}

std::string text_message(std::string_view name, std::string_view text) {
  return written({{"op", "text"}, {"name", name}, {"text", text}});
}

std::string state_json(const LiveStatus& status, const std::vector<HealthLight>& lights,
                       std::uint64_t dropped) {
  auto list = OrderedJson::array();
  for (const HealthLight& light : lights)
    list.push_back({{"name", light.name}, {"level", to_string(light.level)}, {"message", light.message}});
  return written({{"phase", status.phase},
                  {"reason", status.reason},
                  {"commands", status.commands},
                  {"page_drives", status.page_drives},
                  {"halted", status.halted},
                  {"driven_m", status.driven_m},
                  {"goal_m", status.goal_m},
                  {"dropped_images", status.dropped_images},
                  {"dropped_samples", dropped},
                  {"lights", std::move(list)}});
}

std::string control_json(const ControlState& state) {
  return written({{"op", "control"},
                  {"may", state.may},
                  {"yours", state.yours},
                  {"held", state.held},
                  {"viewers", state.viewers},
                  {"dropped", state.dropped}});
}

}  // namespace waymark
