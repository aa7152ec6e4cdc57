#include "waymark/recording/bag_metadata.hpp"

#include <fmt/format.h>

namespace waymark {
namespace {

/// A YAML scalar in double quotes.
std::string in_quotes(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
    } else if (c == '"' || c == '\\') {
      out += fmt::format("\\{}", c);
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string value_of(const LogChannel& channel, const char* key) {
  const auto found = channel.metadata.find(key);
  return found == channel.metadata.end() ? std::string() : found->second;
}

std::string topic_text(const BagFormat& format, const LogChannel& channel) {
  const std::vector<OfferedQos> offered = parse_offered_qos(value_of(channel, "offered_qos_profiles"));
  const bool jazzy = format.release == BagRelease::Jazzy;
  std::string text = fmt::format(
      "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n",
      channel.topic, channel.type);
  if (!jazzy || offered.empty()) {
    const std::string profiles = offered.empty() ? std::string() : to_yaml(offered, format.qos());
    text += fmt::format("        offered_qos_profiles: {}\n", jazzy ? "[]" : in_quotes(profiles));
  } else {
    text += "        offered_qos_profiles:\n" + to_yaml(offered, format.qos(), 10);
  }
  if (jazzy)
    text +=
        fmt::format("        type_description_hash: {}\n", in_quotes(value_of(channel, "topic_type_hash")));
  return text + fmt::format("      message_count: {}\n", channel.messages.value_or(0));
}

}  // namespace

std::string bag_metadata(const BagFormat& format, const BagContents& contents) {
  std::uint64_t messages = 0;
  for (const LogChannel& channel : contents.channels) messages += channel.messages.value_or(0);
  const std::uint64_t duration = contents.end_ns - contents.start_ns;
  std::string text = fmt::format(
      "rosbag2_bagfile_information:\n  version: {}\n  storage_identifier: {}\n  duration:\n    nanoseconds: "
      "{}\n"
      "  starting_time:\n    nanoseconds_since_epoch: {}\n  message_count: {}\n",
      format.metadata_version(), format.storage_name(), duration, contents.start_ns, messages);
  text += contents.channels.empty() ? "  topics_with_message_count: []\n" : "  topics_with_message_count:\n";
  for (const LogChannel& channel : contents.channels) text += topic_text(format, channel);
  text += fmt::format(
      "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {0}\n  files:\n"
      "    - path: {0}\n      starting_time:\n        nanoseconds_since_epoch: {1}\n      duration:\n"
      "        nanoseconds: {2}\n      message_count: {3}\n",
      contents.file, contents.start_ns, duration, messages);
  if (format.release == BagRelease::Jazzy)
    text += fmt::format("  custom_data: ~\n  ros_distro: {}\n", format.distro());
  return text;
}

}  // namespace waymark
