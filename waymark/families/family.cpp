#include "waymark/families/family.hpp"

#include <algorithm>
#include <cassert>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <mutex>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/message_text.hpp"
#include "waymark/families/apriltag_family.hpp"

namespace waymark {
namespace {

/// In the order of FamilyId.
constexpr std::array<std::string_view, kAllFamilies.size()> kNames = {
    "tag16h5",        "tag25h9",        "tag36h10",         "tag36h11",        "tagCircle21h7",
    "tagCircle49h12", "tagCustom48h12", "tagStandard41h12", "tagStandard52h13"};

std::size_t index_of(FamilyId id) {
  const auto index = static_cast<std::size_t>(id);
  assert(index < kNames.size());
  return index;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

/// Quotes untrusted text, shortened for use in a message.
std::string quoted(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  return fmt::format("'{}{}'", text.substr(0, kLongest), text.size() > kLongest ? "…" : "");
}

/// The family that an unknown name probably refers to: the one whose number ("36h11") the name contains, as
/// in "DICT_APRILTAG_36h11", or else the one with the most similar name. If several are equally similar,
/// tag36h11, the most common family, is preferred. Empty if no name is similar. `text` must be in lower case.
std::string nearest_family(const std::string& text) {
  for (const std::string_view name : kNames)
    if (text.find(name.substr(name.find_first_of("0123456789"))) != std::string::npos)
      return std::string(name);
  std::vector<std::string> names = {std::string(to_string(FamilyId::Tag36h11))};
  names.insert(names.end(), kNames.begin(), kNames.end());
  return nearest_word(text.starts_with("tag") ? text : "tag" + text, names);
}

/// Row-major index of a cell whose position is counted from the corner of the border square.
std::size_t index_of_cell(const Family& family, int x, int y) {
  const auto width = static_cast<std::size_t>(family.total_width);
  const int margin = (family.total_width - family.width_at_border) / 2;
  return static_cast<std::size_t>(y + margin) * width + static_cast<std::size_t>(x + margin);
}

/// Draws the ring of cells at distance `outset` from the border square (0 is the ring of outermost cells
/// inside it).
void draw_ring(std::vector<std::uint8_t>& cells, const Family& family, int outset, std::uint8_t value) {
  const int first = -outset;
  const int last = family.width_at_border - 1 + outset;
  const auto put = [&](int x, int y) { cells.at(index_of_cell(family, x, y)) = value; };
  for (int i = first; i <= last; ++i) {
    put(i, first);
    put(i, last);
    put(first, i);
    put(last, i);
  }
}

}  // namespace

const Family& family(FamilyId id) {
  struct Slot {
    std::once_flag once;
    Family family;
  };
  static std::array<Slot, kAllFamilies.size()> slots;
  Slot& slot = slots.at(index_of(id));
  std::call_once(slot.once, [&] { slot.family = load_family(id); });
  return slot.family;
}

std::string_view to_string(FamilyId id) { return kNames.at(index_of(id)); }

Result<FamilyId> parse_family(std::string_view text) {
  const std::string wanted = lower(text);
  for (const FamilyId id : kAllFamilies) {
    const std::string name = lower(to_string(id));
    if (wanted == name || "tag" + wanted == name) return id;
  }
  const std::string nearest = nearest_family(wanted);
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown tag family {}", quoted(text)), {},
              nearest.empty() ? fmt::format("Known: {}.", fmt::join(kNames, ", "))
                              : fmt::format("Did you mean '{}'?", nearest));
}

FamilyId usual_family(int largest_number) {
  for (const FamilyId id : {FamilyId::Tag36h11, FamilyId::TagStandard41h12}) {
    if (largest_number < std::ssize(family(id).codes)) return id;
  }
  return FamilyId::TagStandard52h13;
}

bool exists(const TagId& id) { return id.number >= 0 && id.number < std::ssize(family(id.family).codes); }

Result<TagId> parse_tag_id(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) {
    return fail(ErrorCode::InvalidArgument, fmt::format("{} is not a tag id", quoted(text)), {},
                "Write family and number, as in tag36h11:7.");
  }
  const Result<FamilyId> family_id = parse_family(text.substr(0, colon));
  if (!family_id) return tl::unexpected<Error>(family_id.error());
  const std::string_view digits = text.substr(colon + 1);
  const std::size_t count = family(*family_id).codes.size();
  const std::string hint = fmt::format("{} has the numbers 0 to {}.", to_string(*family_id), count - 1);
  std::uint32_t number = 0;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool all_read = failure == std::errc() && end == digits.data() + digits.size() && !digits.empty();
  if (!all_read || number >= count) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("no tag number {} in {}", quoted(digits), to_string(*family_id)), {}, hint);
  }
  return TagId{*family_id, static_cast<int>(number)};
}

std::string to_string(const TagId& id) { return fmt::format("{}:{}", to_string(id.family), id.number); }

std::vector<std::uint8_t> bitmap(const TagId& id) {
  constexpr std::uint8_t kBlack = 0;
  constexpr std::uint8_t kWhite = 255;
  constexpr std::uint8_t kNoPart = 128;
  const Family& table = family(id.family);
  if (id.number < 0 || static_cast<std::size_t>(id.number) >= table.codes.size()) return {};
  const auto width = static_cast<std::size_t>(table.total_width);
  std::vector<std::uint8_t> cells(width * width, kNoPart);
  draw_ring(cells, table, 0, table.reversed_border ? kWhite : kBlack);
  draw_ring(cells, table, 1, table.reversed_border ? kBlack : kWhite);
  const std::uint64_t code = table.codes.at(static_cast<std::size_t>(id.number));
  for (std::size_t i = 0; i < table.bits.size(); ++i) {
    const BitCell& bit = table.bits[i];
    const bool white = ((code >> (table.bits.size() - 1 - i)) & 1U) != 0;
    cells.at(index_of_cell(table, bit.x, bit.y)) = white ? kWhite : kBlack;
  }
  return cells;
}

namespace {

/// Parses a decimal number. Returns `beyond` if it does not fit in an int, and `nullopt` if the text is not a
/// number.
std::optional<int> number(std::string_view text, int beyond) {
  const bool digits =
      !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits) return std::nullopt;
  int value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc() ? value
                                : beyond;  // too large for an int, and so beyond the numbers of any family
}

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

/// Adds the numbers from an item such as "7" or "0-3".
Status add_item(const Family& family, std::string_view item, std::vector<int>& numbers) {
  const int count = static_cast<int>(family.codes.size());
  const std::string range_hint = fmt::format("{} has the numbers 0 to {}.", family.name, count - 1);
  const auto refuse = [&](std::string what, std::string hint) {
    return fail(ErrorCode::InvalidArgument, std::move(what), {.key = "ids"}, std::move(hint));
  };
  const std::size_t dash = item.find('-');
  const auto first = number(item.substr(0, dash), count);
  const auto last = dash == std::string_view::npos ? first : number(item.substr(dash + 1), count);
  if (!first || !last) {
    return refuse(fmt::format("'{}' is neither a tag number nor a range", item.substr(0, 40)),
                  "Write them as in 0-3,7,9.");
  }
  if (std::max(*first, *last) >= count) {
    return refuse(fmt::format("'{}' exceeds the tag numbers of {}", item.substr(0, 40), family.name),
                  range_hint);
  }
  if (*last < *first) {
    return refuse(fmt::format("the range {} is descending", item),
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
    // Each number need only be listed once, so a list much longer than the family is hostile.
    if (numbers.size() > 2 * family(id).codes.size()) {
      return fail(ErrorCode::LimitExceeded, "the list names more tags than the family has", {.key = "ids"},
                  "List each number once.");
    }
    if (comma == std::string_view::npos) return numbers;
    rest.remove_prefix(comma + 1);
  }
}

}  // namespace waymark
