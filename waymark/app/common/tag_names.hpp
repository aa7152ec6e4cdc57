#pragma once

#include <span>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/families/family.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// The families that a run searches for; they determine the family of a tag that is given as a number. If
/// empty (the run does not detect tags, or the families are not determined yet), the number refers to
/// tag36h11.
using SearchedFamilies = std::span<const FamilyId>;

/// The families for which a finder searches that was made from DetectorOptions.
[[nodiscard]] std::vector<FamilyId> families_of(const TagFinder& finder);

/// Parses "tag36h11:7" or "7". Fails on a number if several families are searched for, and on a tag of a
/// family that is not searched for. Errors name the field that contains the text, if any.
[[nodiscard]] Result<TagId> tag_named(const std::string& text, const char* field = nullptr,
                                      SearchedFamilies families = {});
/// Parses several texts, each a comma-separated list of tags such as "3,tag36h11:7". Errors name this field.
[[nodiscard]] Result<std::vector<TagId>> tags_named(const std::vector<std::string>& texts, const char* field,
                                                    SearchedFamilies families = {});

/// Parses tag sizes: "0.16" applies to all tags, "tag36h11:7=0.08" or "7=0.08" to one tag (see tag_named()).
/// Fails on sizes that check_printed_size() rejects, and if one tag is given two different sizes.
[[nodiscard]] Result<TagSizes> parse_tag_sizes(const std::vector<std::string>& words,
                                               SearchedFamilies families = {});

}  // namespace waymark
