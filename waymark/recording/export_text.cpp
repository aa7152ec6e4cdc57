#include <array>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/recording/export_progress.hpp"
#include "waymark/samples/corners.hpp"

namespace waymark {
namespace {

constexpr std::size_t kFlushBytes = 1 << 16;

/// Lines on their way into a file.
class Lines {
 public:
  explicit Lines(std::unique_ptr<ByteSink> sink) : sink_(std::move(sink)) {}
  template <class... Args>
  Status add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    return text_.size() >= kFlushBytes ? flush() : Status{};
  }
  Status flush() {
    Status status = sink_->write(as_bytes(text_));
    text_.clear();
    return status;
  }

 private:
  std::unique_ptr<ByteSink> sink_;
  std::string text_;
};

struct Kind {
  const char* name;
  const char* columns;
};
constexpr std::array kKinds = {
    Kind{"detections",
         "t_ns,camera,tag,hamming,decision_margin,tl_x_px,tl_y_px,tr_x_px,tr_y_px,br_x_px,br_y_px,bl_x_px,bl_"
         "y_px"},
    Kind{"odometry", "t_ns,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s"},
    Kind{"imu", "t_ns,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"},
    Kind{"range-bearing", "t_ns,landmark,range_m,bearing_rad"}};

const char* kind_of(const Sample& sample) {
  if (std::holds_alternative<TagFrame>(sample)) return kKinds[0].name;
  if (std::holds_alternative<Odometry>(sample)) return kKinds[1].name;
  if (std::holds_alternative<ImuSample>(sample)) return kKinds[2].name;
  if (std::holds_alternative<RangeBearing>(sample)) return kKinds[3].name;
  return "";
}

/// Writes one sample as the rows it takes: a tag frame as many as it has tags.
struct RowWriter {
  Lines& lines;
  ExportReport& report;

  static std::int64_t t_ns(SensorTime stamp) { return stamp.time_since_epoch().count(); }
  Status counted(Status status) const {
    ++report.messages;
    return status;
  }
  Status operator()(const TagFrame& s) const {
    for (const TagDetection& d : s.detections) {
      const auto& c = d.corners_px;
      Status status = counted(lines.add("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", t_ns(s.stamp), s.camera,
                                        to_string(d.tag), d.hamming, d.decision_margin, c[0].x(), c[0].y(),
                                        c[1].x(), c[1].y(), c[2].x(), c[2].y(), c[3].x(), c[3].y()));
      if (!status) return status;
    }
    return {};
  }
  Status operator()(const Odometry& s) const {
    const Eigen::Vector2d p = s.odom_T_base.translation();
    return counted(lines.add("{},{},{},{},{},{}\n", t_ns(s.stamp), p.x(), p.y(),
                             s.odom_T_base.rotation().log()(0), s.speed_m_s, s.yaw_rate_rad_s));
  }
  Status operator()(const ImuSample& s) const {
    const Eigen::Vector3d& g = s.angular_velocity_rad_s;
    const Eigen::Vector3d& a = s.linear_acceleration_m_s2;
    return counted(
        lines.add("{},{},{},{},{},{},{}\n", t_ns(s.stamp), g.x(), g.y(), g.z(), a.x(), a.y(), a.z()));
  }
  Status operator()(const RangeBearing& s) const {
    return counted(lines.add("{},{},{},{}\n", t_ns(s.stamp), s.landmark, s.range_m, s.bearing_rad));
  }
  template <class Other>
  Status operator()(const Other& /*sample*/) const {
    return {};
  }
};

/// The only kind that can be a table.
Result<std::string> only_kind(MessageLog& log, const LogSelection& selection) {
  std::set<std::string> found;
  Status status = log.visit_samples(selection, [&](const Sample& sample) {
    if (const std::string kind = kind_of(sample); !kind.empty()) found.insert(kind);
    return Status{};
  });
  if (!status) return tl::unexpected(status.error());
  if (found.size() == 1) return *found.begin();
  if (found.empty())
    return fail(ErrorCode::NotFound,
                "nothing in this recording fits a table of detections, odometry, imu or range-bearing");
  return fail(ErrorCode::InvalidArgument,
              fmt::format("the recording holds {}: a table takes one of them", fmt::join(found, ", ")), {},
              fmt::format("Say which: --kind {}.", *found.begin()));
}

}  // namespace

Result<ExportReport> export_csv(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                const ExportOptions& options) {
  std::string wanted = options.kind;
  if (wanted.empty()) {
    Result<std::string> only = only_kind(log, options.selection);
    if (!only) return tl::unexpected(only.error());
    wanted = *only;
  }
  const auto kind = std::ranges::find_if(kKinds, [&](const Kind& k) { return k.name == wanted; });
  if (kind == kKinds.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("no table of '{}'", wanted), {},
                "Known: detections, odometry, imu, range-bearing.");
  Lines lines(std::move(sink));
  ExportReport report;
  ExportProgress progress(log, options);
  Status status = lines.add("{}\n", kind->columns);
  if (status)
    status = log.visit_samples(options.selection, [&](const Sample& sample) -> Status {
      if (Status told = progress.at(log_time_of(sample)); !told) return told;
      return kind_of(sample) == wanted ? std::visit(RowWriter{lines, report}, sample) : Status{};
    });
  if (status) status = lines.flush();
  if (!status) return tl::unexpected(status.error());
  if (report.messages == 0)
    return fail(ErrorCode::NotFound, fmt::format("the recording holds no {} in what was chosen", wanted));
  report.by_topic[wanted] = report.messages;
  report.problems = log.problems();
  return report;
}

}  // namespace waymark
