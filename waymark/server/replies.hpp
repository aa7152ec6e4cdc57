#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/server/access.hpp"

namespace waymark {

/// A file offered by the server. Other files cannot be requested.
struct OfferedFile {
  enum class Kind : std::uint8_t { Recording, Text };
  std::string name;  ///< name shown on the page
  std::filesystem::path path;
  Kind kind = Kind::Recording;
  /// The offered folder, which links must not leave. Empty if the file itself was specified.
  std::filesystem::path within{};
};

/// Whether the file is in the folder after all links have been resolved. False if a link points to something
/// that does not exist.
[[nodiscard]] bool lies_within(const std::filesystem::path& file, const std::filesystem::path& folder);

struct OfferedThings {
  std::vector<OfferedFile> files{};
  bool live = false;  ///< whether a robot is running
};

/// The fields of a request that matter here. Header fields that were not sent are empty.
struct HttpRequest {
  std::string_view method;
  std::string_view target;  ///< such as "/files/0/lap.mcap"
  std::string_view host;    ///< such as "localhost:8642"
  std::string_view origin;
  std::string_view cookie;
  std::string_view range;  ///< such as "bytes=0-99"
  bool accepts_gzip = false;
};

/// A part of a file.
struct FilePart {
  std::filesystem::path path;
  std::uint64_t first = 0;   ///< offset of the first byte
  std::uint64_t length = 0;  ///< number of bytes
};

struct HttpReply {
  int status = 200;
  std::vector<std::pair<std::string, std::string>> headers;
  std::variant<std::string, std::string_view, FilePart> body;  ///< a view must have static storage duration

  [[nodiscard]] std::uint64_t length() const;
};

/// Replies to a request for the page, `session.json` (the list of offered files), `files/N/NAME` in ranges,
/// or `tags/FAMILY/ID` (the printed cells of a tag). Requests without the required rights get an error
/// (access.hpp). A page that was opened with the token in the address receives it as a cookie and is
/// redirected to the address without the token. Never fails; reads only the size of a file, not its content.
[[nodiscard]] HttpReply reply_to(const HttpRequest& request, const OfferedThings& offered,
                                 const AccessPolicy& policy);

/// The reply to a refused request: status and text.
[[nodiscard]] HttpReply refusal_of(AccessRights::Refusal refusal, const AccessPolicy& policy);

/// First byte and length requested by "bytes=0-99", "bytes=100-" or "bytes=-50" for a file of `size` bytes.
struct ByteRange {
  /// An unsupported header also counts as Whole.
  enum class Kind : std::uint8_t { Whole, Part, Unsatisfiable };
  Kind kind = Kind::Whole;
  std::uint64_t first = 0;
  std::uint64_t length = 0;
};
[[nodiscard]] ByteRange parse_range(std::string_view header, std::uint64_t size);

}  // namespace waymark
