#include "waymark/config/yaml_tree.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

/// Exception used to leave yaml-cpp's parser from an event handler. It is caught in this file.
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

/// Builds the tree from yaml-cpp's events, so that limits are checked during parsing.
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
           "Write out the value at each place.");
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

  /// Adds a value or a key to the innermost open container, or the document itself.
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
                        "second document after '---'",
                        {.source = source, .line = rest.take().line},
                        "Keep one document per file."});
  }
  return first.take();
}

}  // namespace

Result<YamlNode> parse_yaml(std::string_view text, const std::string& source, const YamlLimits& limits) {
  if (text.size() > limits.bytes) {
    return fail(ErrorCode::LimitExceeded,
                fmt::format("{} bytes exceed the limit of {}", text.size(), limits.bytes), {.source = source},
                "Is this the right file?");
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

namespace {

constexpr std::size_t kLongestQuote = 40;

std::string in_quotes(std::string_view text) {
  const bool cut = text.size() > kLongestQuote;
  return fmt::format("'{}{}'", text.substr(0, kLongestQuote), cut ? "…" : "");
}

std::string described(const YamlNode& node) {
  switch (node.kind) {
    case YamlNode::Kind::Null:
      return "nothing";
    case YamlNode::Kind::Scalar:
      return in_quotes(node.text);
    case YamlNode::Kind::Sequence:
      return "a list";
    case YamlNode::Kind::Map:
      return "a map";
  }
  return "something else";
}

/// Parses the whole text as a number, independent of the locale.
template <class Number>
std::optional<Number> parse_all(std::string_view text) {
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::optional<double> parse_number(std::string_view text) {
  if (text == ".nan" || text == ".NaN" || text == ".NAN" || text == ".inf" || text == "-.inf" ||
      text == "+.inf") {
    return std::nan("");
  }
  return parse_all<double>(text);
}

}  // namespace

YamlCursor YamlCursor::child(std::size_t index) const {
  std::string key = key_;
  if (is_map()) {
    key += (key.empty() ? "" : ".") + node_->keys[index];
  } else {
    key += fmt::format("[{}]", index);
  }
  return {node_->items[index], source_, std::move(key)};
}

std::optional<YamlCursor> YamlCursor::find(std::string_view key) const {
  if (!is_map()) return std::nullopt;
  const auto found = std::find(node_->keys.begin(), node_->keys.end(), key);
  if (found == node_->keys.end()) return std::nullopt;
  YamlCursor value = child(static_cast<std::size_t>(found - node_->keys.begin()));
  if (value.is_null()) return std::nullopt;
  return value;
}

Result<YamlCursor> YamlCursor::at(std::string_view key) const {
  if (!is_map()) return not_a("a map");
  if (auto value = find(key)) return *value;
  Place where = place();
  where.key += fmt::format("{}{}", where.key.empty() ? "" : ".", key);
  return fail(ErrorCode::NotFound, fmt::format("'{}' is missing", key), where,
              fmt::format("Add `{}:` with its value.", key));
}

std::vector<YamlCursor> YamlCursor::children() const {
  std::vector<YamlCursor> all;
  for (std::size_t i = 0; i < node_->items.size(); ++i) all.push_back(child(i));
  return all;
}

Status YamlCursor::check_keys(const std::vector<std::string>& known) const {
  if (is_null()) return {};
  if (!is_map()) return not_a("a map (key: value)");
  for (std::size_t i = 0; i < node_->keys.size(); ++i) {
    const std::string& key = node_->keys[i];
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    Place where = child(i).place();
    where.line = node_->key_lines[i];
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown key {}", in_quotes(key)), where,
                suggestion(key, known));
  }
  return {};
}

tl::unexpected<Error> YamlCursor::not_a(std::string_view what) const {
  if (is_null() && key_.empty())
    return fail_here(ErrorCode::InvalidArgument, "the file is empty",
                     "Write it again, or give another file.");
  return fail_here(ErrorCode::InvalidArgument, fmt::format("{} is not {}", described(*node_), what));
}

Result<double> YamlCursor::number() const {
  const auto value = node_->kind == YamlNode::Kind::Scalar ? parse_number(node_->text) : std::nullopt;
  if (!value) return not_a("a number");
  if (!std::isfinite(*value)) return not_a("a finite number");
  return *value;
}

Result<std::int64_t> YamlCursor::integer(std::int64_t low, std::int64_t high) const {
  const auto value =
      node_->kind == YamlNode::Kind::Scalar ? parse_all<std::int64_t>(node_->text) : std::nullopt;
  if (!value) return not_a("a whole number");
  if (*value < low || *value > high) {
    return fail_here(ErrorCode::InvalidArgument, fmt::format("{} is outside [{}, {}]", *value, low, high));
  }
  return *value;
}

Result<bool> YamlCursor::boolean() const {
  if (node_->kind == YamlNode::Kind::Scalar) {
    if (node_->text == "true" || node_->text == "True" || node_->text == "TRUE") return true;
    if (node_->text == "false" || node_->text == "False" || node_->text == "FALSE") return false;
  }
  return not_a("true or false");
}

Result<std::string> YamlCursor::text() const {
  if (node_->kind != YamlNode::Kind::Scalar) return not_a("a word");
  return node_->text;
}

Result<std::vector<double>> YamlCursor::numbers() const {
  if (!is_sequence()) return not_a("a list of numbers");
  std::vector<double> values;
  for (const YamlCursor& item : children()) {
    const auto value = item.number();
    if (!value) return tl::unexpected<Error>(value.error());
    values.push_back(*value);
  }
  return values;
}

Result<std::vector<double>> YamlCursor::exactly_numbers(std::size_t count) const {
  auto values = numbers();
  if (!values || values->size() == count) return values;
  return fail_here(ErrorCode::InvalidArgument,
                   fmt::format("{} numbers where {} are needed", values->size(), count));
}

std::string yaml_number(double value) {
  assert(std::isfinite(value));
  std::string text = fmt::format("{}", value);
  if (text.find('.') != std::string::npos) return text;
  const std::size_t exponent = text.find('e');
  // PyYAML reads "1e-05" as a string; its numbers need a decimal point.
  text.insert(exponent == std::string::npos ? text.size() : exponent, ".0");
  return text;
}

std::string yaml_text(std::string_view text) {
  constexpr std::array kOtherwise = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"};
  std::string lower;
  bool plain = !text.empty();
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    lower += static_cast<char>(std::tolower(byte));
    plain = plain && (std::isalnum(byte) != 0 || c == '_' || c == '/' || c == '-' || c == '.');
  }
  plain = plain && (std::isalpha(static_cast<unsigned char>(text.front())) != 0 || text.front() == '/') &&
          std::find(kOtherwise.begin(), kOtherwise.end(), lower) == kOtherwise.end();
  if (plain) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      quoted += fmt::format("\\x{:02x}", byte);
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

std::string yaml_list(std::span<const double> values) {
  std::string text = "[";
  for (const double value : values) {
    if (text.size() > 1) text += ", ";
    text += yaml_number(value);
  }
  return text + "]";
}

}  // namespace waymark

namespace waymark::internal {
namespace {

constexpr const char* kEndKey = "end";

}  // namespace

Status check_proportion(const YamlCursor& cursor, std::span<const double> values) {
  for (const double value : values) {
    if (std::abs(value) > kOutOfProportion)
      return cursor.fail_here(ErrorCode::InvalidArgument, fmt::format("{} is out of all proportion", value),
                              fmt::format("Numbers here are SI units within {}.", kOutOfProportion));
  }
  return {};
}

double Numbers::operator()(std::string_view key) {
  const Result<double> value = cursor_.read_at(key, &YamlCursor::number);
  if (!value && status_) status_ = tl::unexpected(value.error());
  if (value && status_) status_ = check_proportion(*cursor_.at(key), {&*value, 1});
  return status_ ? *value : 0;
}

double Numbers::optional(std::string_view key, double fallback) {
  return cursor_.find(key) ? (*this)(key) : fallback;
}

double Numbers::positive(std::string_view key) {
  const double value = (*this)(key);
  if (status_ && !(value > 0))
    status_ = cursor_.at(key)->fail_here(ErrorCode::InvalidArgument,
                                         fmt::format("{:g} is not greater than 0", value));
  return value;
}

double Numbers::plausible(std::string_view key, double most, std::string_view unit) {
  const double value = positive(key);
  if (status_ && value > most)
    status_ = cursor_.at(key)->fail_here(
        ErrorCode::InvalidArgument,
        fmt::format("{:g} {} exceeds the plausible maximum of {:g}", value, unit, most),
        fmt::format("The unit is {}.", unit));
  return value;
}

double Numbers::optional_positive(std::string_view key, double fallback) {
  return cursor_.find(key) ? positive(key) : fallback;
}

double Numbers::optional_within(std::string_view key, double fallback, double low, double high) {
  const double value = optional(key, fallback);
  if (status_ && !(value >= low && value <= high))
    status_ = cursor_.at(key)->fail_here(ErrorCode::InvalidArgument,
                                         fmt::format("{:g} is outside [{}, {}]", value, low, high));
  return value;
}

Result<Provenance> read_provenance(const YamlCursor& root) {
  Provenance provenance;
  const auto entry = root.find("provenance");
  if (!entry) return provenance;
  if (!entry->is_map()) return entry->fail_here(ErrorCode::InvalidArgument, "is not a map (key: value)");
  const std::vector<YamlCursor> values = entry->children();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Result<std::string> text = values[i].text();
    if (!text) return tl::unexpected(text.error());
    provenance.emplace_back(entry->node().keys[i], *text);
  }
  return provenance;
}

std::string provenance_yaml(const Provenance& provenance) {
  std::string text = provenance.empty() ? "provenance: {}\n" : "provenance:\n";
  for (const auto& [key, value] : provenance)
    text += fmt::format("  {}: {}\n", yaml_text(key), yaml_text(value));
  return text;
}

std::string yaml_with_end(std::string_view head, const EntryCount& count, std::size_t number,
                          std::string_view body) {
  return fmt::format("{}{}: {}\n{}{}: {}\n", head, count.key, number, body, kEndKey, number);
}

Status check_end(const YamlCursor& root, const EntryCount& count, std::size_t number) {
  constexpr std::int64_t kMaxEntries = 10'000'000;
  const auto declared_at = root.find(count.key);
  const auto end_at = root.find(kEndKey);
  if (!declared_at && !end_at) return {};
  const std::string hint = fmt::format(
      "Copy or write the file again. If you edited it, remove the keys {} and {}.", count.key, kEndKey);
  if (!declared_at)
    return end_at->fail_here(ErrorCode::InvalidArgument,
                             fmt::format("the key {} is given without {}", kEndKey, count.key), hint);
  const Result<std::int64_t> declared = declared_at->integer(0, kMaxEntries);
  if (!declared) return tl::unexpected(declared.error());
  const Result<std::int64_t> end = end_at ? end_at->integer(0, kMaxEntries) : Result<std::int64_t>(-1);
  if (!end) return tl::unexpected(end.error());
  if (*end != *declared)
    return declared_at->fail_here(
        ErrorCode::Unreadable,
        fmt::format("the file is truncated: it contains {} of {} {}, and its last line `{}: {}` is missing",
                    number, *declared, count.entries, kEndKey, *declared),
        hint);
  if (static_cast<std::size_t>(*declared) == number) return {};
  return declared_at->fail_here(
      ErrorCode::InvalidArgument,
      fmt::format("the file declares {} {} but contains {}", *declared, count.entries, number), hint);
}

}  // namespace waymark::internal
