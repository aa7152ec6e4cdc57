#include "waymark/server/live_words.hpp"

#include <nlohmann/json.hpp>

#include "waymark/recording/ros2/messages.hpp"
#include "waymark/server/client_message.hpp"

namespace waymark {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// Names and reasons come from anywhere; what is no UTF-8 in them is replaced.
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
  info["capabilities"] = OrderedJson::array({"clientPublish"});  // without the token: a stop
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
    list.push_back({{"name", light.name}, {"level", to_string(light.level)}, {"words", light.words}});
  return written({{"phase", status.phase},
                  {"reason", status.reason},
                  {"commands", status.commands},
                  {"page_drives", status.page_drives},
                  {"halted", status.halted},
                  {"driven_m", status.driven_m},
                  {"goal_m", status.goal_m},
                  {"dropped_pictures", status.dropped_pictures},
                  {"dropped_samples", dropped},
                  {"lights", std::move(list)}});
}

std::string control_json(const ControlWords& words) {
  return written({{"op", "control"},
                  {"may", words.may},
                  {"yours", words.yours},
                  {"held", words.held},
                  {"viewers", words.viewers},
                  {"dropped", words.dropped}});
}

}  // namespace waymark
