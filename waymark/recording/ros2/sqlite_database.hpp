#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/byte_io.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace waymark {

/// A SQLite file opened read-only.
class SqliteDatabase {
 public:
  /// `name` is used in messages. The file is treated as untrusted: its views, triggers and functions are not
  /// run, and values must not exceed max_value_bytes. No files are written next to it.
  static Result<SqliteDatabase> open(const std::filesystem::path& path, std::string name,
                                     std::uint64_t max_value_bytes);

  /// Opens an unnamed file.
  static Result<SqliteDatabase> open(std::shared_ptr<const TemporaryFile> file, std::string name,
                                     std::uint64_t max_value_bytes);

  /// A table's column names; empty if there is no such table (views do not count).
  [[nodiscard]] std::set<std::string> columns(const std::string& table) const;

  /// Rows of a query, one at a time.
  class Query {
   public:
    /// Returns false at the end. Fails if the file is damaged.
    Result<bool> next();
    [[nodiscard]] std::int64_t integer(int column) const;
    [[nodiscard]] std::string text(int column) const;
    /// Valid until the next row.
    [[nodiscard]] ByteSpan bytes(int column) const;
    Query& bind(int parameter, std::int64_t value);

   private:
    friend class SqliteDatabase;
    Query(const SqliteDatabase& database, sqlite3_stmt* statement);
    const SqliteDatabase* database_;
    std::shared_ptr<sqlite3_stmt> statement_;
  };
  [[nodiscard]] Result<Query> query(const std::string& sql) const;

 private:
  SqliteDatabase(std::shared_ptr<sqlite3> database, std::string name)
      : database_(std::move(database)), name_(std::move(name)) {}
  [[nodiscard]] Error error() const;

  std::shared_ptr<sqlite3> database_;
  std::string name_;
};

}  // namespace waymark
