// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/error.h"
#include "common/json_file.h"

namespace mf {

template <typename T>
T json_field(const nlohmann::json& object, const std::string& key, const std::string& file) {
  if (!object.is_object() || !object.contains(key)) throw InputError(file, key, "is missing: add it");
  try {
    return object.at(key).get<T>();
  } catch (const nlohmann::json::exception&) {
    throw InputError(file, key, "has the wrong type: " + object.at(key).dump().substr(0, 60));
  }
}

template <typename T>
T json_field_or(const nlohmann::json& object, const std::string& key, const std::string& file, const T& fallback) {
  return object.is_object() && object.contains(key) ? json_field<T>(object, key, file) : fallback;
}

}  // namespace mf
