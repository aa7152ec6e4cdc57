#include "waymark/config/yaml_node.hpp"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

namespace waymark {
namespace {

/// Leaves yaml-cpp's parser from inside one of its events. Never leaves this file.
class Refused : public std::runtime_error {
 public:
  explicit Refused(Error error) : std::runtime_error(error.message), error_(std::move(error)) {}
  [[nodiscard]] const Error& error() const { return error_; }

 private:
  Error error_;
};

std::int64_t line_of(const YAML::Mark& mark) {
  return std::max<std::int64_t>(std::int64_t{mark.line} + 1, 1);
}

/// Builds the tree from yaml-cpp's events, so that no limit is passed before it is noticed.
class TreeBuilder final : public YAML::EventHandler {
 public:
  TreeBuilder(const std::string& source, const YamlLimits& limits) : source_(source), limits_(limits) {}

  [[nodiscard]] YamlNode take() { return std::move(root_); }
  [[nodiscard]] bool empty() const { return root_.kind == YamlNode::Kind::Null; }

  void OnDocumentStart(const YAML::Mark& /*mark*/) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse_anchor(mark, anchor);
    add({.kind = YamlNode::Kind::Null, .line = line_of(mark)});
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override { refuse_anchor(mark, 1); }
  void OnScalar(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse_anchor(mark, anchor);
    add({.kind = YamlNode::Kind::Scalar, .line = line_of(mark), .text = value});
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    refuse_anchor(mark, anchor);
    open({.kind = YamlNode::Kind::Sequence, .line = line_of(mark)});
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    refuse_anchor(mark, anchor);
    open({.kind = YamlNode::Kind::Map, .line = line_of(mark)});
  }
  void OnMapEnd() override {
    refuse_doubled_keys(open_.back());
    close();
  }

 private:
  [[noreturn]] void refuse(ErrorCode code, std::int64_t line, std::string message, std::string hint,
                           std::string key = {}) {
    throw Refused(Error{
        code, std::move(message), {.source = source_, .line = line, .key = std::move(key)}, std::move(hint)});
  }

  void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor == 0) return;
    refuse(ErrorCode::Unsupported, line_of(mark), "anchors (&name) and aliases (*name) are not supported",
           "Write the value out where it is needed.");
  }

  void refuse_doubled_keys(const YamlNode& map) {
    std::vector<std::size_t> order(map.keys.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return map.keys[a] < map.keys[b]; });
    for (std::size_t i = 1; i < order.size(); ++i) {
      const std::string& key = map.keys[order[i]];
      if (map.keys[order[i - 1]] != key) continue;
      refuse(ErrorCode::InvalidArgument, map.key_lines[order[i]],
             fmt::format("'{}' is given twice, first on line {}", key, map.key_lines[order[i - 1]]),
             "Remove one of them.", key);
    }
  }

  void count(std::int64_t line) {
    if (++nodes_ <= limits_.nodes) return;
    refuse(ErrorCode::LimitExceeded, line, fmt::format("more than {} values", limits_.nodes),
           "Is this the right file?");
  }

  /// A value of the innermost open container, or its key, or the document itself.
  void add(YamlNode node) {
    count(node.line);
    if (open_.empty()) {
      root_ = std::move(node);
      return;
    }
    YamlNode& parent = open_.back();
    if (parent.kind == YamlNode::Kind::Map && parent.keys.size() == parent.items.size()) {
      if (node.kind != YamlNode::Kind::Scalar) {
        refuse(ErrorCode::InvalidArgument, node.line, "a key must be a word", "Write `key: value`.");
      }
      parent.key_lines.push_back(node.line);
      parent.keys.push_back(std::move(node.text));
    } else {
      parent.items.push_back(std::move(node));
    }
  }

  void open(YamlNode node) {
    if (open_.size() >= limits_.depth) {
      refuse(ErrorCode::LimitExceeded, node.line, fmt::format("nested more than {} deep", limits_.depth),
             "Is this the right file?");
    }
    open_.push_back(std::move(node));
  }

  void close() {
    YamlNode node = std::move(open_.back());
    open_.pop_back();
    add(std::move(node));
  }

  const std::string& source_;
  const YamlLimits& limits_;
  YamlNode root_;
  std::vector<YamlNode> open_;
  std::size_t nodes_ = 0;
};

YamlNode parse_or_throw(std::string_view text, const std::string& source, const YamlLimits& limits) {
  std::istringstream stream{std::string(text)};
  YAML::Parser parser(stream);
  TreeBuilder first(source, limits);
  if (!parser.HandleNextDocument(first)) return {};
  TreeBuilder rest(source, limits);
  while (parser.HandleNextDocument(rest)) {
    if (rest.empty()) continue;
    throw Refused(Error{ErrorCode::Unsupported,
                        "there is a second document after '---'",
                        {.source = source, .line = rest.take().line},
                        "Keep one document in a file."});
  }
  return first.take();
}

}  // namespace

Result<YamlNode> parse_yaml(std::string_view text, const std::string& source, const YamlLimits& limits) {
  if (text.size() > limits.bytes) {
    return fail(ErrorCode::LimitExceeded,
                fmt::format("{} bytes are more than the {} allowed", text.size(), limits.bytes),
                {.source = source}, "Is this the right file?");
  }
  try {
    return parse_or_throw(text, source, limits);
  } catch (const Refused& refused) {
    return tl::unexpected<Error>(refused.error());
  } catch (const YAML::Exception& error) {
    return fail(ErrorCode::Unreadable, fmt::format("not valid YAML: {}", error.msg),
                {.source = source, .line = line_of(error.mark)},
                "Check indentation, colons and brackets there.");
  } catch (const std::exception& error) {
    return fail(ErrorCode::Unreadable, fmt::format("not valid YAML: {}", error.what()), {.source = source});
  }
}

}  // namespace waymark
