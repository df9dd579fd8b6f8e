// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "common/rigid3.h"

namespace mf {

// Throws InputError naming the file when it is missing or is no JSON (with the value, line and column at fault).
[[nodiscard]] nlohmann::json read_json_file(const std::filesystem::path& file);

// Written aside and renamed, indented by one.
void write_json_file(const std::filesystem::path& file, const nlohmann::json& json);

// The value of `key`, or InputError(file, key) when it is missing or of another type. `file` only names the source.
template <typename T>
[[nodiscard]] T json_field(const nlohmann::json& object, const std::string& key, const std::string& file);

// As json_field, but `fallback` when the key is absent.
template <typename T>
[[nodiscard]] T json_field_or(const nlohmann::json& object, const std::string& key, const std::string& file,
                              const T& fallback);

// 4×4, a list of rows. from_json throws InputError(file, key) unless it is a proper rigid transform (within 1e-4).
[[nodiscard]] nlohmann::json rigid3_to_json(const Rigid3& target_from_source);
[[nodiscard]] Rigid3 rigid3_from_json(const nlohmann::json& rows, const std::string& key, const std::string& file);

}  // namespace mf

#include "common/json_file_impl.h"
