#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <linux/videodev2.h>

/// A Video4Linux camera that plays a file of frames (README.md). State and ioctl calls; the caller locks.
namespace fake_v4l2 {

struct Mode {
  std::uint32_t fourcc = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  double rate_hz = 30;
  std::string file{};
};

struct Description {
  std::string card = "Fake camera";
  std::vector<Mode> modes{};
  std::string stamps = "soe";
  double latency_ms = 20;
  bool controls = true;
};
[[nodiscard]] Description read_description(const std::string& path);

/// The number of a fault of FAKE_V4L2_FAULTS ("short:10"); 0 without a number; empty if the fault is not set.
[[nodiscard]] std::optional<std::uint64_t> fault(const std::string& name);

class Device {
 public:
  /// `folder`: the folder of the frames; `node`: the description, whose absence means unplugged.
  Device(std::string folder, std::string node);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// Readable (for poll and select) if an image is available.
  [[nodiscard]] int descriptor() const { return timer_; }
  [[nodiscard]] int memory() const { return memory_; }
  /// 0, or an errno.
  int call(unsigned long request, void* argument);

 private:
  struct Done {
    std::uint32_t buffer;
    std::uint64_t frame;
  };
  int enumerate(unsigned long request, void* argument) const;
  int format(v4l2_format& format, bool set);
  int rate(v4l2_streamparm& parameters) const;
  int buffers(v4l2_requestbuffers& request);
  int query(v4l2_buffer& buffer) const;
  int take(v4l2_buffer& buffer);
  int query_control(v4l2_queryctrl& query) const;
  int query_menu(v4l2_querymenu& menu) const;
  int control(v4l2_control& control, bool set);
  int stream(bool on);
  void load();
  void advance();
  void arm();
  void fill(std::uint32_t buffer, std::uint64_t frame);
  [[nodiscard]] std::int64_t due_ns(std::uint64_t frame) const;
  [[nodiscard]] std::uint32_t buffer_size() const;

  std::string folder_;
  std::string node_;
  Description about_;
  std::size_t mode_ = 0;
  int timer_;
  int memory_;
  std::uint8_t* bytes_ = nullptr;  ///< of all buffers
  std::size_t mapped_ = 0;
  std::vector<std::vector<std::uint8_t>> frames_{};
  std::vector<std::uint32_t> used_{};  ///< bytes of each buffer
  std::deque<std::uint32_t> queued_{};
  std::deque<Done> done_{};
  bool streaming_ = false;
  std::int64_t began_ns_ = 0;
  std::uint64_t next_frame_ = 0;
  std::map<std::uint32_t, std::int32_t> values_{};
};

}  // namespace fake_v4l2
