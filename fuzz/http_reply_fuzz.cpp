// Any HTTP request (method, target, host, origin, cookie, range; one line each): a reply with a valid status
// and the headers that block foreign pages. Never a file that was not offered, never a range beyond its end,
// and nothing at all from a remote server without its token.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "waymark/server/replies.hpp"

namespace {

using namespace waymark;

constexpr std::uint64_t kBytes = 1000;

const OfferedThings& offered() {
  static const OfferedThings things = [] {
    const auto path = std::filesystem::temp_directory_path() / "waymark_http_reply_fuzz.mcap";
    std::ofstream(path) << std::string(kBytes, 'x');
    return OfferedThings{.files = {{"lap.mcap", path, OfferedFile::Kind::Recording}}};
  }();
  return things;
}

void require(bool holds) {
  if (!holds) std::abort();
}

void check(const HttpReply& reply) {
  bool policy = false;
  for (const auto& [name, value] : reply.headers) {
    require(value.find_first_of("\r\n") == std::string::npos &&
            name.find_first_of("\r\n") == std::string::npos);
    policy = policy || (name == "Content-Security-Policy" && value.starts_with("default-src 'none'"));
  }
  require(policy && reply.status >= 200 && reply.status < 500);
  if (const auto* part = std::get_if<FilePart>(&reply.body))
    require(part->path == offered().files[0].path && part->first + part->length <= kBytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  std::array<std::string_view, 6> lines;
  for (std::string_view& line : lines) {
    const std::size_t end = rest.find('\n');
    line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  }
  const HttpRequest request{.method = lines[0],
                            .target = lines[1],
                            .host = lines[2],
                            .origin = lines[3],
                            .cookie = lines[4],
                            .range = lines[5],
                            .accepts_gzip = size % 2 == 0};
  const AccessPolicy here{.port = 8642, .token = "0123456789abcdef"};
  check(reply_to(request, offered(), here));
  const AccessPolicy remote{.port = 8642, .remote = true, .token = "fedcba9876543210"};
  const HttpReply reply = reply_to(request, offered(), remote);
  check(reply);
  const bool has_token = lines[1].find(remote.token) != std::string_view::npos ||
                         lines[4].find(remote.token) != std::string_view::npos;
  require(has_token || reply.status == 401 || reply.status == 403);
  return 0;
}
