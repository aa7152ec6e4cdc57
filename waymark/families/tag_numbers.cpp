#include "waymark/families/tag_numbers.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

#include <fmt/format.h>

namespace waymark {
namespace {

/// A number as it stands, whatever its size; nothing when it is none.
std::optional<int> number(std::string_view text, int beyond) {
  const bool digits =
      !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits) return std::nullopt;
  int value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc() ? value : beyond;  // too many digits for an int: no family has it either
}

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

/// Adds the numbers of "7" or "0-3".
Status add_item(const Family& family, std::string_view item, std::vector<int>& numbers) {
  const int count = static_cast<int>(family.codes.size());
  const std::string known = fmt::format("{} has the numbers 0 to {}.", family.name, count - 1);
  const auto refuse = [&](std::string what, std::string hint) {
    return fail(ErrorCode::InvalidArgument, std::move(what), {.key = "ids"}, std::move(hint));
  };
  const std::size_t dash = item.find('-');
  const auto first = number(item.substr(0, dash), count);
  const auto last = dash == std::string_view::npos ? first : number(item.substr(dash + 1), count);
  if (!first || !last) {
    return refuse(fmt::format("'{}' is no tag number and no range of them", item.substr(0, 40)),
                  "Write them as in 0-3,7,9.");
  }
  if (std::max(*first, *last) >= count) {
    return refuse(fmt::format("'{}' reaches beyond the numbers of {}", item.substr(0, 40), family.name),
                  known);
  }
  if (*last < *first) {
    return refuse(fmt::format("the range {} runs backwards", item),
                  fmt::format("Write {}-{}.", *last, *first));
  }
  for (int i = *first; i <= *last; ++i) numbers.push_back(i);
  return {};
}

}  // namespace

Result<std::vector<int>> parse_tag_numbers(FamilyId id, std::string_view text) {
  std::vector<int> numbers;
  std::string_view rest = text;
  while (true) {
    const std::size_t comma = rest.find(',');
    if (Status added = add_item(family(id), trimmed(rest.substr(0, comma)), numbers); !added)
      return tl::unexpected<Error>(added.error());
    // Each number once: more items than numbers is a list somebody made up to exhaust us.
    if (numbers.size() > 2 * family(id).codes.size()) {
      return fail(ErrorCode::LimitExceeded, "the list names more tags than the family has", {.key = "ids"},
                  "Name each number once.");
    }
    if (comma == std::string_view::npos) return numbers;
    rest.remove_prefix(comma + 1);
  }
}

}  // namespace waymark
