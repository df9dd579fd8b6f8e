// SPDX-License-Identifier: Apache-2.0
#include "host/import/json_entry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "common/error.h"

namespace mf {

namespace {

std::string shown(const nlohmann::json& value) {
  constexpr std::size_t longest = 60;  // keeps the error on one line of a terminal
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).substr(0, longest);
}

}  // namespace

JsonEntry::JsonEntry(const nlohmann::json& object, std::string file, std::string place)
    : object_(&object), file_(std::move(file)), place_(std::move(place)) {
  if (!object.is_object()) throw InputError(file_, place_, "is no JSON object: write { \"key\": value, ... }");
}

void JsonEntry::fail(const char* key, const std::string& problem_and_remedy) const {
  throw InputError(file_, place_.empty() ? key : fmt::format("{}.{}", place_, key), problem_and_remedy);
}

void JsonEntry::require_known_keys(std::initializer_list<const char*> known) const {
  std::string list;
  for (const char* key : known) list += (list.empty() ? "" : ", ") + std::string(key);
  for (const auto& item : object_->items()) {
    const std::string& key = item.key();
    const bool note = key == "meaning" || key == "comment";
    if (note || std::any_of(known.begin(), known.end(), [&](std::string_view k) { return k == key; })) continue;
    fail(key.c_str(), fmt::format("is no key of this file: remove it, or use one of {}", list));
  }
}

bool JsonEntry::has(const char* key) const {
  return object_->contains(key);
}

const nlohmann::json& JsonEntry::value(const char* key) const {
  const auto found = object_->find(key);
  if (found == object_->end()) fail(key, "is missing: add it");
  return *found;
}

double JsonEntry::finite_number(const char* key, std::optional<double> fallback) const {
  if (fallback && !has(key)) return *fallback;
  const nlohmann::json& found = value(key);
  if (!found.is_number() || !std::isfinite(found.get<double>()))
    fail(key, fmt::format("is {}: give a finite number", shown(found)));
  return found.get<double>();
}

double JsonEntry::positive_number(const char* key) const {
  const double number = finite_number(key);
  if (!(number > 0)) fail(key, fmt::format("is {}: give a number above 0", number));
  return number;
}

double JsonEntry::non_negative_number(const char* key, double fallback) const {
  const double number = finite_number(key, fallback);
  if (number < 0) fail(key, fmt::format("is {}: give 0 or a number above it", number));
  return number;
}

std::string JsonEntry::text(const char* key) const {
  const nlohmann::json& found = value(key);
  if (!found.is_string()) fail(key, fmt::format("is {}: give a text in quotes", shown(found)));
  return found.get<std::string>();
}

const nlohmann::json& JsonEntry::list(const char* key) const {
  const nlohmann::json& found = value(key);
  if (!found.is_array()) fail(key, fmt::format("is {}: give a list in brackets", shown(found)));
  return found;
}

}  // namespace mf
