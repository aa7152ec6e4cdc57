#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

namespace waymark {

/// Which connections a server keeps, web sockets included. A newcomer is always received while anybody
/// without the token is there: for it the oldest connection goes that has not finished its first request,
/// then the oldest of those that have shown no token. Without sockets, so that tests can fill it.
class Seats {
 public:
  using Id = std::uint64_t;
  static constexpr std::size_t kMaxSeats = 64;
  /// So many of them are kept free of connections that have shown no token but hold on.
  static constexpr std::size_t kReserved = 16;

  enum class Guest : std::uint8_t {
    Waiting,  ///< its request is not complete yet
    Looks,    ///< without the token
    Owner,    ///< with the token
  };

  explicit Seats(std::size_t most = kMaxSeats) : most_(most) {}

  /// A newcomer. Nothing when every seat is an owner's. `dropped`: the connection that must go for it.
  struct Admission {
    Id id = 0;
    std::optional<Id> dropped{};
  };
  [[nodiscard]] std::optional<Admission> admit();
  /// What its request has shown. Gives the connection that must go because too many look without the token;
  /// it may be this one.
  [[nodiscard]] std::optional<Id> request_received(Id id, bool token);
  void leave(Id id) { guests_.erase(id); }

  [[nodiscard]] std::size_t taken() const { return guests_.size(); }
  [[nodiscard]] std::size_t most() const { return most_; }

 private:
  [[nodiscard]] std::optional<Id> oldest(Guest guest) const;
  [[nodiscard]] std::size_t count(Guest guest) const;

  std::size_t most_;
  std::map<Id, Guest> guests_{};  // oldest first
  Id next_ = 1;
};

/// How many connections fit among the descriptors this process may open, when `kept` of them are left to
/// everything else (a recording above all). A connection takes two: its socket, and the file it reads. At
/// least 4, at most Seats::kMaxSeats.
[[nodiscard]] std::size_t seats_for(std::uint64_t descriptors, std::uint64_t kept);

}  // namespace waymark
