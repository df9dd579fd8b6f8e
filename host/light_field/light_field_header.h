// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ImfHeader.h>

#include <array>
#include <string>
#include <vector>

#include "host/light_field/light_field.h"

namespace mf {

// The headers of a `*.lf.exr` (docs/light_field.md, "The file"): part 0 holds the tiles, one further part each map.
inline constexpr std::array<const char*, 4> tile_channels{"R", "G", "B", "confidence"};

// Tiles of a file with so many directions lie in rows of ceil(√n).
[[nodiscard]] int atlas_columns(std::size_t directions);
[[nodiscard]] int atlas_rows(std::size_t directions);

// A map of the surroundings or an emitter, and the part that holds it.
struct NamedMap {
  std::string name;
  std::vector<const char*> channels;
  const ImageF* map;
  const ShadedEmitter* emitter = nullptr;  // whose mask it is
};

[[nodiscard]] std::vector<NamedMap> maps_of(const LightField&);

[[nodiscard]] Imf::Header header_of(const LightField&);
// All parts of a file share the display window: the field's.
[[nodiscard]] Imf::Header header_of(const NamedMap&, const Surroundings&, const Imath::Box2i& display_window);

// A light field from part 0's header, without its texels and maps. Throws InputError naming `file` and the attribute.
[[nodiscard]] LightField field_without_texels(const Imf::Header&, const std::string& file);
// The centre of the surroundings, their box or mesh if they have one, and an emitter without its mask, from the header
// of a map's part.
[[nodiscard]] Eigen::Vector3f centre_from(const Imf::Header&, const std::string& file);
void shape_from(const Imf::Header&, Surroundings&);
[[nodiscard]] ShadedEmitter emitter_from(const Imf::Header&, const std::string& file);

}  // namespace mf
