// Prints the contents of a recording as lines, for comparison with other programs:
//   dump_log FILE            topic TAB log time [ns] TAB bytes TAB crc32 TAB crc32 of the message as CDR
//   dump_log --samples FILE  kind of sample TAB stamp [ns] TAB its numbers
//   dump_log --channels FILE topic TAB type TAB encoding TAB number of messages TAB crc32 of the ROS 2 schema
// Problems follow on standard error: kind, key, count, message.
#include <cstdio>
#include <cstring>
#include <type_traits>

#include <fmt/format.h>

#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/compression.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

void print(const std::string& line) { std::fputs((line + "\n").c_str(), stdout); }

CdrChannels::Note to_stderr() {
  return [](LogProblem::Kind, const std::string& key, const Error& error) {
    std::fputs(fmt::format("note\t{}\t1\t{}\n", key, to_string(error)).c_str(), stderr);
  };
}

Status dump_messages(MessageLog& log) {
  CdrChannels cdr(to_stderr());
  return log.visit({}, [&](const LogChannel& channel, const LogMessage& message) {
    const auto converted = cdr.convert(channel, message);
    print(fmt::format("{}\t{}\t{}\t{:08x}\t{:08x}", channel.topic, message.log_time, message.data.size(),
                      crc32(message.data), converted ? crc32(converted->data) : 0U));
    return Status{};
  });
}

void dump_channels(const MessageLog& log) {
  CdrChannels cdr(to_stderr());
  for (const LogChannel& channel : log.channels()) {
    const CdrChannels::Channel* rewritten = cdr.channel(channel);
    print(fmt::format("{}\t{}\t{}\t{}\t{}", channel.topic, channel.type, channel.encoding,
                      channel.messages.value_or(0), rewritten != nullptr ? rewritten->channel.schema : ""));
  }
}

struct SampleText {
  std::string operator()(const TagFrame& s) const {
    std::string text = fmt::format("tags\t{}\t{}\t{}", stamp_of(s).time_since_epoch().count(), s.camera,
                                   s.detections.size());
    for (const TagDetection& d : s.detections) {
      text += fmt::format("\t{}:{}", to_string(d.tag), d.hamming);
      for (const auto& c : d.corners_px) text += fmt::format(",{:.3f},{:.3f}", c.x(), c.y());
    }
    return text;
  }
  std::string operator()(const TagPoseFrame& s) const {
    std::string text =
        fmt::format("tag_poses\t{}\t{}", stamp_of(s).time_since_epoch().count(), s.tags.size());
    for (const SeenTagPose& t : s.tags) {
      const Eigen::Vector3d p = t.cam_T_tag.translation();
      const auto q = t.cam_T_tag.rotation().quaternion();
      text += fmt::format("\t{} {:.7f} {:.7f} {:.7f} {:.6f} {:.6f} {:.6f} {:.6f}", to_string(t.tag), p.x(),
                          p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
    }
    return text;
  }
  std::string operator()(const Odometry& s) const {
    return fmt::format("odometry\t{}\t{:.7f} {:.7f} {:.7f} {:.7f} {:.7f}",
                       stamp_of(s).time_since_epoch().count(), s.odom_T_base.translation().x(),
                       s.odom_T_base.translation().y(), s.odom_T_base.rotation().log()(0), s.speed_m_s,
                       s.yaw_rate_rad_s);
  }
  std::string operator()(const WheelTicks& s) const {
    return fmt::format("wheels\t{}\t{:.9f} {:.9f}", stamp_of(s).time_since_epoch().count(), s.left_rad,
                       s.right_rad);
  }
  std::string operator()(const ImuSample& s) const {
    const auto& g = s.angular_velocity_rad_s;
    const auto& a = s.linear_acceleration_m_s2;
    return fmt::format("imu\t{}\t{:.7f} {:.7f} {:.7f} {:.6f} {:.6f} {:.6f}",
                       stamp_of(s).time_since_epoch().count(), g.x(), g.y(), g.z(), a.x(), a.y(), a.z());
  }
  std::string operator()(const StampedCommand& s) const {
    return fmt::format("command\t{}\t{:.7f} {:.7f}", stamp_of(s).time_since_epoch().count(),
                       s.command.speed_m_s, s.command.yaw_rate_rad_s);
  }
  std::string operator()(const TruthPose& s) const {
    const Eigen::Vector3d p = s.map_T_base.translation();
    return fmt::format("truth\t{}\t{:.7f} {:.7f} {:.7f}", stamp_of(s).time_since_epoch().count(), p.x(),
                       p.y(), p.z());
  }
  std::string operator()(const RangeBearing& s) const {
    return fmt::format("range_bearing\t{}\t{} {:.7f} {:.7f}", stamp_of(s).time_since_epoch().count(),
                       s.landmark, s.range_m, s.bearing_rad);
  }
  std::string operator()(const CameraFrame& s) const {
    return fmt::format("image\t{}\t{}x{}", stamp_of(s).time_since_epoch().count(), s.image.width(),
                       s.image.height());
  }
  std::string operator()(const LaserScan& s) const {
    return fmt::format("scan\t{}\t{}", stamp_of(s).time_since_epoch().count(), s.ranges_m.size());
  }
  std::string operator()(const GamepadState& s) const {
    return fmt::format("gamepad\t{}\t{} {}", stamp_of(s).time_since_epoch().count(), s.axes.size(),
                       s.buttons.size());
  }
};

Status dump_samples(MessageLog& log) {
  return log.visit_samples({}, [](const Sample& sample) {
    print(std::visit(SampleText{}, sample));
    return Status{};
  });
}

int run(const char* what, const char* file) {
  const auto log = open_log(std::filesystem::path(file));
  if (!log) {
    std::fputs((to_string(log.error()) + "\n").c_str(), stderr);
    return 1;
  }
  Status status;
  if (std::strcmp(what, "--channels") == 0) {
    dump_channels(**log);
  } else {
    status = std::strcmp(what, "--samples") == 0 ? dump_samples(**log) : dump_messages(**log);
  }
  std::fputs(fmt::format("log\t{}\t{}\t{}\n", to_string((*log)->format()),
                         (*log)->summary().messages.value_or(0), (*log)->description())
                 .c_str(),
             stderr);
  for (const LogProblem& p : (*log)->problems()) {
    std::fputs(fmt::format("{}\t{}\t{}\t{}\n", p.kind == LogProblem::Kind::Damage ? "damage" : "trap", p.key,
                           p.count, to_string(p.error))
                   .c_str(),
               stderr);
  }
  if (!status) std::fputs((to_string(status.error()) + "\n").c_str(), stderr);
  return status ? 0 : 1;
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  return waymark::run(argc > 2 ? argv[1] : "", argv[argc - 1]);
}
