#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/recording/csv_table.hpp"
#include "waymark/recording/csv_text.hpp"

namespace waymark::csv {
namespace {

struct Layout {
  Kind kind;
  std::string_view name;
  std::string_view topic;
  std::vector<std::string_view> columns;
};

/// The first one whose columns are all there is taken.
const std::vector<Layout>& layouts() {
  static const std::vector<Layout> kLayouts = {
      {Kind::TagCorners,
       "tag corners",
       "/tag_detections",
       {"cam", "tag", "x0", "y0", "x1", "y1", "x2", "y2", "x3", "y3"}},
      {Kind::Detections,
       "detections",
       "/tag_detections",
       {"camera", "tag", "tl_x_px", "tl_y_px", "tr_x_px", "tr_y_px", "br_x_px", "br_y_px", "bl_x_px",
        "bl_y_px"}},
      {Kind::RangeBearing, "range and bearing", "/range_bearing", {"landmark", "range_m", "bearing_rad"}},
      {Kind::Odometry, "odometry", "/odom", {"x_m", "y_m", "theta_rad", "speed_m_s", "yaw_rate_rad_s"}},
      {Kind::OdometrySpeeds, "odometry speeds", "/odom", {"v_m_s", "omega_rad_s"}},
      {Kind::OdometryPoses, "odometry poses", "/odom", {"body", "px", "py", "pz", "qx", "qy", "qz", "qw"}},
      {Kind::Imu,
       "inertial measurements",
       "/imu",
       {"gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s", "accel_x_m_s2", "accel_y_m_s2", "accel_z_m_s2"}},
      {Kind::Truth, "true poses", "/truth/pose", {"x_m", "y_m", "theta_rad", "valid"}}};
  return kLayouts;
}

const Layout& layout(Kind kind) { return *std::ranges::find(layouts(), kind, &Layout::kind); }

}  // namespace

std::string known_columns() {
  std::string text;
  for (const Layout& one : layouts())
    text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", one.name, fmt::join(one.columns, ","));
  return text;
}

std::string_view name_of(Kind kind) { return layout(kind).name; }
std::string_view topic_of(Kind kind) { return layout(kind).topic; }

Result<Header> Header::parse(std::string_view line, const std::string& source) {
  if (line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
  std::vector<std::string_view> names;
  split(line, names);
  Header header;
  header.columns_ = names.size();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!header.at_.try_emplace(std::string(names[i]), i).second)
      return fail(ErrorCode::Unreadable, fmt::format("the column '{}' stands twice", names[i]),
                  {.source = source, .line = 1});
  }
  const auto ns = header.find("t_ns");
  const auto s = header.find("t_s");
  if (!ns && !s)
    return fail(ErrorCode::Unsupported, "a table without a column of time", {.source = source, .line = 1},
                "Name it t_ns (nanoseconds) or t_s (seconds).");
  header.time_ = ns ? *ns : *s;
  header.seconds_ = !ns;
  for (const Layout& one : layouts()) {
    const bool fits = std::ranges::all_of(
        one.columns, [&](std::string_view name) { return header.find(name).has_value(); });
    // A pose with covariances is somebody's estimate, not what a robot measured.
    if (!fits || (one.kind == Kind::OdometryPoses && header.find("cov0"))) continue;
    header.kind_ = one.kind;
    return header;
  }
  return fail(ErrorCode::Unsupported, "a table of columns we do not know", {.source = source, .line = 1},
              "Known, beside t_ns or t_s: " + known_columns() + ".");
}

std::optional<std::size_t> Header::find(std::string_view name) const {
  const auto it = at_.find(name);
  return it == at_.end() ? std::nullopt : std::optional(it->second);
}

std::optional<std::int64_t> Header::time(const std::vector<std::string_view>& cells) const {
  // So that no difference of two stamps overflows.
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / 2;
  const auto ns = seconds_ ? seconds_as_ns(cells[time_]) : integer(cells[time_]);
  return ns && *ns >= -kMost && *ns <= kMost ? ns : std::nullopt;
}

}  // namespace waymark::csv
