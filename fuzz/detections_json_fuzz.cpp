// Any text is either a list of reports that round-trips, or an Error with a place.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "waymark/app/common/detect_all.hpp"
#include "waymark/app/common/report_fields.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto reports = waymark::parse_reports({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!reports) {
    if (reports.error().message.empty() || reports.error().place.source != "fuzz") std::abort();
    return 0;
  }
  std::string text;
  for (auto report : *reports) {
    if (!report.error && report.width_px <= 0) report.width_px = report.height_px = 1;  // an image has a size
    text += waymark::json_line(fields(waymark::ImageLine{.report = report, .with_covariance = true}));
  }
  const auto again = waymark::parse_reports(text, "again");
  if (!again || again->size() != reports->size()) std::abort();
  return 0;
}
