#pragma once
// Inside the room: what cairo cannot say in a file, but a printer must know.

#include <cstdint>
#include <vector>

namespace waymark::plot {

/// Appends an update to a PDF that sets ViewerPreferences / PrintScaling to None (ISO 32000-1, 7.5.6 and
/// table 150), so that a print dialogue starts at 100 %. A PDF of another build than cairo 1.4-style (one
/// cross-reference table) stays as it is.
void ask_to_print_unscaled(std::vector<std::uint8_t>& pdf);

/// Inserts the pHYs chunk (PNG specification, 11.3.5.3) after the header.
void record_resolution(std::vector<std::uint8_t>& png, double dpi);

}  // namespace waymark::plot
