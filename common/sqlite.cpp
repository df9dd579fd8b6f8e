// SPDX-License-Identifier: Apache-2.0
#include "common/sqlite.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <cerrno>

#include "common/error.h"

namespace mf {

void SqliteDatabase::Closer::operator()(sqlite3* database) const {
  sqlite3_close_v2(database);
}

void SqliteStatement::Finalizer::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

SqliteDatabase::SqliteDatabase(const std::filesystem::path& file, Mode mode) : file_(file.string()) {
  sqlite3* raw = nullptr;
  // One connection belongs to one thread at a time, so SQLite's own mutexes are not needed.
  const int flags =
      SQLITE_OPEN_NOMUTEX | (mode == Mode::create ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY);
  const int code = sqlite3_open_v2(file.c_str(), &raw, flags, nullptr);
  handle_.reset(raw);  // also after a failure: SQLite hands out a handle that must be closed
  if (code != SQLITE_OK) fail(code);
  sqlite3_extended_result_codes(raw, 1);
  sqlite3_busy_timeout(raw, 2000);  // ms; the writer holds locks for one small commit at most
}

void SqliteDatabase::fail(int code) const {
  const int primary = code & 0xFF;  // the rest is detail
  const char* remedy = "check the folder, its permissions and the free space";
  if (primary == SQLITE_FULL) remedy = "free some space and try again";
  if (primary == SQLITE_CORRUPT || primary == SQLITE_NOTADB)
    remedy = "it is damaged or no index of a session; restore it from a copy";
  const char* reason = handle_ ? sqlite3_errmsg(handle_.get()) : sqlite3_errstr(code);
  const std::string problem = fmt::format("cannot be used as the session's index ({}): {}", reason, remedy);
  if (primary == SQLITE_FULL) throw WriteError(file_, problem, ENOSPC);
  if (primary == SQLITE_IOERR) throw WriteError(file_, problem, EIO);
  throw InputError(file_, "", problem);
}

void SqliteDatabase::run(const char* sql) {
  const int code = sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

void SqliteDatabase::run_quietly(const char* sql) noexcept {
  sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr);
}

void SqliteDatabase::close() {
  const int code = sqlite3_close(handle_.get());
  if (code != SQLITE_OK) fail(code);
  static_cast<void>(handle_.release());  // closed just now
}

SqliteStatement::SqliteStatement(const SqliteDatabase& database, const char* sql) : database_(&database) {
  sqlite3_stmt* raw = nullptr;
  const int code = sqlite3_prepare_v2(database.handle(), sql, -1, &raw, nullptr);
  if (code != SQLITE_OK) database.fail(code);
  statement_.reset(raw);
}

SqliteStatement& SqliteStatement::bind(int parameter, std::int64_t value) {
  const int code = sqlite3_bind_int64(statement_.get(), parameter, value);
  if (code != SQLITE_OK) database_->fail(code);
  return *this;
}

SqliteStatement& SqliteStatement::bind(int parameter, double value) {
  const int code = sqlite3_bind_double(statement_.get(), parameter, value);
  if (code != SQLITE_OK) database_->fail(code);
  return *this;
}

SqliteStatement& SqliteStatement::bind(int parameter, const std::string& value) {
  const int code =
      sqlite3_bind_text(statement_.get(), parameter, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
  if (code != SQLITE_OK) database_->fail(code);
  return *this;
}

bool SqliteStatement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code != SQLITE_ROW && code != SQLITE_DONE) database_->fail(code);
  return code == SQLITE_ROW;
}

void SqliteStatement::reset() {
  sqlite3_reset(statement_.get());  // repeats the last step's error, which step() has thrown already
}

std::int64_t SqliteStatement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double SqliteStatement::real(int column) const {
  return sqlite3_column_double(statement_.get(), column);
}

std::string SqliteStatement::text(int column) const {
  const unsigned char* characters = sqlite3_column_text(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return characters == nullptr ? std::string()
                               : std::string(characters, characters + static_cast<std::ptrdiff_t>(size));
}

}  // namespace mf
