// Tests of the fake camera used by the tests in this room (tests/fake_v4l2).
#include <cerrno>

#include <gtest/gtest.h>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/resource.h>

#include "tests/support/fake_camera.hpp"
#include "tests/support/sanitized.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

using waymark::testing::FakeCamera;

constexpr int kSide = 64;
constexpr std::uint32_t kPixels = kSide * kSide;

/// Fills the stack below its caller with non-zero bytes.
[[gnu::noinline]] void fill_stack() {
  volatile std::uint8_t bytes[16384];
  for (volatile std::uint8_t& byte : bytes) byte = 0xff;
}

/// Requests four buffers of the fake camera while the address space is limited to `limit` bytes. Returns 0 or
/// an errno.
int request_buffers(int camera, rlim_t limit) {
  v4l2_requestbuffers request{};
  request.count = 4;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  rlimit before{};
  getrlimit(RLIMIT_AS, &before);
  const rlimit limited{.rlim_cur = limit, .rlim_max = before.rlim_max};
  setrlimit(RLIMIT_AS, &limited);
  fill_stack();
  const int error = ::ioctl(camera, VIDIOC_REQBUFS, &request) == 0 ? 0 : errno;
  setrlimit(RLIMIT_AS, &before);
  return error;
}

// The fake camera calls the kernel through a variadic function, which reads whole registers.
TEST(FakeV4l2, MapsItsBuffersWithAnyStackContents) {
  FakeCamera fake;
  fake.add_mode("GREY", kSide, kSide, 1000, std::vector<std::uint8_t>(kPixels, 50));
  const Descriptor camera(::open("/dev/video0", O_RDWR));
  ASSERT_EQ(request_buffers(camera.number(), RLIM_INFINITY), 0);
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  ASSERT_EQ(::ioctl(camera.number(), VIDIOC_QBUF, &buffer), 0);
  ASSERT_EQ(::ioctl(camera.number(), VIDIOC_STREAMON, &type), 0);
  pollfd ready{camera.number(), POLLIN, 0};
  ASSERT_EQ(poll(&ready, 1, 1000), 1);
  ASSERT_EQ(::ioctl(camera.number(), VIDIOC_DQBUF, &buffer), 0);
  EXPECT_EQ(buffer.bytesused, kPixels);
}

TEST(FakeV4l2, RejectsBuffersThatCannotBeMapped) {
#ifdef WAYMARK_SANITIZED
  GTEST_SKIP() << "the sanitizer's own memory is limited too";
#endif
  FakeCamera fake;
  fake.add_mode("GREY", kSide, kSide, 1000, std::vector<std::uint8_t>(kPixels, 50));
  const Descriptor camera(::open("/dev/video0", O_RDWR));
  EXPECT_EQ(request_buffers(camera.number(), 0), ENOMEM);
  v4l2_buffer buffer{};
  EXPECT_NE(::ioctl(camera.number(), VIDIOC_QUERYBUF, &buffer), 0);
}

}  // namespace
}  // namespace waymark
