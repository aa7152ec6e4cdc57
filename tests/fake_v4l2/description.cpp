#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/fake_v4l2/fake_device.hpp"

namespace fake_v4l2 {

Description read_description(const std::string& path) {
  Description about;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key >> std::ws;
    if (key == "card") std::getline(words, about.card);
    if (key == "stamps") words >> about.stamps;
    if (key == "latency_ms") words >> about.latency_ms;
    if (key == "controls") about.controls = false;
    if (key != "mode") continue;
    Mode mode;
    std::string fourcc;
    words >> fourcc >> mode.width >> mode.height >> mode.rate_hz >> mode.file;
    fourcc.resize(4, ' ');
    mode.fourcc = v4l2_fourcc(static_cast<unsigned char>(fourcc[0]), static_cast<unsigned char>(fourcc[1]),
                              static_cast<unsigned char>(fourcc[2]), static_cast<unsigned char>(fourcc[3]));
    about.modes.push_back(mode);
  }
  return about;
}

std::optional<std::uint64_t> fault(const std::string& name) {
  const char* set = std::getenv("FAKE_V4L2_FAULTS");  // NOLINT(concurrency-mt-unsafe)
  std::istringstream words(set == nullptr ? "" : set);
  for (std::string word; std::getline(words, word, ',');) {
    const std::size_t colon = word.find(':');
    if (word.substr(0, colon) != name) continue;
    return colon == std::string::npos ? 0 : std::strtoull(word.c_str() + colon + 1, nullptr, 10);
  }
  return std::nullopt;
}

}  // namespace fake_v4l2
