#include "waymark/robots/limo/serial_port.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/robots/watchdog/device_file.hpp"

namespace waymark {
namespace {

/// The error for a port that another program has locked (as this program does) or has open without a lock, so
/// that it would consume some of LIMO's bytes. The simulator behind a pseudo-terminal is ignored.
Error in_use(const std::string& path, bool without_lock = false) {
  const std::string holder = holder_of(path, !without_lock);
  const bool ours = holder.starts_with("waymark");
  return {
      ErrorCode::Unreadable,
      (holder.empty() ? "another program" : holder) + " uses the serial port",
      {.source = path},
      ours ? "Stop that drive (Ctrl-C in its terminal), then try again. A killed program releases the port "
             "within a second."
           : "Stop that program (such as limo_base, LIMO's ROS driver), then try again."};
}

Error open_error(const std::string& path, int error) {
  const std::vector<std::string> ports = list_serial_ports();
  const std::string there = ports.empty() ? "This computer has no serial port."
                                          : fmt::format("Available: {}.", fmt::join(ports, ", "));
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return {ErrorCode::NotFound, "no such serial port", {.source = path}, there};
    case EISDIR:
      return {ErrorCode::Unsupported, "not a serial port", {.source = path}, there};
    case EACCES:
    case EPERM:
      return no_permission(path, "the serial port", there);
    case EBUSY:
      return in_use(path);
    default:
      return {ErrorCode::Unreadable,
              fmt::format("cannot open the serial port: {}",
                          std::strerror(error)),  // NOLINT(concurrency-mt-unsafe)
              {.source = path},
              there};
  }
}

bool set_line(int port) {
  termios line{};
  if (tcgetattr(port, &line) != 0) return false;
  cfmakeraw(&line);
  line.c_cflag |= static_cast<tcflag_t>(CLOCAL | CREAD);
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
  (void)cfsetispeed(&line, B460800);
  (void)cfsetospeed(&line, B460800);
  return tcsetattr(port, TCSANOW, &line) == 0;
}

}  // namespace

std::vector<std::string> list_serial_ports() {
  constexpr std::array kPrefixes = {"ttyTHS", "ttyUSB", "ttyACM", "ttylimo"};
  std::vector<std::string> ports;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
    const std::string name = entry.path().filename().string();
    if (std::ranges::any_of(kPrefixes, [&name](const char* begin) { return name.starts_with(begin); }))
      ports.push_back(entry.path().string());
  }
  std::ranges::sort(ports);
  return ports;
}

Result<Descriptor> open_serial_port(const std::string& path) {
  Descriptor port(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!port.open()) return tl::unexpected(open_error(path, errno));
  if (::isatty(port.number()) == 0)
    return fail(ErrorCode::Unsupported, "not a serial port", {.source = path},
                "Use a port such as /dev/ttyTHS1 (Jetson Nano) or /dev/ttyUSB0.");
  const bool locked = ::flock(port.number(), LOCK_EX | LOCK_NB) == 0;
  if (!locked || !holder_of(path, false).empty()) return tl::unexpected(in_use(path, locked));
  if (!set_line(port.number()))
    return fail(ErrorCode::Unsupported, "cannot set the serial port to 460800 baud", {.source = path},
                "Use the port of LIMO's mainboard.");
  (void)::ioctl(port.number(), TIOCEXCL);
  (void)::tcflush(port.number(), TCIFLUSH);
  return port;
}

Result<LimoPortActivity> listen_to_limo(const std::string& port, Duration listen,
                                        const std::function<bool()>& cancelled) {
  constexpr int kSliceMs = 20;
  const auto opened = open_serial_port(port);
  if (!opened) return tl::unexpected(opened.error());
  LimoPortActivity heard;
  LimoReader reader;
  std::uint64_t motions = 0;
  std::uint64_t gyros = 0;
  const Duration until = steady_now() + listen;
  while (steady_now() < until && !cancelled()) {
    pollfd ready{opened->number(), POLLIN, 0};
    (void)::poll(&ready, 1, kSliceMs);
    std::string bytes;
    if (read_some(opened->number(), bytes) == Moved::Ended)
      return fail(ErrorCode::Unreadable, "the serial port is gone", {.source = port}, "Check the cable.");
    heard.bytes += bytes.size();
    reader.add({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    while (const auto frame = reader.next()) {
      ++heard.frames;
      const auto id = static_cast<LimoId>(frame->id);
      if (id == LimoId::MotionFeedback) ++motions;
      if (id == LimoId::AngularVelocity) ++gyros;
      if (id != LimoId::State) continue;
      if (const auto state = decode_state(*frame)) heard.state = *state;
    }
  }
  heard.skipped_bytes = reader.skipped();
  heard.motion_rate_hz = static_cast<double>(motions) / to_seconds(listen);
  heard.gyro_rate_hz = static_cast<double>(gyros) / to_seconds(listen);
  return heard;
}

}  // namespace waymark
