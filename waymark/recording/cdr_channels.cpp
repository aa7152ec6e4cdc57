#include "waymark/recording/cdr_channels.hpp"

#include <algorithm>
#include <bit>

#include <fmt/format.h>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/messages.hpp"

namespace waymark::ros {
namespace {

/// Bounds the output: a short message of empty structs could otherwise expand without limit.
constexpr std::size_t kMaxGrowth = 16;
constexpr std::size_t kGrowthRoom = 1 << 16;

class Walk {
 public:
  Walk(const Definition& definition, ByteSpan message, Bytes& out)
      : definition_(definition),
        in_(message),
        out_(out),
        origin_(out.size()),
        max_out_(out.size() + kGrowthRoom + kMaxGrowth * message.size()) {}

  bool structure(std::size_t number) {
    // Structs can be nested so that they consume no input and repeat without end.
    if (++steps_ > max_out_) return false;
    const Struct& s = definition_.structs[number];
    if (s.fields.empty()) out_.push_back(0);
    if (s.has_sequence_number) (void)in_.take(4);
    for (std::size_t i = s.has_sequence_number ? 1 : 0; i < s.fields.size(); ++i) {
      if (!field(s.fields[i])) return false;
    }
    return !in_.failed() && out_.size() <= max_out_;
  }

  [[nodiscard]] bool at_end() const { return in_.remaining() == 0; }
  [[nodiscard]] std::size_t position() const { return in_.position(); }

 private:
  bool field(const Field& field) {
    std::uint32_t count = field.count;
    if (field.repeat == Repeat::Sequence) {
      count = in_.number<std::uint32_t>();
      align(4);
      append_little_endian(out_, count);
    }
    if (const std::size_t size = size_of(field.type); size != 0) return numbers(count, size);
    for (std::uint32_t i = 0; i < count; ++i) {
      if (!element(field)) return false;
    }
    return !in_.failed();
  }

  /// Both sides are little-endian; only the padding differs.
  bool numbers(std::uint32_t count, std::size_t size) {
    const ByteSpan bytes = in_.take(std::uint64_t{count} * size);
    if (in_.failed()) return false;
    if (count > 0) align(size);
    append(out_, bytes);
    return true;
  }

  bool element(const Field& field) {
    if (field.type == Primitive::Struct) return structure(field.structure);
    if (field.type == Primitive::String) {
      const ByteSpan text = in_.counted<std::uint32_t>();
      if (in_.failed()) return false;
      align(4);
      append_little_endian(out_, static_cast<std::uint32_t>(text.size() + 1));
      append(out_, text);
      out_.push_back(0);
      return true;
    }
    align(4);  // time and duration: seconds, nanoseconds
    append(out_, in_.take(8));
    return !in_.failed();
  }

  void align(std::size_t size) {
    while ((out_.size() - origin_) % size != 0) out_.push_back(0);
  }

  const Definition& definition_;
  ByteReader in_;
  Bytes& out_;
  std::size_t origin_;
  std::size_t max_out_;
  std::size_t steps_ = 0;
};

}  // namespace

Result<Ros1Transcoder> Ros1Transcoder::make(std::string_view type, std::string_view definition) {
  Result<Definition> parsed = parse_definition(type, definition);
  if (!parsed) return tl::unexpected(parsed.error());
  Ros1Transcoder transcoder;
  transcoder.definition_ = std::move(*parsed);
  transcoder.type_ = ros2_type(type);
  const std::string known = ros2::schema_text(transcoder.type_);
  if (!known.empty()) {
    const Result<Definition> ours = parse_definition(transcoder.type_, known);
    transcoder.same_ = ours && wire_layout(*ours) == wire_layout(transcoder.definition_);
  }
  transcoder.schema_ = !known.empty() && transcoder.same_ ? known : ros2_text(transcoder.definition_);
  return transcoder;
}

bool Ros1Transcoder::drops_sequence_numbers() const {
  return std::ranges::any_of(definition_.structs, &Struct::has_sequence_number);
}

Status Ros1Transcoder::transcode(ByteSpan message, Bytes& out) const {
  append(out, cdr::kLittleEndian);
  Walk walk(definition_, message, out);
  if (!walk.structure(0))
    return fail(ErrorCode::Unreadable,
                fmt::format("message of {} bytes is too short for its type {}", message.size(), type_));
  if (!walk.at_end())
    return fail(ErrorCode::Unreadable,
                fmt::format("message of {} bytes is longer than its type {} ({} bytes)", message.size(),
                            type_, walk.position()));
  return {};
}

}  // namespace waymark::ros

namespace waymark {
namespace {

/// The type in ROS 1 spelling, which is stored in the channel metadata or, in MCAP files, as the schema name.
std::string ros1_type(const LogChannel& channel) {
  const auto name = channel.metadata.find("ros1_type");
  return name == channel.metadata.end() ? ros::short_type(channel.type) : name->second;
}

/// Whether the definition in a recording has the same byte layout as the built-in definition of the same
/// name.
bool fits_ours(const LogChannel& channel) {
  const std::string ours = ros2::schema_text(channel.type);
  if (ours.empty() || channel.schema_encoding != "ros2msg" || channel.schema.empty()) return true;
  if (channel.schema == ours) return true;
  const auto a = ros::parse_definition(channel.type, ours);
  const auto b = ros::parse_definition(channel.type, channel.schema);
  // A definition that the parser rejects does not prove that the bytes differ.
  return !a || !b || ros::wire_layout(*a) == ros::wire_layout(*b);
}

}  // namespace

const CdrChannels::Channel* CdrChannels::channel(const LogChannel& channel) {
  const auto known = known_.find(&channel);
  if (known != known_.end()) return known->second.get();
  auto made = std::make_unique<Channel>(Channel{.channel = channel});
  if (channel.encoding == "ros1") {
    auto transcoder = ros::Ros1Transcoder::make(ros1_type(channel), channel.schema);
    if (transcoder) {
      made->channel.type = transcoder->type();
      made->channel.encoding = "cdr";
      made->channel.schema_encoding = "ros2msg";
      made->channel.schema = transcoder->schema();
      made->known_layout = transcoder->same_as_ros2();
      made->transcoder = std::move(*transcoder);
    } else {
      Error error = transcoder.error();
      error.place.key = channel.topic;
      note_(LogProblem::Kind::Damage, "ros1.definition:" + channel.topic, error);
      made.reset();
    }
  } else if (channel.encoding == "cdr") {
    made->known_layout = fits_ours(channel);
  } else {
    made.reset();
  }
  if (made && !made->known_layout) {
    note_(LogProblem::Kind::Trap, "ros.other_layout:" + channel.topic,
          Error{ErrorCode::Unsupported,
                fmt::format("the fields of its {} differ from those of ROS 2: messages are copied but not "
                            "read as samples",
                            made->channel.type),
                {.key = channel.topic},
                {}});
  }
  return known_.emplace(&channel, std::move(made)).first->second.get();
}

std::optional<CdrChannels::Message> CdrChannels::convert(const LogChannel& channel,
                                                         const LogMessage& message) {
  const Channel* rewritten = this->channel(channel);
  if (rewritten == nullptr) return std::nullopt;
  if (!rewritten->transcoder) return Message{rewritten, message.data};
  cdr_.clear();
  if (Status status = rewritten->transcoder->transcode(message.data, cdr_); !status) {
    Error error = status.error();
    error.place.key = channel.topic;
    note_(LogProblem::Kind::Damage, "ros1.message:" + channel.topic, error);
    return std::nullopt;
  }
  return Message{rewritten, cdr_};
}

}  // namespace waymark
