// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

struct sqlite3;
struct sqlite3_stmt;

namespace mf {

// One open SQLite database. Every failure throws InputError naming the file, SQLite's own reason and a remedy.
class SqliteDatabase {
 public:
  enum class Mode { create, read_only };
  SqliteDatabase(const std::filesystem::path& file, Mode);

  void run(const char* sql);                   // statements without results
  void run_quietly(const char* sql) noexcept;  // the same, on the way out of a failure
  // Closes; the destructor does the same, but silently.
  void close();

  [[nodiscard]] sqlite3* handle() const { return handle_.get(); }
  [[nodiscard]] const std::string& file() const { return file_; }
  [[noreturn]] void fail(int code) const;

 private:
  struct Closer {
    void operator()(sqlite3*) const;
  };
  std::string file_;
  std::unique_ptr<sqlite3, Closer> handle_;
};

// One prepared statement of a database, which it must not outlive. Parameters and columns count as SQLite does:
// parameters from 1, columns from 0.
class SqliteStatement {
 public:
  SqliteStatement(const SqliteDatabase&, const char* sql);

  SqliteStatement& bind(int parameter, std::int64_t value);
  SqliteStatement& bind(int parameter, double value);
  SqliteStatement& bind(int parameter, const std::string& value);
  // True when there is a row to read.
  bool step();
  // Ready for other parameters.
  void reset();

  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string text(int column) const;

 private:
  struct Finalizer {
    void operator()(sqlite3_stmt*) const;
  };
  const SqliteDatabase* database_;
  std::unique_ptr<sqlite3_stmt, Finalizer> statement_;
};

}  // namespace mf
