// Implements load_family() without libapriltag, from the header that write_family_tables wrote.
#include <algorithm>
#include <iterator>

#include "family_table_row.hpp"
#include "family_tables.hpp"
#include "waymark/families/apriltag_family.hpp"

namespace waymark {

/// A family outside the tables has a name and no codes, so none of its tags are detected.
Family load_family(FamilyId id) {
  Family family;
  family.id = id;
  family.name = to_string(id);
  const auto* row = std::ranges::find(web::kFamilyTables, id, &web::FamilyTableRow::id);
  if (row == std::end(web::kFamilyTables)) return family;
  family.width_at_border = row->width_at_border;
  family.total_width = row->total_width;
  family.reversed_border = row->reversed_border;
  family.min_hamming = row->min_hamming;
  family.bits.assign(row->bits.begin(), row->bits.end());
  family.codes.assign(row->codes.begin(), row->codes.end());
  return family;
}

}  // namespace waymark
