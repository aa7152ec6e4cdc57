#include "waymark/server/access.hpp"

#include <algorithm>
#include <random>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr std::size_t kMinToken = 16;
constexpr std::size_t kMaxToken = 128;

std::string cookie_name(std::uint16_t port) { return fmt::format("waymark_{}", port); }

/// Compares in constant time.
bool same(std::string_view given, std::string_view wanted) {
  if (given.size() != wanted.size() || wanted.empty()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    difference |= static_cast<unsigned>(given[i]) ^ static_cast<unsigned>(wanted[i]);
  return difference == 0;
}

/// The value that belongs to a name in "a=1; b=2".
std::string_view cookie_value(std::string_view cookies, std::string_view name) {
  while (!cookies.empty()) {
    const std::size_t end = cookies.find(';');
    std::string_view one = cookies.substr(0, end);
    while (one.starts_with(' ')) one.remove_prefix(1);
    if (one.starts_with(name) && one.substr(name.size()).starts_with('=')) return one.substr(name.size() + 1);
    cookies.remove_prefix(end == std::string_view::npos ? cookies.size() : end + 1);
  }
  return {};
}

/// The origin of a page is "http://" followed by the host that it was loaded from.
bool is_own_origin(const AccessClaim& claim, const AccessPolicy& policy) {
  constexpr std::string_view kScheme = "http://";
  if (claim.origin.empty()) return true;
  if (!claim.origin.starts_with(kScheme)) return false;
  const std::string_view host = claim.origin.substr(kScheme.size());
  return policy.remote ? host == claim.host : is_own_host(host, policy);
}

}  // namespace

bool is_own_host(std::string_view host, const AccessPolicy& policy) {
  constexpr std::uint16_t kHttpPort = 80;
  const std::string port = fmt::format(":{}", policy.port);
  if (host.ends_with(port))
    host.remove_suffix(port.size());
  else if (policy.port != kHttpPort)
    return false;
  return host == "127.0.0.1" || host == "localhost" || host == "[::1]" || host == policy.address;
}

std::string_view query_value(std::string_view target, std::string_view name) {
  const std::size_t question = target.find('?');
  if (question == std::string_view::npos) return {};
  std::string_view query = target.substr(question + 1);
  while (!query.empty()) {
    const std::size_t end = query.find('&');
    const std::string_view one = query.substr(0, end);
    if (one.starts_with(name) && one.substr(name.size()).starts_with('=')) return one.substr(name.size() + 1);
    query.remove_prefix(end == std::string_view::npos ? query.size() : end + 1);
  }
  return {};
}

AccessRights rights_of(const AccessClaim& claim, const AccessPolicy& policy) {
  using Refusal = AccessRights::Refusal;
  AccessRights rights;
  rights.by_address = same(query_value(claim.target, "token"), policy.token);
  rights.token =
      rights.by_address || same(cookie_value(claim.cookie, cookie_name(policy.port)), policy.token);
  rights.own_origin = is_own_origin(claim, policy);
  if (!policy.remote && !is_own_host(claim.host, policy))
    rights.refusal = Refusal::WrongHost;
  else if (!rights.own_origin && !rights.by_address)
    rights.refusal = Refusal::ForeignPage;
  else if (policy.remote && !rights.token)
    rights.refusal = Refusal::NoToken;
  return rights;
}

std::string token_cookie(const AccessPolicy& policy) {
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict", cookie_name(policy.port), policy.token);
}

std::string make_token() {
  std::random_device device;  // the system's random source on Linux
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", device());
  return token;
}

Status check_token(std::string_view token) {
  const bool plain = std::ranges::all_of(token, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  });
  if (plain && token.size() >= kMinToken && token.size() <= kMaxToken) return {};
  return fail(
      ErrorCode::InvalidArgument,
      fmt::format("a token must have {} to {} characters: letters, digits, - and _", kMinToken, kMaxToken),
      {.key = "token"}, "Omit `token` to have one generated.");
}

}  // namespace waymark
