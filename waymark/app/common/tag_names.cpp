#include "waymark/app/common/tag_names.hpp"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace waymark {
namespace {

Result<TagId> parse_tag(const std::string& text, SearchedFamilies families) {
  const bool only_digits = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
  if (only_digits && families.size() > 1) {
    std::vector<std::string> candidates;
    for (const FamilyId id : families) candidates.push_back(fmt::format("{}:{}", to_string(id), text));
    return fail(ErrorCode::InvalidArgument,
                fmt::format("ambiguous tag '{}': {} families are searched for", text, families.size()), {},
                fmt::format("Include the family: {}.", fmt::join(candidates, " or ")));
  }
  const FamilyId usual = families.empty() ? FamilyId::Tag36h11 : families.front();
  Result<TagId> tag = parse_tag_id(only_digits ? fmt::format("{}:{}", to_string(usual), text) : text);
  if (!tag || families.empty() || std::ranges::find(families, tag->family) != families.end()) return tag;
  std::vector<std::string_view> names;
  for (const FamilyId id : families) names.push_back(to_string(id));
  return fail(ErrorCode::InvalidArgument,
              fmt::format("{} cannot be found, because the search is limited to {}", to_string(*tag),
                          fmt::join(names, ", ")),
              {}, fmt::format("Add `family={}`, or omit this tag.", to_string(tag->family)));
}

Result<double> parse_size_m(const std::string& text, const std::string& whole) {
  double size_m = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), size_m);
  if (error == std::errc() && end == text.data() + text.size() && check_printed_size(size_m, {}))
    return size_m;
  return fail(
      ErrorCode::InvalidArgument,
      fmt::format("'{}' is not a size in metres from {} to {}", whole, kMinTagSize_m, kMaxTagSize_m),
      {.key = "tag_size_m"},
      "Measure the side of the square where black border meets white, for example `tag_size_m=0.16`." +
          (error == std::errc() ? size_in_metres(size_m) : std::string()));
}

tl::unexpected<Error> two_sizes(const std::string& tags, double first_m, double second_m) {
  return fail(ErrorCode::InvalidArgument,
              fmt::format("two sizes for {}: {} and {} m", tags, first_m, second_m), {.key = "tag_size_m"},
              "Give one size for each tag, and one for all others.");
}

}  // namespace

std::vector<FamilyId> families_of(const TagFinder& finder) {
  const auto ids = chosen_families(finder.tracking.detector);
  return ids ? *ids : std::vector<FamilyId>();
}

Result<TagId> tag_named(const std::string& text, const char* field, SearchedFamilies families) {
  Result<TagId> tag = parse_tag(text, families);
  if (!tag && field != nullptr) tag.error().place.key = field;
  return tag;
}

Result<std::vector<TagId>> tags_named(const std::vector<std::string>& texts, const char* field,
                                      SearchedFamilies families) {
  std::vector<TagId> tags;
  for (std::string_view rest : texts) {
    do {
      const std::size_t end = std::min(rest.find(','), rest.size());
      Result<TagId> tag = tag_named(std::string(rest.substr(0, end)), field, families);
      if (!tag) return tl::unexpected(tag.error());
      tags.push_back(*tag);
      rest.remove_prefix(std::min(end + 1, rest.size()));
    } while (!rest.empty());
  }
  return tags;
}

Result<TagSizes> parse_tag_sizes(const std::vector<std::string>& words, SearchedFamilies families) {
  TagSizes sizes;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const Result<double> size =
        parse_size_m(equals == std::string::npos ? word : word.substr(equals + 1), word);
    if (!size) return tl::unexpected(size.error());
    if (equals == std::string::npos) {
      if (sizes.default_size_m && *sizes.default_size_m != *size)
        return two_sizes("tags", *sizes.default_size_m, *size);
      sizes.default_size_m = *size;
      continue;
    }
    const Result<TagId> tag = tag_named(word.substr(0, equals), "tag_size_m", families);
    if (!tag) return tl::unexpected(tag.error());
    const auto [entry, is_new] = sizes.size_by_tag_m.try_emplace(*tag, *size);
    if (!is_new && entry->second != *size) return two_sizes(to_string(*tag), entry->second, *size);
  }
  return sizes;
}

}  // namespace waymark
