#include "waymark/plot/paper.hpp"

#include <cctype>
#include <charconv>
#include <optional>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"

namespace waymark::plot {
namespace {

constexpr double kSmallestSideMm = 20.0;
constexpr double kLargestSideMm = 5000.0;

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

std::optional<double> number(std::string_view text) {
  double value = 0.0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "300x400" or "300x400mm" as two numbers; nothing when it does not look like that.
std::optional<Paper> own_size(std::string_view text) {
  if (text.ends_with("mm")) text.remove_suffix(2);
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) return std::nullopt;
  const auto width_mm = number(text.substr(0, cross));
  const auto height_mm = number(text.substr(cross + 1));
  if (!width_mm || !height_mm) return std::nullopt;
  return Paper{std::string(text), *width_mm, *height_mm};
}

bool sane(double side_mm) { return side_mm >= kSmallestSideMm && side_mm <= kLargestSideMm; }

}  // namespace

const std::vector<Paper>& known_papers() {
  static const std::vector<Paper> papers = {
      {"A6", 105, 148},        {"A5", 148, 210},          {"Letter", 215.9, 279.4}, {"A4", 210, 297},
      {"Legal", 215.9, 355.6}, {"Tabloid", 279.4, 431.8}, {"A3", 297, 420},         {"A2", 420, 594},
      {"A1", 594, 841},        {"A0", 841, 1189},
  };
  return papers;
}

Result<Paper> parse_paper(std::string_view text) {
  const std::string wanted = lower(text.substr(0, 60));
  std::vector<std::string> names;
  for (const Paper& paper : known_papers()) {
    if (lower(paper.name) == wanted) return paper;
    names.push_back(paper.name);
  }
  if (const auto paper = own_size(wanted)) {
    if (sane(paper->width_mm) && sane(paper->height_mm)) return *paper;
    return fail(ErrorCode::InvalidArgument, fmt::format("paper of {} mm", paper->name), {.key = "paper"},
                fmt::format("Each side must be {} to {} mm.", kSmallestSideMm, kLargestSideMm));
  }
  std::string hint = suggestion(wanted, names);
  hint += fmt::format("{}Or give WIDTHxHEIGHT in millimetres, as in 300x400.", hint.empty() ? "" : " ");
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown paper '{}'", text.substr(0, 60)),
              {.key = "paper"}, hint);
}

}  // namespace waymark::plot
