// SPDX-License-Identifier: Apache-2.0
#include "tests/host/import/small_recording.h"

#include <fmt/format.h>

#include "common/json_file.h"
#include "common/tiff_image.h"
#include "host/io/exr.h"
#include "tests/support/foreign_png.h"
#include "tests/support/pictures.h"

namespace mf::test {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {
constexpr int width = 40, height = 30;
constexpr int scene_index = 100, sweep_index = 200;
}  // namespace

FramePixels small_pixels(const PixelFormat& format, int i) {
  return random_pixels(format, width, height, static_cast<unsigned>(i));
}

SmallRecording::SmallRecording(const PixelFormat& pixel_format)
    : format(pixel_format),
      camera{{"pixel_format", pixel_format_name(format)},
             {"bits", format.bits},
             {"black_level_hint", 16},
             {"mirror_reflectance", 0.9},
             {"frames_primaries", "linear BT.709 after demosaicing"}},
      target{{"family", "tag36h11"},
             {"tag_size_m", 0.03},
             {"opening_m", {0.3, 0.2}},
             {"tags", {{{"id", 0}, {"centre_m", {-0.2, 0.13}}}, {{"id", 1}, {"centre_m", {0.2, -0.13}}}}}},
      world{{"family", "tag36h11"},
            {"tags",
             {{{"id", 100}, {"size_m", 0.08}, {"centre_in_world_m", {-0.2, 0, 0}}},
              {{"id", 101}, {"size_m", 0.08}, {"centre_in_world_m", {0.2, 0, 0}}}}}} {
  if (format.linear_float) extension = "exr";
  for (int i = 0; i < 4; ++i)
    frames.push_back({{"frame", fmt::format("{:05}.{}", i, extension)}, {"exposure_s", 0.01}, {"time_s", 0.1 * i}});
  for (int i = 0; i < 3; ++i)
    sweep.push_back({{"frame", fmt::format("nd{}.{}", i, extension)}, {"exposure_s", 0.014}, {"nd_density", 0.3 * i}});
  reference = {
      {"frame", "scene." + extension}, {"pixel", {20.5, 15.5}}, {"radius_px", 3}, {"meaning", "a spot meter reading"}};
  if (format.layout == PixelLayout::mono)
    reference["radiance"] = 0.7;
  else
    reference["radiance_rgb"] = {0.7, 0.6, 0.5};
}

void write_picture(const fs::path& file, const FramePixels& pixels, int bits) {
  if (file.extension() == ".tif")
    write_bytes(file, encode_tiff(pixels));
  else if (file.extension() == ".exr")
    write_exr(file, std::get<ImageF>(pixels), {.half = false});
  else
    write_bytes(file, foreign_png(std::get<ImageU16>(pixels), bits <= 8 ? 8 : 16));
}

void SmallRecording::write(const fs::path& folder) const {
  fs::create_directories(folder / "frames");
  fs::create_directories(folder / "sweep");
  const std::array<std::pair<const char*, const json*>, 6> documents{{{"camera", &camera},
                                                                      {"frames", &frames},
                                                                      {"target", &target},
                                                                      {"world", &world},
                                                                      {"sweep", &sweep},
                                                                      {"reference", &reference}}};
  for (const auto& [name, document] : documents)
    if (!document->is_null()) write_json_file(folder / (std::string(name) + ".json"), *document);
  for (int i = 0; i < 4; ++i)
    write_picture(folder / fmt::format("frames/{:05}.{}", i, extension), small_pixels(format, i), format.bits);
  for (int i = 0; i < 3; ++i)
    write_picture(folder / fmt::format("sweep/nd{}.{}", i, extension), small_pixels(format, sweep_index + i),
                  format.bits);
  write_picture(folder / ("scene." + extension), small_pixels(format, scene_index), format.bits);
}

}  // namespace mf::test
