#include "waymark/robots/dds/ros_names.hpp"

#include <cctype>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr std::string_view kTopicPrefix = "rt/";
constexpr std::string_view kMessages = "::msg::dds_::";

/// Converts "package/kind/Name" to "package::kind::dds_::Name" + `end`.
std::string dds_type(std::string_view ros_type, std::string_view end) {
  std::string type;
  const std::size_t last = ros_type.rfind('/');
  for (std::size_t i = 0; i < ros_type.size(); ++i)
    type += ros_type[i] != '/' ? std::string(1, ros_type[i]) : i == last ? "::dds_::" : "::";
  return type + std::string(end);
}

std::string_view without_slash(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  return name;
}

}  // namespace

BusTopic dds_topic(std::string_view ros_topic, std::string_view ros_type) {
  return {fmt::format("{}{}", kTopicPrefix, without_slash(ros_topic)), dds_type(ros_type, "_")};
}

std::optional<RosTopic> ros_topic(const BusTopic& dds) {
  const std::size_t kind = dds.type.find(kMessages);
  if (!dds.topic.starts_with(kTopicPrefix) || kind == std::string::npos || !dds.type.ends_with('_'))
    return std::nullopt;
  std::string name = dds.type.substr(kind + kMessages.size());
  name.pop_back();
  return RosTopic{dds.topic.substr(kTopicPrefix.size() - 1), dds.type.substr(0, kind) + "/msg/" + name};
}

bool is_topic_name(std::string_view name) {
  char before = '/';
  for (const char c : without_slash(name)) {
    const bool letter = c == '_' || std::isalpha(static_cast<unsigned char>(c)) != 0;
    const bool digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
    if (!letter && !(digit && before != '/') && !(c == '/' && before != '/')) return false;
    before = c;
  }
  return before != '/';
}

ServiceTopics dds_service(std::string_view ros_service, std::string_view ros_type) {
  const std::string_view name = without_slash(ros_service);
  return {{fmt::format("rq/{}Request", name), dds_type(ros_type, "_Request_")},
          {fmt::format("rr/{}Reply", name), dds_type(ros_type, "_Response_")}};
}

}  // namespace waymark
