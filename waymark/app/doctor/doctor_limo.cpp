#include "waymark/app/doctor/doctor_limo.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace waymark {
namespace {

constexpr const char* kHowTo = "docs/howto/limo.md";

DoctorLine check_frames(const std::string& port, const LimoHeard& heard) {
  constexpr double kLeastRateHz = 20;
  if (heard.bytes == 0)
    return {"robot", DoctorLevel::Fail,
            port + ": no byte came: is LIMO on, is this the port of its mainboard?", kHowTo};
  if (heard.frames == 0)
    return {"robot", DoctorLevel::Fail,
            fmt::format("{}: {} bytes came, and no frame of LIMO among them", port, heard.bytes), kHowTo};
  const std::string words =
      fmt::format("{}: motion {:.0f} times a second, gyro {:.0f} times, {} of {} bytes damaged", port,
                  heard.motion_rate_hz, heard.gyro_rate_hz, heard.skipped_bytes, heard.bytes);
  const bool slow = heard.motion_rate_hz < kLeastRateHz || heard.gyro_rate_hz < kLeastRateHz;
  const bool damaged = 100 * heard.skipped_bytes > heard.bytes;
  return {"robot", slow || damaged ? DoctorLevel::Warn : DoctorLevel::Ok, words,
          slow || damaged ? kHowTo : ""};
}

DoctorLine check_battery(const LimoState& state) {
  constexpr double kLowVolts = 10.5;
  const bool low = state.battery_V < kLowVolts;
  return {"battery", low ? DoctorLevel::Warn : DoctorLevel::Ok, fmt::format("{:.1f} V", state.battery_V),
          low ? "Charge LIMO before a drive." : ""};
}

DoctorLine check_errors(const LimoState& state) {
  std::vector<std::string> words = error_words(state.errors);
  if (state.vehicle == LimoState::Vehicle::EmergencyStop) words.emplace_back("it is in emergency stop");
  if (state.vehicle == LimoState::Vehicle::Exception) words.emplace_back("it reports an exception");
  if (words.empty()) return {"errors", DoctorLevel::Ok, "LIMO reports none", ""};
  const bool stops = (state.errors & kLimoStoppingErrors) != 0 || state.vehicle != LimoState::Vehicle::Normal;
  return {"errors", stops ? DoctorLevel::Fail : DoctorLevel::Warn,
          fmt::format("LIMO says: {}", fmt::join(words, "; ")),
          stops ? "Switch LIMO off and on; it is not driven while it says so." : kHowTo};
}

DoctorLine check_drive(const LimoState& state) {
  return {"drive", DoctorLevel::Ok,
          fmt::format(
              "{}; {}", to_string(state.drive),
              state.commanded ? "it obeys this port" : "it does not obey this port yet: a drive asks for it"),
          state.drive == LimoDrive::Ackermann ? "--robot-file limo-ackermann" : ""};
}

}  // namespace

std::vector<DoctorLine> check_limo(const std::string& port, const LimoHeard& heard) {
  std::vector<DoctorLine> lines = {check_frames(port, heard)};
  if (heard.frames == 0) return lines;
  if (!heard.state) {
    lines.push_back({"errors", DoctorLevel::Fail, "LIMO's state (0x211) did not come", kHowTo});
    return lines;
  }
  lines.push_back(check_battery(*heard.state));
  lines.push_back(check_errors(*heard.state));
  lines.push_back(check_drive(*heard.state));
  return lines;
}

std::vector<DoctorLine> check_limo(const std::string& port, const DoctorCancelled& cancelled) {
  constexpr Duration kListen = std::chrono::milliseconds(1500);
  const auto heard = listen_to_limo(port, kListen, cancelled);
  if (heard) return check_limo(port, *heard);
  return {{"robot", DoctorLevel::Fail, port + ": " + heard.error().message, heard.error().hint}};
}

}  // namespace waymark
