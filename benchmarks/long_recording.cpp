// Writes a recording of ten minutes and 300 MB like `waymark teach --record-images jpeg`, for the test of the
// page's scrubbing speed: images of noise of 25 kB at 20 per second, odometry and truth at 50, two tags in
// each image. usage: long_recording FILE [SECONDS]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace {

using namespace waymark;

Image noise_image(std::uint32_t seed) {
  Image image(640, 480);
  std::uint32_t state = seed;
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      state = state * 1664525U + 1013904223U;
      image.row(y)[x] =
          static_cast<std::uint8_t>(80 + (static_cast<std::uint32_t>(x) + seed) % 64 + (state >> 27U));
    }
  }
  return image;
}

Status write(SampleRecorder& recorder, int seconds) {
  constexpr std::size_t kImageBytes = 25'000;
  std::vector<Bytes> images;
  for (std::uint32_t i = 0; i < 64; ++i) {  // more than a chunk holds, so they do not compress well
    auto jpeg = encode_jpeg(noise_image(i * 7 + 1), 30);
    if (!jpeg) return tl::unexpected(jpeg.error());
    images.push_back(std::move(*jpeg));
  }
  constexpr std::int64_t kStep_ns = 20'000'000;
  std::uint32_t noise = 1;
  for (std::int64_t i = 0; i * kStep_ns < seconds * 1'000'000'000LL; ++i) {
    const SensorTime stamp{Duration(i * kStep_ns)};
    const double angle = static_cast<double>(i) * 0.002;
    const SE2 map_T_base(2 * std::cos(angle), 2 * std::sin(angle), angle + 1.5707963);
    Status status = recorder.add(Odometry{.stamp = stamp, .odom_T_base = map_T_base, .speed_m_s = 0.2});
    if (status) status = recorder.add(TruthPose{stamp, lift(map_T_base)});
    if (status && i % 5 < 2) {  // 20 per second
      ros2::CompressedImage message{.header = ros2::to_ros(CameraFrame{.stamp = stamp}).header,
                                    .format = "jpeg"};
      message.data = images[static_cast<std::size_t>(i) % images.size()];
      while (message.data.size() < kImageBytes) {  // decoders skip data after the end of a JPEG
        noise = noise * 1664525U + 1013904223U;
        message.data.push_back(static_cast<std::uint8_t>(noise >> 24U));
      }
      status = recorder.add_message("/image_raw/compressed", stamp, message);
      TagFrame tags{.stamp = stamp};
      for (int tag = 0; tag < 2; ++tag) {
        const double x = 200.0 + 150 * tag;
        tags.detections.push_back({.tag = {FamilyId::Tag36h11, tag},
                                   .corners_px = {{{x, 200}, {x + 60, 200}, {x + 60, 260}, {x, 260}}}});
      }
      if (status) status = recorder.add(tags);
    }
    if (!status) return status;
  }
  return recorder.close();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: long_recording FILE [SECONDS]\n", stderr);
    return 2;
  }
  auto file = create_file(argv[1]);
  if (!file) {
    fmt::print(stderr, "{}\n", to_string(file.error()));
    return 1;
  }
  auto recorder = SampleRecorder::open(std::move(*file));
  const Status status = recorder ? write(*recorder, argc > 2 ? std::atoi(argv[2]) : 600)
                                 : Status(tl::unexpected(recorder.error()));
  if (status) return 0;
  fmt::print(stderr, "{}\n", to_string(status.error()));
  return 1;
}
