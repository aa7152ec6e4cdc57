#include "waymark/config/yaml_cursor.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

constexpr std::size_t kLongestQuote = 40;

std::string in_quotes(std::string_view text) {
  const bool cut = text.size() > kLongestQuote;
  return fmt::format("'{}{}'", text.substr(0, kLongestQuote), cut ? "…" : "");
}

std::string in_words(const YamlNode& node) {
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

/// The whole text as a number, however the locale writes them.
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
  if (is_null() && key_.empty()) return fail_here(ErrorCode::InvalidArgument, "the file is empty");
  return fail_here(ErrorCode::InvalidArgument, fmt::format("{} is not {}", in_words(*node_), what));
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

}  // namespace waymark
