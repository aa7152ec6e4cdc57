#include "waymark/app/doctor/doctor_network.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/robots/process/sender_watch.hpp"

namespace waymark {
namespace {

DoctorLine odometry_line(const NetworkHeard& heard, const std::string& howto) {
  constexpr double kLeastRateHz = 10;
  if (heard.odometries == 0)
    return {"robot", DoctorLevel::Fail,
            fmt::format("no odometry on {} in {:.1f} s{}{}", heard.odometry, heard.listened_s,
                        heard.there.empty() ? "" : "; ", heard.there),
            howto};
  const double rate_Hz = heard.odometries / (heard.listened_s * heard.sim_pace.value_or(1));
  const bool slow = rate_Hz < kLeastRateHz;
  return {"robot", slow ? DoctorLevel::Warn : DoctorLevel::Ok,
          fmt::format("odometry on {} {:.0f} times a {}second", heard.odometry, rate_Hz,
                      heard.sim_pace ? "simulated " : ""),
          slow ? howto : ""};
}

DoctorLine clock_line(double behind_s) {
  constexpr double kApart_s = 0.1;
  const bool apart = std::abs(behind_s) > kApart_s;
  return {"clock", apart ? DoctorLevel::Warn : DoctorLevel::Ok,
          apart
              ? fmt::format("the robot's stamps are {:.2f} s {} this computer's clock: pictures of a camera "
                            "of this computer do not fit to them",
                            std::abs(behind_s), behind_s > 0 ? "behind" : "ahead of")
              : fmt::format("the robot's stamps come within {:.0f} ms of this computer's clock",
                            1e3 * std::abs(behind_s)),
          apart ? "chronyc tracking, on both computers" : ""};
}

DoctorLine commands_line(const NetworkHeard& heard, const std::string& howto) {
  if (heard.others_commands >= kCommandsOfADriver)
    return {"commands", DoctorLevel::Fail,
            fmt::format("another program commands this robot on {}{}", heard.commands,
                        heard.driver.empty() ? "" : ": " + heard.driver),
            "End that program; two drivers make a robot obey both in turn."};
  if (heard.silent_publishers > 0)
    return {"commands", DoctorLevel::Warn,
            fmt::format("{} {} on {} as well, and sent nothing in {:.1f} s{}",
                        heard.silent_publishers == 1 ? "another program" : "other programs",
                        heard.silent_publishers == 1 ? "publishes" : "publish", heard.commands,
                        heard.listened_s, heard.silent_names.empty() ? "" : ": " + heard.silent_names),
            "End what drives the robot by itself; a drive is refused while it sends commands."};
  if (!heard.hears_commands)
    return {"commands", DoctorLevel::Fail, "nobody subscribes to " + heard.commands + ": it would not move",
            howto};
  return {"commands", DoctorLevel::Ok, "nobody else drives it on " + heard.commands, ""};
}

DoctorLine battery_line(const NetworkHeard& heard) {
  constexpr double kLow = 0.2;
  const bool low = heard.battery_share && *heard.battery_share < kLow;
  std::string words = fmt::format("{:.1f} V", *heard.battery_V);
  if (heard.battery_share) words += fmt::format(", {:.0f} %", 100 * *heard.battery_share);
  return {"battery", low ? DoctorLevel::Warn : DoctorLevel::Ok, words,
          low ? "Charge the robot before a drive." : ""};
}

}  // namespace

std::vector<DoctorLine> network_lines(const NetworkHeard& heard, const std::string& howto) {
  std::vector<DoctorLine> lines = {odometry_line(heard, howto)};
  if (heard.odometries == 0) return lines;
  lines.push_back(commands_line(heard, howto));
  if (heard.behind_s) lines.push_back(clock_line(*heard.behind_s));
  if (heard.sim_pace)
    lines.push_back({"clock", DoctorLevel::Ok,
                     fmt::format("simulated time runs {:.2f} times as fast as real time", *heard.sim_pace),
                     ""});
  if (heard.battery_V) lines.push_back(battery_line(heard));
  return lines;
}

}  // namespace waymark
