#include "waymark/robots/limo/limo_probe.hpp"

#include <poll.h>

#include "waymark/robots/limo/serial_port.hpp"

namespace waymark {

Result<LimoHeard> listen_to_limo(const std::string& port, Duration listen,
                                 const std::function<bool()>& cancelled) {
  constexpr int kSliceMs = 20;
  const auto opened = open_serial_port(port);
  if (!opened) return tl::unexpected(opened.error());
  LimoHeard heard;
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
