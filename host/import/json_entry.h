// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace mf {

// One JSON object of an import file, with what an error line needs to point at it. Does not own the object.
class JsonEntry {
 public:
  // `place` is where in the file the object is ("[17]"), empty for the whole document; throws unless it is an object.
  JsonEntry(const nlohmann::json& object, std::string file, std::string place = {});

  // Throws for a key that is not listed. "meaning" and "comment" are notes for people and always allowed.
  void require_known_keys(std::initializer_list<const char*> known) const;

  [[nodiscard]] bool has(const char* key) const;
  // The key's value: missing without a fallback, or of another type, is an error.
  [[nodiscard]] double finite_number(const char* key, std::optional<double> fallback = {}) const;
  [[nodiscard]] double positive_number(const char* key) const;
  [[nodiscard]] double non_negative_number(const char* key, double fallback) const;
  [[nodiscard]] std::string text(const char* key) const;
  [[nodiscard]] const nlohmann::json& list(const char* key) const;

  // InputError(file, place.key, problem).
  [[noreturn]] void fail(const char* key, const std::string& problem_and_remedy) const;

 private:
  [[nodiscard]] const nlohmann::json& value(const char* key) const;

  const nlohmann::json* object_;
  std::string file_;
  std::string place_;
};

}  // namespace mf
