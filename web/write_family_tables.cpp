// Writes the families that fit into a page as a header: layout and codes, from libapriltag through the room
// families. usage: write_family_tables > family_tables.hpp

#include <cstddef>
#include <cstdio>
#include <string>

#include <fmt/format.h>

#include "waymark/families/family.hpp"

namespace {

/// The other three families have more than 40 000 codes each and would make the page four times as large.
constexpr std::size_t kMaxCodes = 10000;

std::string table(const waymark::Family& family) {
  std::string bits;
  std::string codes;
  for (const waymark::BitCell& bit : family.bits) bits += fmt::format("{{{}, {}}}, ", bit.x, bit.y);
  for (const std::uint64_t code : family.codes) codes += fmt::format("{:#x}, ", code);
  return fmt::format(
      "inline constexpr BitCell k{0}Bits[] = {{{1}}};\ninline constexpr std::uint64_t k{0}Codes[] = "
      "{{{2}}};\n",
      family.name, bits, codes);
}

std::string row(const waymark::Family& family) {
  return fmt::format("    {{FamilyId{{{}}}, {}, {}, {}, {}, k{}Bits, k{}Codes}},\n",
                     static_cast<int>(family.id), family.width_at_border, family.total_width,
                     family.reversed_border, family.min_hamming, family.name, family.name);
}

}  // namespace

int main() {
  std::string tables;
  std::string rows;
  for (const waymark::FamilyId id : waymark::kAllFamilies) {
    const waymark::Family& family = waymark::family(id);
    if (family.codes.size() > kMaxCodes) continue;
    tables += table(family);
    rows += row(family);
  }
  const std::string text = fmt::format(
      "#pragma once\n// Written by web/write_family_tables.cpp; family_table_row.hpp comes before it.\n\n"
      "namespace waymark::web {{\n\n{}\ninline constexpr FamilyTableRow kFamilyTables[] = {{\n{}}};\n\n"
      "}}  // namespace waymark::web\n",
      tables, rows);
  return std::fputs(text.c_str(), stdout) < 0 ? 1 : 0;
}
