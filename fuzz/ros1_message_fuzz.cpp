// Any text as a message definition and any bytes as its message: the transcoder terminates, and its output
// stays small.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "waymark/recording/cdr_channels.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto* end = std::find(data, data + size, std::uint8_t{0});
  const auto text = waymark::as_text({data, end});
  const waymark::ByteSpan message(std::min(end + 1, data + size), data + size);
  const auto transcoder = waymark::ros::Ros1Transcoder::make("pkg_msgs/Type", text);
  if (!transcoder) {
    if (transcoder.error().message.empty()) std::abort();
    return 0;
  }
  waymark::Bytes cdr;
  (void)transcoder->transcode(message, cdr);
  if (cdr.size() > (std::size_t{1} << 24) + 40 * size) std::abort();
  return 0;
}
