// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/atomic_file.h"
#include "host/light_field/light_field.h"

namespace mf {

// Writes `*.lf.exr` tile by tile, so that no more than the tiles at hand is ever in memory. The same tiles make the
// same bytes. Written aside and renamed by finish(); without it nothing is left.
//
// All throw InputError naming the file when it cannot be written.
class LightFieldWriter {
 public:
  // `field` has everything but its texels.
  LightFieldWriter(const std::filesystem::path&, const LightField& field);

  // One direction's tile (resolution² texels) as the file holds it: half floats, compressed. In any thread.
  [[nodiscard]] static std::string pack(const Eigen::Vector4f* tile, int resolution);

  // Every direction's packed tile, in order.
  void append(const std::string& packed);
  void finish();

 private:
  // A part of the file: its chunks' places in the table of offsets.
  struct Part {
    std::size_t table_begin = 0;  // in the file
    std::vector<std::uint64_t> offsets;
  };
  void write(const void* bytes, std::size_t size);
  void write_chunk(std::size_t part, std::initializer_list<std::int32_t> place, const std::string& data);
  void write_map(std::size_t part, const ImageF& map, const std::vector<const char*>& channels);
  void fill_tables();
  [[noreturn]] void fail() const;

  std::filesystem::path path_;
  const LightField& field_;
  AtomicFile file_;
  std::ofstream out_;
  std::uint64_t position_ = 0;
  std::vector<Part> parts_;
};

}  // namespace mf
