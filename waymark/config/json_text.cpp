#include "waymark/config/json_text.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

/// Input iterator over a text that counts the lines read.
struct CountingLines {
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  const char* at = nullptr;
  std::int64_t* line = nullptr;

  reference operator*() const { return *at; }
  CountingLines& operator++() {
    if (*at == '\n') ++*line;
    ++at;
    return *this;
  }
  bool operator==(const CountingLines& other) const { return at == other.at; }
  bool operator!=(const CountingLines& other) const { return at != other.at; }
};

/// Receives the parse events of a document and builds the tree. Each handler returns whether to continue.
class JsonTreeBuilder {
 public:
  JsonTreeBuilder(const YamlLimits& limits, const std::set<std::string>& skipped, const std::int64_t& line)
      : limits_(limits), skipped_(skipped), line_(line) {}

  bool null() { return scalar(YamlNode::Kind::Null, {}); }
  bool boolean(bool value) { return scalar(YamlNode::Kind::Scalar, value ? "true" : "false"); }
  bool number_integer(std::int64_t value) { return scalar(YamlNode::Kind::Scalar, std::to_string(value)); }
  bool number_unsigned(std::uint64_t value) { return scalar(YamlNode::Kind::Scalar, std::to_string(value)); }
  bool number_float(double /*value*/, const std::string& text) {
    return scalar(YamlNode::Kind::Scalar, text);
  }
  bool string(std::string& value) { return scalar(YamlNode::Kind::Scalar, value); }
  bool binary(std::vector<std::uint8_t>& /*value*/) { return false; }
  bool start_object(std::size_t /*elements*/) { return open(YamlNode::Kind::Map); }
  bool start_array(std::size_t /*elements*/) { return open(YamlNode::Kind::Sequence); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }

  bool key(std::string& name) {
    if (skipping_ > 0) return true;
    YamlNode& map = open_.back();
    if (std::ranges::find(map.keys, name) != map.keys.end())
      return stop(ErrorCode::Unreadable, fmt::format("the key '{}' is given twice", name.substr(0, 40)));
    skip_next_ = skipped_.contains(name);
    if (skip_next_) return true;
    map.keys.push_back(name);
    map.key_lines.push_back(line_);
    return true;
  }

  bool parse_error(std::size_t position, const std::string& /*token*/,
                   const nlohmann::json::exception& /*error*/) {
    return stop(ErrorCode::Unreadable, fmt::format("invalid JSON at character {}", position));
  }

  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  [[nodiscard]] YamlNode take() { return std::move(root_); }

 private:
  bool stop(ErrorCode code, std::string message) {
    if (!error_) error_ = Error{code, std::move(message), {.line = line_}, {}};
    return false;
  }
  bool count() {
    return ++nodes_ <= limits_.nodes ||
           stop(ErrorCode::LimitExceeded, fmt::format("more than {} values in a file", limits_.nodes));
  }
  /// Whether this value must be skipped.
  bool skips() { return skipping_ > 0 || std::exchange(skip_next_, false); }

  bool scalar(YamlNode::Kind kind, std::string text) {
    if (skips()) return true;
    return count() && put({.kind = kind, .line = line_, .text = std::move(text)});
  }
  bool open(YamlNode::Kind kind) {
    if (skips()) {
      ++skipping_;
      return true;
    }
    if (open_.size() >= limits_.depth)
      return stop(ErrorCode::LimitExceeded, fmt::format("nested more than {} deep", limits_.depth));
    open_.push_back({.kind = kind, .line = line_});
    return count();
  }
  bool close() {
    if (skipping_ > 0) {
      --skipping_;
      return true;
    }
    YamlNode done = std::move(open_.back());
    open_.pop_back();
    return put(std::move(done));
  }
  bool put(YamlNode node) {
    if (open_.empty()) {
      root_ = std::move(node);
    } else {
      open_.back().items.push_back(std::move(node));
    }
    return true;
  }

  const YamlLimits& limits_;
  const std::set<std::string>& skipped_;
  const std::int64_t& line_;
  std::vector<YamlNode> open_;
  YamlNode root_;
  std::size_t nodes_ = 0;
  std::size_t skipping_ = 0;  ///< depth inside a skipped value
  bool skip_next_ = false;
  std::optional<Error> error_;
};

}  // namespace

bool looks_like_json(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{';
}

Result<YamlNode> parse_json(std::string_view text, const std::string& source, const YamlLimits& limits,
                            const std::set<std::string>& skipped) {
  if (text.size() > limits.bytes)
    return fail(ErrorCode::LimitExceeded, fmt::format("longer than {} bytes", limits.bytes),
                {.source = source});
  std::int64_t line = 1;
  JsonTreeBuilder builder(limits, skipped, line);
  const CountingLines begin{text.data(), &line};
  const CountingLines end{text.data() + text.size(), &line};
  if (nlohmann::json::sax_parse(begin, end, &builder)) return builder.take();
  Error error = builder.error().value_or(Error{ErrorCode::Unreadable, "invalid JSON", {}, {}});
  error.place.source = source;
  return tl::unexpected(std::move(error));
}

}  // namespace waymark
