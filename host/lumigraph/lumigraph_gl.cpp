// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/lumigraph_gl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>

#include "common/check.h"
#include "host/lumigraph/atlas_gl.h"
#include "host/lumigraph/proxy_surface_gl.h"

namespace mf {

namespace {

constexpr int most_photo_pages = 8;  // units 2 to 9: shaders/lumigraph_photos.comp
constexpr int most_sight_pages = 4;  // units 10 to 13: shaders/common_photos.glsl. Compute shaders have at least 16
constexpr GLuint photos_unit = 2;
constexpr GLuint sights_unit = 10;
constexpr GLuint scratch_unit = 15;  // where textures are filled
constexpr int group_side = 8;        // shaders/common_lumigraph.glsl

// std430 and std140; mirror Photo, Speaker and BlendBlock of shaders/common_photos.glsl.
using Vec4 = std::array<float, 4>;
using Int4 = std::array<std::int32_t, 4>;
struct GlslPhoto {
  Vec4 focal, distortion, lens, limits, sight;
  Int4 sight_at, levels;
  Vec4 colour;
};
struct GlslSpeaker {
  std::array<Vec4, 3> rows;
  Vec4 from_centre;
  float per_border_px;
  std::int32_t photo;
  std::array<std::int32_t, 2> unused;
};
struct GlslBlend {
  Vec4 penalty, wanted;
  Int4 count;
};
static_assert(offsetof(GlslPhoto, sight) == 64 && offsetof(GlslPhoto, sight_at) == 80 &&
              offsetof(GlslPhoto, levels) == 96 && offsetof(GlslPhoto, colour) == 112 && sizeof(GlslPhoto) == 128);
static_assert(offsetof(GlslSpeaker, from_centre) == 48 && offsetof(GlslSpeaker, per_border_px) == 64 &&
              offsetof(GlslSpeaker, photo) == 68 && sizeof(GlslSpeaker) == 80);
static_assert(offsetof(GlslBlend, wanted) == 16 && offsetof(GlslBlend, count) == 32 && sizeof(GlslBlend) == 48);

constexpr float same_ray = 1e-6F;  // radians: what single precision leaves of an angle of 0

template <typename T>
constexpr GlAtlas::Format photo_format = {GL_RGBA32F, GL_RGBA, GL_FLOAT, 16};
template <>
constexpr GlAtlas::Format photo_format<std::uint8_t> = {GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, 4};
constexpr GlAtlas::Format sight_format = {GL_RG16, GL_RG, GL_UNSIGNED_SHORT, 4};

std::vector<std::array<int, 2>> level_sizes(const PhotoPyramids& pyramids) {
  std::vector<std::array<int, 2>> sizes;
  std::visit(
      [&](const auto& photos) {
        for (const auto& photo : photos)
          for (const auto& level : photo.levels()) sizes.push_back({level.width, level.height});
      },
      pyramids);
  return sizes;
}

std::vector<std::array<int, 2>> sight_sizes(const std::vector<SourceSight>& sights) {
  std::vector<std::array<int, 2>> sizes;
  for (const SourceSight& sight : sights)
    if (!sight.empty()) sizes.push_back({sight.width, sight.height});
  return sizes;
}

GlAtlas::Format format_of(const PhotoPyramids& pyramids) {
  return std::holds_alternative<std::vector<PhotoPyramid<float>>>(pyramids) ? photo_format<float>
                                                                            : photo_format<std::uint8_t>;
}

GlslPhoto glsl_photo(const AnsweringCamera& c, std::uint32_t number) {
  GlslPhoto photo{};
  photo.focal = {c.fx, c.fy, c.cx, c.cy};
  photo.distortion = {c.distortion[0], c.distortion[1], c.distortion[2], c.distortion[3]};
  photo.lens = {c.distortion[4], std::min(c.largest_r2, 1e30F), c.width, c.height};
  photo.limits = {c.left, c.top, c.right, c.bottom};
  photo.sight_at = {0, 0, 0, -1};
  const auto colour = field_colour(number);
  for (std::size_t i = 0; i < 3; ++i) photo.colour[i] = static_cast<float>(colour[i]) / 255;
  return photo;
}

GlslSpeaker glsl_speaker(const AnsweringView& view, std::uint32_t number) {
  GlslSpeaker speaker{};
  for (std::size_t i = 0; i < 3; ++i) {
    speaker.rows[i] = {view.cam_from_world[3 * i], view.cam_from_world[3 * i + 1], view.cam_from_world[3 * i + 2],
                       view.eye_in_cam[i]};
    speaker.from_centre[i] = view.eye_from_centre[i];
  }
  speaker.from_centre[3] = view.time_penalty;
  speaker.per_border_px = view.per_border_px;
  speaker.photo = static_cast<std::int32_t>(number);
  return speaker;
}

template <typename T>
void fill(GlBuffer& buffer, GLenum target, GLuint binding, std::span<const T> values, GLenum usage) {
  glBindBuffer(target, buffer.name());
  glBufferData(target, static_cast<GLsizeiptr>(values.size_bytes()), values.data(), usage);
  glBindBufferBase(target, binding, buffer.name());
}

}  // namespace

struct GlLumigraph::Impl {
  explicit Impl(const Lumigraph&);

  void upload_photos();
  void upload_sights();
  [[nodiscard]] std::vector<GlslSpeaker> speakers(const FrameInput&, const View&) const;
  void use_program(int k, Shown);
  void set_target(GLenum format, int width, int height);
  void draw(const View&, const LumigraphOptions&, std::span<const std::uint32_t> views);

  const Lumigraph& lumigraph;
  GlProxySurface surface;
  GlAtlas photos, sights;
  std::vector<GlslPhoto> records;
  GlBuffer photo_buffer, level_buffer, speaker_buffer, blend_block;
  std::map<std::pair<int, Shown>, GlProgram> programs;  // by k: arrays in registers have its length
  GlTexture target;
  std::array<int, 3> target_layout{};  // format, width, height
};

GlLumigraph::Impl::Impl(const Lumigraph& l)
    : lumigraph(l),
      surface(l.proxy()),
      photos(level_sizes(l.pyramids()), format_of(l.pyramids()), most_photo_pages, "the photos"),
      sights(sight_sizes(l.sights()), sight_format, most_sight_pages, "what the photos see of the proxy"),
      photo_buffer(make_buffer()),
      level_buffer(make_buffer()),
      speaker_buffer(make_buffer()),
      blend_block(make_buffer()) {
  for (std::uint32_t i = 0; i < l.cameras().size(); ++i) records.push_back(glsl_photo(l.cameras()[i], i));
  glActiveTexture(GL_TEXTURE0 + scratch_unit);
  upload_photos();
  upload_sights();
  fill<GlslPhoto>(photo_buffer, GL_SHADER_STORAGE_BUFFER, 3, records, GL_STATIC_DRAW);
  check_gl("copying the photos");
}

// And the places of their levels: (column | row << 16, width | height << 16, layer, page).
void GlLumigraph::Impl::upload_photos() {
  std::vector<std::array<std::uint32_t, 4>> levels;
  const auto two = [](int low, int high) {
    return static_cast<std::uint32_t>(low) | static_cast<std::uint32_t>(high) << 16U;
  };
  std::visit(
      [&](const auto& pyramids) {
        for (std::size_t i = 0; i < pyramids.size(); ++i) {
          records[i].levels = {static_cast<int>(levels.size()), static_cast<int>(pyramids[i].levels().size()), 0, 0};
          for (const auto& level : pyramids[i].levels()) {
            photos.upload(levels.size(), level.texels.data());
            const AtlasPlace& at = photos.place(levels.size());
            levels.push_back({two(at.x, at.y), two(level.width, level.height), static_cast<std::uint32_t>(at.layer),
                              static_cast<std::uint32_t>(at.page)});
          }
        }
      },
      lumigraph.pyramids());
  fill<std::array<std::uint32_t, 4>>(level_buffer, GL_SHADER_STORAGE_BUFFER, 5, levels, GL_STATIC_DRAW);
}

void GlLumigraph::Impl::upload_sights() {
  std::size_t rectangle = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const SourceSight& sight = lumigraph.sights()[i];
    if (sight.empty()) continue;
    sights.upload(rectangle, sight.texels.data());  // a texel's lower half first: trust
    const AtlasPlace& at = sights.place(rectangle++);
    records[i].sight = {sight.texels_per_px, sight.scale, static_cast<float>(sight.width - 1),
                        static_cast<float>(sight.height - 1)};
    records[i].sight_at = {at.x, at.y, at.layer, at.page};
  }
}

// Those first that speak well for the middle of the picture: whom they out-vote everywhere in a group is told sooner.
std::vector<GlslSpeaker> GlLumigraph::Impl::speakers(const FrameInput& input, const View& view) const {
  const Eigen::Vector2d middle(0.5 * view.camera.width, 0.5 * view.camera.height);
  const Eigen::Vector3d eye = view.cam_from_world.inverse().translation;
  const auto met = lumigraph.point_at(view, middle);
  const Eigen::Vector3f x =
      (met ? *met - eye : view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ()).cast<float>();
  std::vector<std::pair<float, std::uint32_t>> order;
  for (const std::uint32_t number : input.speaking) {
    const AnsweringView& from = input.views[number];
    const Eigen::Vector3f from_centre = x + Eigen::Map<const Eigen::Vector3f>(from.eye_from_centre.data());
    order.emplace_back((from_centre.normalized() - x.normalized()).norm() + from.time_penalty, number);
  }
  std::sort(order.begin(), order.end());
  std::vector<GlslSpeaker> speakers;
  for (const auto& [chord, number] : order) speakers.push_back(glsl_speaker(input.views[number], number));
  return speakers;
}

void GlLumigraph::Impl::use_program(int k, Shown shown) {
  GlProgram& program = programs[{k, shown}];
  if (program.name() == 0) {
    const std::array<ShaderConstant, 3> constants{
        {{"k", k}, {"photo_pages", std::max(photos.pages(), 1)}, {"sight_pages", std::max(sights.pages(), 1)}}};
    program =
        make_compute_program(shown == Shown::photos ? "lumigraph_photos.comp" : "lumigraph_field.comp", constants);
  }
  glUseProgram(program.name());
}

void GlLumigraph::Impl::set_target(GLenum format, int width, int height) {
  const std::array<int, 3> layout{static_cast<int>(format), width, height};
  if (target_layout != layout) {
    target = make_texture();
    glActiveTexture(GL_TEXTURE0 + scratch_unit);
    glBindTexture(GL_TEXTURE_2D, target.name());
    glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
    target_layout = layout;
  }
  glBindImageTexture(0, target.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, format);
}

void GlLumigraph::Impl::draw(const View& view, const LumigraphOptions& options, std::span<const std::uint32_t> views) {
  const FrameInput input = lumigraph.frame_input(view, options, views);
  const std::vector<GlslSpeaker> speaking = speakers(input, view);
  surface.find(view);
  const PenaltyOptions& o = options.penalty;
  const GlslBlend block{{o.angle, o.resolution, o.border, lumigraph.visibility().tolerance},
                        {input.wanted.focal2, input.wanted.beyond, same_ray, 0},
                        {static_cast<int>(speaking.size()), 0, 0, 0}};
  fill<GlslSpeaker>(speaker_buffer, GL_SHADER_STORAGE_BUFFER, 4, speaking, GL_STREAM_DRAW);
  fill<GlslBlend>(blend_block, GL_UNIFORM_BUFFER, 1, {&block, 1}, GL_STREAM_DRAW);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, photo_buffer.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 5, level_buffer.name());
  photos.bind(photos_unit);
  sights.bind(sights_unit);
  const bool floats =
      options.shown == Shown::photos && std::holds_alternative<std::vector<PhotoPyramid<float>>>(lumigraph.pyramids());
  set_target(floats ? GL_RGBA32F : GL_RGBA8, view.camera.width, view.camera.height);
  use_program(o.k, options.shown);
  dispatch_over(view.camera.width, view.camera.height, group_side);
  glMemoryBarrier(GL_TEXTURE_UPDATE_BARRIER_BIT);
}

namespace {

// The last channel tells how a pixel is covered.
template <typename T>
LumigraphPicture read_back(GLuint texture, GLenum type, int width, int height) {
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<T> texels(4 * pixels);
  glActiveTexture(GL_TEXTURE0 + scratch_unit);
  glBindTexture(GL_TEXTURE_2D, texture);
  glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, type, texels.data());
  check_gl("making a frame");
  Image<T> picture(width, height, 3);
  ImageU8 covered(width, height, 1);
  constexpr float full = std::is_integral_v<T> ? 1 : 255;
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) picture.data[3 * i + c] = texels[4 * i + c];
    covered.data[i] = static_cast<std::uint8_t>(full * static_cast<float>(texels[4 * i + 3]) + 0.5F);
  }
  return {std::move(picture), std::move(covered)};
}

}  // namespace

GlLumigraph::GlLumigraph(const EglContext&, const Lumigraph& lumigraph) : impl_(std::make_unique<Impl>(lumigraph)) {}
GlLumigraph::GlLumigraph(GlLumigraph&&) noexcept = default;
GlLumigraph::~GlLumigraph() = default;

LumigraphPicture GlLumigraph::render(const View& view, const LumigraphOptions& options,
                                     std::span<const std::uint32_t> views) const {
  impl_->draw(view, options, views);
  const int width = view.camera.width;
  const int height = view.camera.height;
  return impl_->target_layout[0] == GL_RGBA32F
             ? read_back<float>(impl_->target.name(), GL_FLOAT, width, height)
             : read_back<std::uint8_t>(impl_->target.name(), GL_UNSIGNED_BYTE, width, height);
}

}  // namespace mf
