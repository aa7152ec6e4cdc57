#include "waymark/cameras/v4l2/device_list.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <string_view>

#include <dirent.h>
#include <unistd.h>

#include "waymark/cameras/v4l2/controls.hpp"
#include "waymark/cameras/v4l2/device.hpp"
#include "waymark/cameras/v4l2/modes.hpp"
#include "waymark/robots/watchdog/device_file.hpp"

namespace waymark {
namespace {

constexpr std::string_view kPrefix = "video";
constexpr const char* kById = "/dev/v4l/by-id";

std::vector<std::string> names_in(const char* folder) {
  std::vector<std::string> names;
  DIR* entries = ::opendir(folder);
  if (entries == nullptr) return names;
  while (const dirent* entry = ::readdir(entries)) names.emplace_back(entry->d_name);  // NOLINT
  ::closedir(entries);
  return names;
}

std::vector<int> numbers_of_nodes() {
  std::vector<int> numbers;
  for (const std::string& name : names_in("/dev")) {
    int number = 0;
    const char* begin = name.data() + kPrefix.size();
    const char* end = name.data() + name.size();
    if (!name.starts_with(kPrefix) || begin == end) continue;
    const auto [stop, error] = std::from_chars(begin, end, number);
    if (error == std::errc() && stop == end) numbers.push_back(number);
  }
  std::ranges::sort(numbers);
  return numbers;
}

std::string last_name(std::string_view path) { return std::string(path.substr(path.rfind('/') + 1)); }

std::string target_of(const std::string& link) {
  std::array<char, 512> target{};
  const ssize_t length = ::readlink(link.c_str(), target.data(), target.size() - 1);
  return length > 0 ? std::string(target.data()) : std::string();
}

}  // namespace

std::string by_id_of(const std::string& path) {
  if (path.starts_with(kById)) return path;
  for (const std::string& name : names_in(kById)) {
    const std::string link = std::string(kById) + "/" + name;
    if (const std::string target = target_of(link); !target.empty() && last_name(target) == last_name(path))
      return link;
  }
  return {};
}

Result<CameraDevice> describe_camera(const std::string& path) {
  const auto device = internal::open_device(path);
  if (!device) return tl::unexpected(device.error());
  auto described = internal::read_capabilities(device->number(), path);
  if (!described) return described;
  described->modes = internal::read_modes(device->number());
  described->controls = internal::read_controls(device->number());
  described->holder = holder_of(path);
  return described;
}

std::vector<CameraDevice> list_cameras() {
  std::vector<CameraDevice> devices;
  for (const int number : numbers_of_nodes()) {
    const std::string path = "/dev/video" + std::to_string(number);
    auto described = describe_camera(path);
    if (described)
      devices.push_back(std::move(*described));
    else if (described.error().code != ErrorCode::Unsupported)
      devices.push_back({.path = path, .by_id = by_id_of(path), .problem = described.error()});
  }
  return devices;
}

}  // namespace waymark
