#include "waymark/server/replies.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <system_error>

#include <fmt/format.h>

#include "waymark/families/family.hpp"
#include "waymark/server/assets.hpp"

namespace waymark {
namespace {

/// The page may only run its own scripts. It may connect to this server, and to addresses of recordings that
/// the user enters.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; worker-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self' https: http://127.0.0.1:* http://localhost:*; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";
constexpr std::string_view kNoPage =
    "<!doctype html><html lang=\"en\"><title>Waymark</title><h1>This program was built without the page</h1>"
    "<p>With npm installed, run <code>tools/build_viewer.sh</code> in the source folder "
    "and build again.</p></html>";

HttpReply text_reply(int status, std::string text) {
  return {status, {{"Content-Type", "text/plain; charset=utf-8"}}, std::move(text) + "\n"};
}

std::string_view media_type(std::string_view name) {
  using Type = std::pair<std::string_view, std::string_view>;
  constexpr std::array<Type, 5> kTypes = {Type{".html", "text/html; charset=utf-8"},
                                          {".js", "text/javascript; charset=utf-8"},
                                          {".css", "text/css; charset=utf-8"},
                                          {".yaml", "text/plain; charset=utf-8"},
                                          {".txt", "text/plain; charset=utf-8"}};
  for (const auto& [ending, type] : kTypes) {
    if (name.ends_with(ending)) return type;
  }
  return "application/octet-stream";
}

/// Converts a text to a JSON string.
std::string json_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

/// Encodes a name for use in a URL.
std::string percent_encoded(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || c == '.';
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return out;
}

template <class Number>
std::optional<Number> number(std::string_view text) {
  Number value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

HttpReply page_file(std::string_view name, bool accepts_gzip) {
  const auto assets = viewer_assets();
  if (assets.empty() && name == "index.html")
    return {200, {{"Content-Type", "text/html; charset=utf-8"}}, kNoPage};
  const auto found = std::ranges::find_if(assets, [&](const Asset& asset) { return asset.name == name; });
  if (found == assets.end()) return text_reply(404, "This page does not exist.");
  if (!accepts_gzip) return text_reply(406, "The page is compressed with gzip: send Accept-Encoding: gzip.");
  return {200,
          {{"Content-Type", std::string(media_type(name))}, {"Content-Encoding", "gzip"}},
          std::string_view(reinterpret_cast<const char*>(found->gzip.data()), found->gzip.size())};
}

std::uint64_t size_of(const std::filesystem::path& path) {
  std::error_code none;
  const auto size = std::filesystem::file_size(path, none);
  return none ? 0 : size;
}

HttpReply session(const OfferedThings& offered) {
  std::string files;
  for (std::size_t i = 0; i < offered.files.size(); ++i) {
    const OfferedFile& file = offered.files[i];
    const std::string base = file.path.filename().string();
    files +=
        fmt::format(R"({}{{"name":{},"url":"files/{}/{}","kind":"{}","size_bytes":{}}})", i == 0 ? "" : ",",
                    json_string(file.name), i, percent_encoded(base),
                    file.kind == OfferedFile::Kind::Recording ? "recording" : "text", size_of(file.path));
  }
  return {200,
          {{"Content-Type", "application/json"}},
          fmt::format(R"({{"files":[{}],"live":{}}})", files, offered.live)};
}

/// `rest` is "N/NAME". Only the number is used; the name is for display.
HttpReply offered_file(std::string_view rest, std::string_view range,
                       const std::vector<OfferedFile>& offered) {
  const auto index = number<std::size_t>(rest.substr(0, rest.find('/')));
  if (!index || *index >= offered.size()) return text_reply(404, "No such file is offered.");
  const OfferedFile& file = offered[*index];
  std::error_code error;
  if (!file.within.empty() && !lies_within(file.path, file.within))
    return text_reply(404, fmt::format("{} is outside its folder.", file.name));
  const std::uint64_t size = std::filesystem::file_size(file.path, error);
  if (error) return text_reply(404, fmt::format("cannot read {}: {}", file.name, error.message()));
  const ByteRange part = parse_range(range, size);
  const std::string type(media_type(file.path.filename().string()));
  if (part.kind == ByteRange::Kind::Unsatisfiable) {
    HttpReply reply = text_reply(416, "The requested range is outside the file.");
    reply.headers.emplace_back("Content-Range", fmt::format("bytes */{}", size));
    return reply;
  }
  HttpReply reply{200, {{"Content-Type", type}, {"Accept-Ranges", "bytes"}}, FilePart{file.path, 0, size}};
  if (part.kind == ByteRange::Kind::Whole) return reply;
  reply.status = 206;
  reply.headers.emplace_back("Content-Range",
                             fmt::format("bytes {}-{}/{}", part.first, part.first + part.length - 1, size));
  reply.body = FilePart{file.path, part.first, part.length};
  return reply;
}

/// `rest` is "FAMILY/ID".
HttpReply printed_tag(std::string_view rest) {
  const std::size_t slash = rest.find('/');
  if (slash == std::string_view::npos) return text_reply(404, "The address of a tag is tags/FAMILY/ID.");
  const auto id = parse_tag_id(fmt::format("{}:{}", rest.substr(0, slash), rest.substr(slash + 1)));
  if (!id) return text_reply(404, to_string(id.error()));
  std::string cells;
  for (const std::uint8_t cell : bitmap(*id)) cells += cell == 0 ? '0' : cell == 255 ? '1' : '.';
  const Family& layout = family(id->family);
  return {200,
          {{"Content-Type", "application/json"}, {"Cache-Control", "max-age=3600"}},
          fmt::format(R"({{"total_width":{},"width_at_border":{},"cells":"{}"}})", layout.total_width,
                      layout.width_at_border, cells)};
}

HttpReply route(const HttpRequest& request, const OfferedThings& offered) {
  if (request.method != "GET" && request.method != "HEAD") {
    HttpReply reply = text_reply(405, "Only GET and HEAD are supported.");
    reply.headers.emplace_back("Allow", "GET, HEAD");
    return reply;
  }
  std::string_view path = request.target.substr(0, request.target.find('?'));
  if (!path.starts_with('/')) return text_reply(400, "The target does not begin with a slash.");
  path.remove_prefix(1);
  if (path.empty()) return page_file("index.html", request.accepts_gzip);
  if (path == "session.json") return session(offered);
  if (path.starts_with("files/")) return offered_file(path.substr(6), request.range, offered.files);
  if (path.starts_with("tags/")) return printed_tag(path.substr(5));
  return page_file(path, request.accepts_gzip);
}

}  // namespace

bool lies_within(const std::filesystem::path& file, const std::filesystem::path& folder) {
  std::error_code no_file;
  std::error_code no_folder;
  const std::filesystem::path real = std::filesystem::canonical(file, no_file);
  const std::filesystem::path home = std::filesystem::canonical(folder, no_folder);
  if (no_file || no_folder) return false;
  return std::ranges::mismatch(home, real).in1 == home.end();
}

std::uint64_t HttpReply::length() const {
  if (const auto* file = std::get_if<FilePart>(&body)) return file->length;
  if (const auto* text = std::get_if<std::string>(&body)) return text->size();
  return std::get<std::string_view>(body).size();
}

ByteRange parse_range(std::string_view header, std::uint64_t size) {
  constexpr std::string_view kUnit = "bytes=";
  if (!header.starts_with(kUnit)) return {};
  header.remove_prefix(kUnit.size());
  const std::size_t dash = header.find('-');
  if (dash == std::string_view::npos || header.find(',') != std::string_view::npos) return {};
  const std::string_view from = header.substr(0, dash);
  const std::string_view to = header.substr(dash + 1);
  const auto first = number<std::uint64_t>(from);
  const auto last = number<std::uint64_t>(to);
  if ((!first && !from.empty()) || (!last && !to.empty()) || (!first && !last)) return {};
  if (!first) {  // a suffix range: the last `length` bytes
    const std::uint64_t length = std::min(*last, size);
    if (length == 0) return {.kind = ByteRange::Kind::Unsatisfiable};
    return {.kind = ByteRange::Kind::Part, .first = size - length, .length = length};
  }
  if (last && *last < *first) return {};
  if (*first >= size) return {.kind = ByteRange::Kind::Unsatisfiable};
  const std::uint64_t end = last ? std::min(*last, size - 1) : size - 1;
  return {.kind = ByteRange::Kind::Part, .first = *first, .length = end - *first + 1};
}

HttpReply refusal_of(AccessRights::Refusal refusal, const AccessPolicy& policy) {
  using Refusal = AccessRights::Refusal;
  if (refusal == Refusal::WrongHost)
    return text_reply(421, fmt::format("The address of this server is {} or localhost, port {}.",
                                       policy.address, policy.port));
  if (refusal == Refusal::ForeignPage) return text_reply(403, "Requests from other pages are refused.");
  return text_reply(401, "Open the address with the token that the program printed.");
}

HttpReply reply_to(const HttpRequest& request, const OfferedThings& offered, const AccessPolicy& policy) {
  const AccessRights rights = rights_of(
      {.host = request.host, .origin = request.origin, .target = request.target, .cookie = request.cookie},
      policy);
  HttpReply reply;
  if (rights.refusal != AccessRights::Refusal::None) {
    reply = refusal_of(rights.refusal, policy);
  } else if (rights.by_address && request.method == "GET" && request.target.starts_with("/?")) {
    reply = text_reply(303, "The page is at /.");
    reply.headers.emplace_back("Location", "/");
    reply.headers.emplace_back("Set-Cookie", token_cookie(policy));
  } else {
    reply = route(request, offered);
  }
  for (const auto& [name, value] :
       {std::pair{"Content-Security-Policy", kPolicy}, std::pair{"X-Content-Type-Options", "nosniff"},
        std::pair{"Referrer-Policy", "no-referrer"}, std::pair{"Cross-Origin-Resource-Policy", "same-origin"},
        std::pair{"Cross-Origin-Opener-Policy", "same-origin"}})
    reply.headers.emplace_back(name, value);
  if (std::ranges::none_of(reply.headers, [](const auto& field) { return field.first == "Cache-Control"; }))
    reply.headers.emplace_back("Cache-Control", "no-cache");
  return reply;
}

}  // namespace waymark
