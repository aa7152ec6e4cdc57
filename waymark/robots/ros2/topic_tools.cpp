#include "waymark/robots/ros2/topic_tools.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <thread>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/ros_definition.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

using ros::Primitive;

constexpr std::size_t kEncapsulation = 4;
constexpr std::size_t kMaxText = std::size_t{1} << 20U;

/// Decodes a message using its definition and prints it as text.
class Walk {
 public:
  Walk(const ros::Definition& definition, ByteSpan body, std::size_t max_elements)
      : definition_(definition), in_(body), max_elements_(max_elements) {}

  void structure(std::size_t number, int indent) {
    for (const ros::Field& field : definition_.structs[number].fields) {
      if (in_.failed()) return;
      write(indent, field.name + ":");
      this->field(field, indent);
    }
  }
  [[nodiscard]] bool failed() const { return in_.failed(); }
  [[nodiscard]] std::string take_text() { return std::move(text_); }

 private:
  void field(const ros::Field& field, int indent) {
    if (field.repeat == ros::Repeat::One) return element(field, indent);
    const std::uint32_t count = field.repeat == ros::Repeat::Sequence ? number<std::uint32_t>() : field.count;
    if (count == 0) return write(0, " []\n");
    if (field.type != Primitive::Struct) return values(field, count);
    write(0, "\n");
    for (std::uint32_t i = 0; i < count && !in_.failed(); ++i) {
      write(indent, i < max_elements_ ? "-\n" : "");
      hidden_ += i < max_elements_ ? 0 : 1;
      structure(field.structure, indent + 1);
      hidden_ -= i < max_elements_ ? 0 : 1;
    }
    if (count > max_elements_) write(indent, fmt::format("# {} in all\n", count));
  }

  void values(const ros::Field& field, std::uint32_t count) {
    write(0, " [");
    for (std::uint32_t i = 0; i < count && !in_.failed(); ++i) {
      const std::string value = this->value(field.type);
      if (i < max_elements_) write(0, (i > 0 ? ", " : "") + value);
    }
    write(0, count > max_elements_ ? fmt::format(", …] # {} in all\n", count) : "]\n");
  }

  void element(const ros::Field& field, int indent) {
    if (field.type != Primitive::Struct) return write(0, " " + value(field.type) + "\n");
    write(0, "\n");
    structure(field.structure, indent + 1);
  }

  std::string value(Primitive type) {
    switch (type) {
      case Primitive::Bool:
        return number<std::uint8_t>() != 0 ? "true" : "false";
      case Primitive::Int8:
        return fmt::format("{}", number<std::int8_t>());
      case Primitive::UInt8:
        return fmt::format("{}", number<std::uint8_t>());
      case Primitive::Int16:
        return fmt::format("{}", number<std::int16_t>());
      case Primitive::UInt16:
        return fmt::format("{}", number<std::uint16_t>());
      case Primitive::Int32:
        return fmt::format("{}", number<std::int32_t>());
      case Primitive::UInt32:
        return fmt::format("{}", number<std::uint32_t>());
      case Primitive::Int64:
        return fmt::format("{}", number<std::int64_t>());
      case Primitive::UInt64:
        return fmt::format("{}", number<std::uint64_t>());
      case Primitive::Float32:
        return fmt::format("{}", number<float>());
      case Primitive::Float64:
        return fmt::format("{}", number<double>());
      default:
        return text();
    }
  }

  std::string text() {
    const ByteSpan bytes = in_.take(number<std::uint32_t>());
    std::string quoted = "'";
    for (const std::uint8_t byte : bytes) {
      if (byte == 0) break;
      quoted += byte >= 0x20 && byte != 0x7f ? std::string(1, static_cast<char>(byte)) : "?";
    }
    return quoted + "'";
  }

  template <class T>
  T number() {
    (void)in_.take((sizeof(T) - in_.position() % sizeof(T)) % sizeof(T));
    return in_.number<T>();
  }

  void write(int indent, std::string_view text) {
    if (hidden_ > 0 || text_.size() > kMaxText) return;
    if (!text.empty()) text_ += std::string(2 * static_cast<std::size_t>(indent), ' ');
    text_ += text;
  }

  const ros::Definition& definition_;
  ByteReader in_;
  std::size_t max_elements_;
  int hidden_ = 0;
  std::string text_{};
};

}  // namespace

Result<std::string> message_text(std::string_view type, std::span<const std::uint8_t> cdr,
                                 std::size_t max_elements) {
  const std::string schema = ros2::schema_text(type);
  if (schema.empty())
    return fail(ErrorCode::Unsupported, fmt::format("cannot show messages of unknown type {}", type),
                {.key = std::string(type)}, "Use `waymark ros2 topic hz` to measure their rate.");
  const auto definition = ros::parse_definition(type, schema);
  if (!definition) return tl::unexpected(definition.error());
  if (cdr.size() < kEncapsulation || cdr[0] != 0 || cdr[1] != 1)
    return fail(ErrorCode::Unsupported, "the message is not plain little-endian CDR (encapsulation 00 01)");
  Walk walk(*definition, cdr.subspan(kEncapsulation), max_elements);
  walk.structure(0, 0);
  if (walk.failed())
    return fail(ErrorCode::Unreadable,
                fmt::format("message of {} bytes is too short for its type {}", cdr.size(), type));
  return walk.take_text();
}

namespace {

constexpr Duration kToolSlice = std::chrono::milliseconds(50);
constexpr Duration kQuiet = std::chrono::milliseconds(500);
constexpr int kQueueDepth = 100;

std::string qos_text(const TopicQos& qos) {
  return std::string(qos.reliable ? "reliable" : "best effort") +
         (qos.transient_local ? ", transient local" : "");
}

}  // namespace

std::vector<TopicListing> list_topics(const std::vector<BusEndpoint>& endpoints) {
  std::map<std::pair<std::string, std::string>, TopicListing> found;
  std::map<std::pair<std::string, std::string>, std::set<std::string>> offered;
  for (const BusEndpoint& endpoint : endpoints) {
    const auto name = ros_topic(endpoint.name);
    if (!name) continue;
    const auto key = std::pair(name->topic, name->type);
    TopicListing& entry = found[key];
    entry.topic = name->topic;
    entry.type = name->type;
    (endpoint.publishes ? entry.publishers : entry.subscriptions) += 1;
    if (endpoint.publishes) offered[key].insert(qos_text(endpoint.qos));
  }
  std::vector<TopicListing> all;
  for (auto& [key, entry] : found) {
    for (const std::string& qos : offered[key]) entry.offered += (entry.offered.empty() ? "" : " / ") + qos;
    all.push_back(std::move(entry));
  }
  return all;
}

std::string to_text(const TopicListing& listing) {
  return fmt::format("{} [{}] {}{}, {}", listing.topic, listing.type,
                     counted(listing.publishers, "publisher"),
                     listing.offered.empty() ? "" : " (" + listing.offered + ")",
                     counted(listing.subscriptions, "subscription"));
}

void wait_for_discovery(const Bus& bus, Duration timeout, const std::function<bool()>& should_stop) {
  const Duration began = steady_now();
  std::size_t discovered = 0;
  Duration changed = began;
  while (steady_now() - began < timeout && !should_stop()) {
    std::this_thread::sleep_for(kToolSlice);
    const std::size_t count = bus.endpoints().size() + bus.participants().size();
    if (count != discovered) changed = steady_now();
    discovered = count;
    if (discovered > 0 && steady_now() - changed > kQuiet) return;
  }
}

Result<WatchedTopic> watch_topic(Bus& bus, const std::string& topic, Duration timeout,
                                 const std::function<bool()>& should_stop) {
  if (!is_topic_name(topic))
    return fail(ErrorCode::InvalidArgument, fmt::format("invalid topic name '{}'", topic), {.key = "topic"},
                "List the topics with `waymark ros2 topic list`.");
  const Duration began = steady_now();
  const std::string wanted = topic.starts_with('/') ? topic : "/" + topic;
  std::set<std::string> names;
  do {
    std::set<std::string> types;
    names.clear();
    TopicQos qos{.depth = kQueueDepth};
    for (const BusEndpoint& endpoint : bus.endpoints()) {
      const auto name = ros_topic(endpoint.name);
      if (!name || !endpoint.publishes) continue;
      names.insert(name->topic);
      if (name->topic != wanted) continue;
      types.insert(name->type);
      qos.reliable = qos.reliable && endpoint.qos.reliable;
      qos.transient_local = endpoint.qos.transient_local;
    }
    if (types.size() > 1)
      return fail(
          ErrorCode::Unsupported,
          fmt::format("the topic is published with two types, {} and {}", *types.begin(), *types.rbegin()),
          {.key = wanted});
    if (types.size() == 1) {
      const auto number = bus.subscribe(dds_topic(wanted, *types.begin()), qos);
      if (!number) return tl::unexpected(number.error());
      return WatchedTopic{{wanted, *types.begin()}, *number};
    }
    std::this_thread::sleep_for(kToolSlice);
  } while (steady_now() - began < timeout && !should_stop());
  return fail(ErrorCode::NotFound, wanted + " has no publisher", {},
              names.empty() ? "" : suggestion(wanted, std::vector<std::string>(names.begin(), names.end())));
}

Status watch_messages(Bus& bus, const std::string& topic, const WatchLimits& limits,
                      const std::function<bool()>& should_stop,
                      const std::function<Status(const WatchedTopic&, const BusMessage&)>& take) {
  const auto watched = watch_topic(bus, topic, limits.patience, should_stop);
  if (!watched) return tl::unexpected(watched.error());
  const Duration began = steady_now();
  int count = 0;
  while (!should_stop() && (limits.messages == 0 || count < limits.messages) &&
         (limits.duration_s == 0 || to_seconds(steady_now() - began) <= limits.duration_s)) {
    const auto message = bus.next(kToolSlice);
    if (!message) continue;
    if (Status taken = take(*watched, *message); !taken) return taken;
    ++count;
  }
  if (count > 0) return {};
  return fail(ErrorCode::NotFound, "no message received", {.key = watched->name.topic});
}

void RateCounter::add(Duration arrived, std::size_t bytes) {
  if (count_++ == 0) {
    first_ = last_ = arrived;
    return;
  }
  bytes_ += bytes;
  shortest_ = std::min(shortest_, arrived - last_);
  longest_ = std::max(longest_, arrived - last_);
  last_ = arrived;
}

double RateCounter::rate_hz() const {
  return count_ < 2 || last_ <= first_ ? 0 : static_cast<double>(count_ - 1) / to_seconds(last_ - first_);
}

std::string RateCounter::text() const {
  if (count_ < 2) return count_ == 0 ? "no message" : "one message";
  const double seconds = std::max(to_seconds(last_ - first_), 1e-9);
  return fmt::format("{:.2f} Hz, {:.3f} MB/s, {:.1f} ms apart (from {:.1f} to {:.1f}), {} messages",
                     rate_hz(), static_cast<double>(bytes_) / seconds * 1e-6, 1e3 / rate_hz(),
                     1e3 * to_seconds(shortest_), 1e3 * to_seconds(longest_), count_);
}

}  // namespace waymark
