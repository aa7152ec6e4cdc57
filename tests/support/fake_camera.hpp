#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <unistd.h>

namespace waymark::testing {

/// A folder for tests/fake_v4l2 with one camera, /dev/video0, and the environment variables that make it
/// visible; removed at the end.
class FakeCamera {
 public:
  FakeCamera()
      : folder_(std::filesystem::temp_directory_path() / ("fake_camera_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_ / "dev");
    setenv("FAKE_V4L2", folder_.c_str(), 1);
    set_faults("");
  }
  ~FakeCamera() {
    unsetenv("FAKE_V4L2");
    set_faults("");
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  FakeCamera(const FakeCamera&) = delete;
  FakeCamera& operator=(const FakeCamera&) = delete;

  /// Adds a mode that plays these bytes.
  void add_mode(const std::string& format, int width, int height, double rate_hz,
                const std::vector<std::uint8_t>& frames) {
    const std::string name = "frames" + std::to_string(modes_++);
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(frames.data()), static_cast<std::streamsize>(frames.size()));
    text_ += "mode " + format + " " + std::to_string(width) + " " + std::to_string(height) + " " +
             std::to_string(rate_hz) + " " + name + "\n";
    plug_in();
  }
  void add_line(const std::string& line) {
    text_ += line + "\n";
    plug_in();
  }
  void plug_in() const { std::ofstream(folder_ / "dev/video0") << text_; }
  void unplug() const { std::filesystem::remove(folder_ / "dev/video0"); }
  static void set_faults(const std::string& words) { setenv("FAKE_V4L2_FAULTS", words.c_str(), 1); }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
  std::string text_ = "card Fake camera\n";
  int modes_ = 0;
};

}  // namespace waymark::testing
