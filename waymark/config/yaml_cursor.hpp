#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/config/yaml_node.hpp"

namespace waymark {

/// A place in a YAML tree that knows its file, line and dotted key, and says so in every error. Cheap to
/// copy; the node must live longer.
class YamlCursor {
 public:
  YamlCursor(const YamlNode& node, std::string source, std::string key = {})
      : node_(&node), source_(std::move(source)), key_(std::move(key)) {}

  [[nodiscard]] const YamlNode& node() const { return *node_; }
  [[nodiscard]] bool is_null() const { return node_->kind == YamlNode::Kind::Null; }
  [[nodiscard]] bool is_map() const { return node_->kind == YamlNode::Kind::Map; }
  [[nodiscard]] bool is_sequence() const { return node_->kind == YamlNode::Kind::Sequence; }
  [[nodiscard]] const std::string& source() const { return source_; }
  [[nodiscard]] Place place() const { return {.source = source_, .line = node_->line, .key = key_}; }
  /// An error at this place.
  [[nodiscard]] tl::unexpected<Error> fail_here(ErrorCode code, std::string message,
                                                std::string hint = {}) const {
    return fail(code, std::move(message), place(), std::move(hint));
  }

  /// The value of a key of a map; nothing when it is not there or null.
  [[nodiscard]] std::optional<YamlCursor> find(std::string_view key) const;
  /// The same, where it must be there.
  [[nodiscard]] Result<YamlCursor> at(std::string_view key) const;
  /// What `read` makes of the value of a key that must be there: `root.read_at("fx", &YamlCursor::number)`.
  template <class Read>
  [[nodiscard]] auto read_at(std::string_view key, Read&& read) const
      -> std::invoke_result_t<Read, const YamlCursor&> {
    const Result<YamlCursor> value = at(key);
    if (!value) return tl::unexpected<Error>(value.error());
    return std::invoke(std::forward<Read>(read), *value);
  }
  /// All values of a sequence or a map.
  [[nodiscard]] std::vector<YamlCursor> children() const;

  /// Fails unless this is a map (or null) with no other keys; the error suggests the nearest word.
  [[nodiscard]] Status check_keys(const std::vector<std::string>& known) const;

  /// A finite number.
  [[nodiscard]] Result<double> number() const;
  /// A whole number in [low, high].
  [[nodiscard]] Result<std::int64_t> integer(std::int64_t low, std::int64_t high) const;
  /// true or false.
  [[nodiscard]] Result<bool> boolean() const;
  [[nodiscard]] Result<std::string> text() const;
  /// A list of finite numbers, any length.
  [[nodiscard]] Result<std::vector<double>> numbers() const;
  /// A list of exactly so many finite numbers.
  [[nodiscard]] Result<std::vector<double>> exactly_numbers(std::size_t count) const;

 private:
  [[nodiscard]] YamlCursor child(std::size_t index) const;
  [[nodiscard]] tl::unexpected<Error> not_a(std::string_view what) const;

  const YamlNode* node_;
  std::string source_;
  std::string key_;
};

}  // namespace waymark
