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

/// One value of a YAML document with its line.
struct YamlNode {
  enum class Kind : std::uint8_t { Null, Scalar, Sequence, Map };

  Kind kind = Kind::Null;
  std::int64_t line = 1;                     ///< 1-based
  std::string text = {};                     ///< text of a scalar, unquoted
  std::vector<std::string> keys = {};        ///< keys of a map, in file order
  std::vector<std::int64_t> key_lines = {};  ///< lines of the keys
  std::vector<YamlNode> items = {};          ///< elements of a sequence, or values of a map (one per key)
};

/// Limits on a document. Exceeding them is an error, so that a document cannot exhaust memory or the stack.
struct YamlLimits {
  std::size_t bytes = std::size_t{1} << 20U;
  std::size_t nodes = 100'000;
  std::size_t depth = 64;
};

/// Parses a single document; `source` is its name in errors. Fails on invalid YAML, duplicate or non-scalar
/// keys, a second non-empty document, and exceeded limits. Anchors and aliases are Unsupported, because they
/// can expand a small file without bound. O(bytes · log keys).
[[nodiscard]] Result<YamlNode> parse_yaml(std::string_view text, const std::string& source,
                                          const YamlLimits& limits = {});

/// A position in a YAML tree with its file, line and dotted key, which it adds to every error. It is cheap to
/// copy and must not outlive the node.
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
  /// An error at this position.
  [[nodiscard]] tl::unexpected<Error> fail_here(ErrorCode code, std::string message,
                                                std::string hint = {}) const {
    return fail(code, std::move(message), place(), std::move(hint));
  }

  /// The value of a map's key; empty if it is missing or null.
  [[nodiscard]] std::optional<YamlCursor> find(std::string_view key) const;
  /// The value of a required key.
  [[nodiscard]] Result<YamlCursor> at(std::string_view key) const;
  /// Reads the value of a required key with `read`: `root.read_at("fx", &YamlCursor::number)`.
  template <class Read>
  [[nodiscard]] auto read_at(std::string_view key, Read&& read) const
      -> std::invoke_result_t<Read, const YamlCursor&> {
    const Result<YamlCursor> value = at(key);
    if (!value) return tl::unexpected<Error>(value.error());
    return std::invoke(std::forward<Read>(read), *value);
  }
  /// All values of a sequence or a map.
  [[nodiscard]] std::vector<YamlCursor> children() const;

  /// Fails unless this is a map (or null) with no keys other than these; the error suggests the nearest of
  /// them.
  [[nodiscard]] Status check_keys(const std::vector<std::string>& known) const;

  /// A finite number.
  [[nodiscard]] Result<double> number() const;
  /// An integer in [low, high].
  [[nodiscard]] Result<std::int64_t> integer(std::int64_t low, std::int64_t high) const;
  /// true or false.
  [[nodiscard]] Result<bool> boolean() const;
  [[nodiscard]] Result<std::string> text() const;
  /// A list of finite numbers of any length.
  [[nodiscard]] Result<std::vector<double>> numbers() const;
  /// A list of exactly `count` finite numbers.
  [[nodiscard]] Result<std::vector<double>> exactly_numbers(std::size_t count) const;

 private:
  [[nodiscard]] YamlCursor child(std::size_t index) const;
  [[nodiscard]] tl::unexpected<Error> not_a(std::string_view what) const;

  const YamlNode* node_;
  std::string source_;
  std::string key_;
};

/// The shortest decimal that reads back as the same double, and that every YAML reader reads as a
/// floating-point number: "1.0", "1.0e-05". The value must be finite.
[[nodiscard]] std::string yaml_number(double value);

/// The text unquoted if YAML reads it as a string, else in double quotes with escapes.
[[nodiscard]] std::string yaml_text(std::string_view text);

/// "[1.0, 2.5]".
[[nodiscard]] std::string yaml_list(std::span<const double> values);

}  // namespace waymark

namespace waymark::internal {

/// Larger values (in SI units) are mistakes, and would overflow when squared.
inline constexpr double kOutOfProportion = 1e6;

/// Fails if one of the numbers exceeds this limit.
[[nodiscard]] Status check_proportion(const YamlCursor& cursor, std::span<const double> values);

/// Reads several numbers from a map and keeps the first error.
class Numbers {
 public:
  explicit Numbers(const YamlCursor& cursor) : cursor_(cursor) {}

  double operator()(std::string_view key);
  /// A number whose key may be missing.
  double optional(std::string_view key, double fallback);
  /// A number greater than 0.
  double positive(std::string_view key);
  /// A number greater than 0 and at most `most`; larger values suggest a wrong unit.
  double plausible(std::string_view key, double most, std::string_view unit);
  double optional_positive(std::string_view key, double fallback);
  /// A number from low to high, whose key may be missing.
  double optional_within(std::string_view key, double fallback, double low, double high);
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  const YamlCursor& cursor_;
  Status status_;
};

/// Origin of a file as text, in file order: its optional key `provenance`.
using Provenance = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] Result<Provenance> read_provenance(const YamlCursor& root);
[[nodiscard]] std::string provenance_yaml(const Provenance& provenance);

/// The root key that declares how many entries a written file contains, and what the entries are called.
struct EntryCount {
  const char* key;      ///< "tag_count"
  const char* entries;  ///< "tags"
};

/// The file `head`, `count.key: number`, `body`, `end: number`. The last line lets readers recognise a file
/// that was cut at a line boundary, which is still valid YAML.
[[nodiscard]] std::string yaml_with_end(std::string_view head, const EntryCount& count, std::size_t number,
                                        std::string_view body);
/// Fails if a file of yaml_with_end() is truncated, or if it does not contain `number` entries. Files with
/// neither of the two keys (written by hand or by an earlier program) are accepted.
[[nodiscard]] Status check_end(const YamlCursor& root, const EntryCount& count, std::size_t number);

}  // namespace waymark::internal
