// SPDX-License-Identifier: Apache-2.0
#include "common/json_file.h"

#include "common/atomic_file.h"
#include "common/error.h"
#include "common/file_bytes.h"
#include "common/json_fault.h"

namespace mf {

nlohmann::json read_json_file(const std::filesystem::path& file) {
  const std::string text = read_file_bytes(file);
  if (const std::optional<JsonFault> fault = find_json_fault(text))
    throw InputError(file.string(), fault->field, fault->problem);
  return nlohmann::json::parse(text);
}

void write_json_file(const std::filesystem::path& file, const nlohmann::json& json) {
  write_file_atomically(file, json.dump(1) + "\n");
}

nlohmann::json rigid3_to_json(const Rigid3& target_from_source) {
  const Eigen::Matrix4d matrix = target_from_source.matrix();
  nlohmann::json rows = nlohmann::json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3)});
  return rows;
}

Rigid3 rigid3_from_json(const nlohmann::json& rows, const std::string& key, const std::string& file) {
  Eigen::Matrix4d matrix;
  const InputError wrong(file, key,
                         "is no 4×4 rigid transform: give four rows, rotation (det +1) and translation in metres");
  if (!rows.is_array() || rows.size() != 4) throw wrong;
  for (int r = 0; r < 4; ++r) {
    const nlohmann::json& row = rows[static_cast<std::size_t>(r)];
    if (!row.is_array() || row.size() != 4) throw wrong;
    for (int c = 0; c < 4; ++c) {
      const nlohmann::json& value = row[static_cast<std::size_t>(c)];
      if (!value.is_number()) throw wrong;
      matrix(r, c) = value.get<double>();
    }
  }
  const std::optional<Rigid3> transform = Rigid3::from_matrix(matrix);
  if (!transform) throw wrong;
  return *transform;
}

}  // namespace mf
