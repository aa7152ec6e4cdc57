#include "waymark/recording/sqlite_database.hpp"

#include <algorithm>
#include <climits>

#include <fmt/format.h>
#include <sqlite3.h>

namespace waymark {
namespace {

/// A path as an URI that SQLite does not write to.
std::string read_only_uri(const std::filesystem::path& path, bool immutable) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    if (c == '?' || c == '#' || c == '%') {
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    } else {
      uri += c;
    }
  }
  return uri + (immutable ? "?mode=ro&immutable=1" : "?mode=ro");
}

std::shared_ptr<sqlite3> open_uri(const std::string& uri) {
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(uri.c_str(), &raw,
                                   SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  std::shared_ptr<sqlite3> database(raw, sqlite3_close);
  if (code != SQLITE_OK) return nullptr;
  const char* harden =
      "PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON; PRAGMA mmap_size=0;"
      "SELECT count(*) FROM sqlite_master";
  sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  return sqlite3_exec(raw, harden, nullptr, nullptr, nullptr) == SQLITE_OK ? database : nullptr;
}

}  // namespace

Result<SqliteDatabase> SqliteDatabase::open(const std::filesystem::path& path, std::string name,
                                            std::uint64_t max_value_bytes) {
  std::shared_ptr<sqlite3> database = open_uri(read_only_uri(path, false));
  // A journal of a recorder that died cannot be used in a folder that cannot be written.
  if (!database) database = open_uri(read_only_uri(path, true));
  if (!database)
    return fail(ErrorCode::Unreadable, "this SQLite file is damaged: its tables cannot be listed",
                {.source = std::move(name)}, "`sqlite3 FILE .recover` may save what is left.");
  sqlite3_limit(database.get(), SQLITE_LIMIT_LENGTH,
                static_cast<int>(std::min<std::uint64_t>(max_value_bytes, INT_MAX)));
  return SqliteDatabase(std::move(database), std::move(name));
}

Error SqliteDatabase::error() const {
  return {ErrorCode::Unreadable,
          fmt::format("SQLite: {}", sqlite3_errmsg(database_.get())),
          {.source = name_},
          {}};
}

std::set<std::string> SqliteDatabase::columns(const std::string& table) const {
  std::set<std::string> names;
  Result<Query> real = query(fmt::format(
      "SELECT count(*) FROM sqlite_master WHERE type='table' AND name='{}' AND sql LIKE 'CREATE TABLE%'",
      table));
  if (!real || !real->next().value_or(false) || real->integer(0) != 1) return names;
  Result<Query> query = this->query(fmt::format("PRAGMA table_info({})", table));
  while (query && query->next().value_or(false)) names.insert(query->text(1));
  return names;
}

Result<SqliteDatabase::Query> SqliteDatabase::query(const std::string& sql) const {
  sqlite3_stmt* raw = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &raw, nullptr) != SQLITE_OK)
    return tl::unexpected(error());
  return Query(*this, raw);
}

SqliteDatabase::Query::Query(const SqliteDatabase& database, sqlite3_stmt* statement)
    : database_(&database), statement_(statement, sqlite3_finalize) {}

Result<bool> SqliteDatabase::Query::next() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return tl::unexpected(database_->error());
}

std::int64_t SqliteDatabase::Query::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string SqliteDatabase::Query::text(int column) const {
  const unsigned char* text = sqlite3_column_text(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return text == nullptr ? std::string() : std::string(text, text + size);
}

ByteSpan SqliteDatabase::Query::bytes(int column) const {
  const void* data = sqlite3_column_blob(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return {static_cast<const std::uint8_t*>(data), static_cast<std::size_t>(data == nullptr ? 0 : size)};
}

SqliteDatabase::Query& SqliteDatabase::Query::bind(int parameter, std::int64_t value) {
  sqlite3_bind_int64(statement_.get(), parameter, value);
  return *this;
}

}  // namespace waymark
