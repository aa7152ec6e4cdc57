// A stranger's program: an empty image has no tags in it, and a misspelt family is answered with words.
#include <cstdio>

#include <waymark/image/image.hpp>
#include <waymark/tags/apriltag3/apriltag_detector.hpp>

int main() {
  const auto detector = waymark::make_apriltag_detector({});
  if (!detector) return 1;
  const auto found = (*detector)->detect(waymark::Image(640, 480, 128));
  if (!found || !found->empty()) return 2;
  const auto typo = waymark::parse_family("tag35h11");
  if (typo || typo.error().hint.find("tag36h11") == std::string::npos) return 3;
  std::puts("consumer: found and linked Waymark");
  return 0;
}
