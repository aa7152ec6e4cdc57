#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// The nine tag families of AprilTag 3.
enum class FamilyId : std::uint8_t {
  Tag16h5,
  Tag25h9,
  Tag36h10,
  Tag36h11,
  TagCircle21h7,
  TagCircle49h12,
  TagCustom48h12,
  TagStandard41h12,
  TagStandard52h13,
};
inline constexpr std::array kAllFamilies = {
    FamilyId::Tag16h5,        FamilyId::Tag25h9,          FamilyId::Tag36h10,
    FamilyId::Tag36h11,       FamilyId::TagCircle21h7,    FamilyId::TagCircle49h12,
    FamilyId::TagCustom48h12, FamilyId::TagStandard41h12, FamilyId::TagStandard52h13};

/// One printed tag: family and number, written as "tag36h11:7".
struct TagId {
  FamilyId family = FamilyId::Tag36h11;
  int number = 0;

  friend auto operator<=>(const TagId&, const TagId&) = default;
};

/// Position of the cell of a data bit, in cells from the TL corner of the square where the black and the
/// white border meet (x right, y down). Cells outside [0, width_at_border) lie outside the border (in
/// families with outer data bits).
struct BitCell {
  int x = 0;
  int y = 0;
};

/// The layout and the codes of a family (Krogius, Haggenmiller and Olson, "Flexible layouts for fiducial
/// tags", IROS 2019).
struct Family {
  FamilyId id = FamilyId::Tag36h11;
  std::string name;  ///< e.g. "tag36h11"
  int width_at_border =
      0;  ///< [cell] side of the square where the black and the white border meet (the "size" of a tag)
  int total_width = 0;  ///< [cell] side of the whole tag, including the white margin it needs
  bool reversed_border =
      false;                  ///< a white square with a black surround (circle, custom and standard families)
  int min_hamming = 0;        ///< nominal minimum distance between two codes under any rotation
  std::vector<BitCell> bits;  ///< cell of each data bit, with the most significant bit of a code first
  std::vector<std::uint64_t> codes;  ///< code of each id, with bits.size() bits
};

/// The table for a family, built on first use. O(1) after the first call; thread-safe.
[[nodiscard]] const Family& family(FamilyId id);

/// Parses names such as "tag36h11"; also accepts "36h11" and "Standard41h12", case-insensitively. For an
/// unknown name, the error suggests the most similar family (tag36h11 if several are equally similar) or
/// lists all of them.
[[nodiscard]] Result<FamilyId> parse_family(std::string_view text);
[[nodiscard]] std::string_view to_string(FamilyId id);

/// The family assumed for tags that are given without one: tag36h11, or tagStandard41h12 or tagStandard52h13
/// if the largest number does not exist in it.
[[nodiscard]] FamilyId usual_family(int largest_number);

/// Whether the number exists in the family.
[[nodiscard]] bool exists(const TagId& id);
/// Parses ids such as "tag36h11:7"; the number must exist in the family.
[[nodiscard]] Result<TagId> parse_tag_id(std::string_view text);
[[nodiscard]] std::string to_string(const TagId& id);

/// The printed tag, one byte per cell: 0 is black, 255 is white, and 128 is not part of the tag (e.g. the
/// corners of a circle family). The bitmap is total_width x total_width, row by row from the TL corner as
/// seen by a viewer of the print.
[[nodiscard]] std::vector<std::uint8_t> bitmap(const TagId& id);

/// Parses a list of tag numbers: "0-3,7,9" results in 0 1 2 3 7 9, in the order written. Fails with
/// InvalidArgument if the text is not such a list, a range is descending, or a number does not exist in the
/// family. Fails with LimitExceeded if the list has far more items than the family has numbers.
[[nodiscard]] Result<std::vector<int>> parse_tag_numbers(FamilyId family, std::string_view text);

}  // namespace waymark
