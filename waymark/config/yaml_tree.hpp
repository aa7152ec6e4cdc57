#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// One value of a YAML document: plain data with the line it stands on.
struct YamlNode {
  enum class Kind : std::uint8_t { Null, Scalar, Sequence, Map };

  Kind kind = Kind::Null;
  std::int64_t line = 1;                     ///< 1-based
  std::string text = {};                     ///< of a scalar, unquoted
  std::vector<std::string> keys = {};        ///< of a map, in the order of the file
  std::vector<std::int64_t> key_lines = {};  ///< where they stand
  std::vector<YamlNode> items = {};          ///< of a sequence, or the values of a map (as many as keys)
};

/// What a document may grow to: beyond it is an error and not a full memory or an overflowing stack.
struct YamlLimits {
  std::size_t bytes = std::size_t{1} << 20U;
  std::size_t nodes = 100'000;
  std::size_t depth = 64;
};

/// The single document in the text; `source` names it in errors. Fails on what is not YAML, on keys that are
/// given twice or are not words, on anchors and aliases (Unsupported: they can multiply a small file without
/// bound), on a second document that is not empty, and beyond the limits. O(bytes · log keys).
[[nodiscard]] Result<YamlNode> parse_yaml(std::string_view text, const std::string& source,
                                          const YamlLimits& limits = {});

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

/// The shortest decimal that reads back as the same double, and as a number (not a whole one, not a word) in
/// every YAML reader: "1.0", "1.0e-05". The value must be finite.
[[nodiscard]] std::string yaml_number(double value);

/// The word as it stands where YAML takes it for a word, else in double quotes with escapes.
[[nodiscard]] std::string yaml_text(std::string_view text);

/// "[1.0, 2.5]".
[[nodiscard]] std::string yaml_list(std::span<const double> values);

}  // namespace waymark

namespace waymark::internal {

/// Farther, larger, faster than this (in SI units) is a slip, and would overflow once it is squared.
inline constexpr double kOutOfProportion = 1e6;

/// Fails when one of the numbers at a place is out of all proportion.
[[nodiscard]] Status check_proportion(const YamlCursor& cursor, std::span<const double> values);

/// Numbers of a map, one after the other; the first error is kept.
class Numbers {
 public:
  explicit Numbers(const YamlCursor& cursor) : cursor_(cursor) {}

  double operator()(std::string_view key);
  /// The same, where the key may be missing.
  double optional(std::string_view key, double fallback);
  /// A number greater than 0.
  double positive(std::string_view key);
  /// A number greater than 0, and not greater than anything it describes is: else its unit was another one.
  double plausible(std::string_view key, double most, std::string_view unit);
  double optional_positive(std::string_view key, double fallback);
  /// A number from low to high.
  double optional_within(std::string_view key, double fallback, double low, double high);
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  const YamlCursor& cursor_;
  Status status_;
};

/// Where a file comes from, in words, in the order of the file: its key `provenance`, which may be missing.
using Provenance = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] Result<Provenance> read_provenance(const YamlCursor& root);
[[nodiscard]] std::string provenance_yaml(const Provenance& provenance);

}  // namespace waymark::internal
