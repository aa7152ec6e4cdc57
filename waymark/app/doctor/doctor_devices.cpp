#include <algorithm>
#include <filesystem>
#include <system_error>

#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/doctor/doctor_network.hpp"
#include "waymark/robots/limo/serial_port.hpp"
#include "waymark/robots/watchdog/device_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> gamepads() {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/dev/input", error))
    if (entry.path().filename().string().starts_with("js")) found.push_back(entry.path().string());
  std::ranges::sort(found);
  return found;
}

/// One line a kind of device, and one a device that this user may not open.
void add_kind(const std::string& key, const std::string& what, const std::vector<std::string>& paths,
              std::vector<DoctorLine>& lines) {
  if (paths.empty()) return;
  const std::size_t before = lines.size();
  for (const std::string& path : paths) {
    if (::access(path.c_str(), R_OK | W_OK) == 0) continue;
    const Error error = no_permission(path, what, "ls -l " + path);
    lines.push_back({key, DoctorLevel::Warn, path + ": " + error.message, error.hint});
  }
  if (lines.size() == before)
    lines.push_back({key, DoctorLevel::Ok, fmt::format("{} may be opened", fmt::join(paths, ", ")), ""});
}

}  // namespace

std::vector<DoctorLine> check_devices() {
  std::vector<DoctorLine> lines;
  add_kind("serial", "the serial port", list_serial_ports(), lines);
  add_kind("gamepad", "the gamepad", gamepads(), lines);
  return lines;
}

}  // namespace waymark
