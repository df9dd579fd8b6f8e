// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/error.h"
#include "host/light_field/light_field.h"

namespace mf {
namespace {

class LightFieldFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("mf_field_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

LightField example() {
  LightField field;
  field.plane = {{Eigen::Quaterniond::Identity(), {0, 0, 0.25}}, {-0.3, -0.2}, {0.4, 0.5}};
  field.directions = geodesic_hemisphere(40);
  field.surroundings = sphere_surroundings({0.1F, 0.2F, 0.25F}, 2);
  field.surroundings.panorama = ImageF(8, 2, 4, 0.75F);
  field.emitters.push_back(
      {{{0.5F, 0.3F, 0.9F}, 0.05F, 12}, {3, 2, 1}, 0.4F, 0.25F, {-0.4F, -0.3F}, {0.5F, 0.6F}, ImageF(4, 4, 3, 0.5F)});
  field.resolution = 5;
  field.options_json = R"({"k":6})";
  field.rgbc.resize(field.directions.size() * 25);
  for (std::size_t i = 0; i < field.rgbc.size(); ++i)
    field.rgbc[i] = Eigen::Vector4f(static_cast<float>(i), 0.5F, 2, 1) * 0.25F;
  return field;
}

TEST_F(LightFieldFile, RoundTrip) {
  const LightField field = example();
  write_light_field(folder_ / "a.lf.exr", field);
  const LightField back = read_light_field(folder_ / "a.lf.exr");
  EXPECT_EQ(back.resolution, 5);
  EXPECT_EQ(back.surroundings.inverse_distance.data, field.surroundings.inverse_distance.data);
  EXPECT_EQ(back.surroundings.centre_in_world, field.surroundings.centre_in_world);
  EXPECT_EQ(back.surroundings.panorama.data, field.surroundings.panorama.data);
  EXPECT_EQ(back.options_json, field.options_json);
  EXPECT_EQ(back.plane.min_m, field.plane.min_m);
  EXPECT_TRUE(back.plane.world_from_plane.matrix().isApprox(field.plane.world_from_plane.matrix()));
  ASSERT_EQ(back.emitters.size(), 1u);
  EXPECT_EQ(back.emitters[0].emitter.position, field.emitters[0].emitter.position);
  EXPECT_EQ(back.emitters[0].occluder_share, 0.4F);
  EXPECT_EQ(back.emitters[0].mask.data, field.emitters[0].mask.data);
  ASSERT_EQ(back.rgbc.size(), field.rgbc.size());
  for (std::size_t i = 0; i < field.rgbc.size(); ++i) ASSERT_EQ(back.rgbc[i], field.rgbc[i]) << i;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.lf.exr.partial"));
}

TEST_F(LightFieldFile, DamageIsNamed) {
  write_light_field(folder_ / "a.lf.exr", example());
  std::filesystem::resize_file(folder_ / "a.lf.exr", std::filesystem::file_size(folder_ / "a.lf.exr") / 2);
  EXPECT_THROW((void)read_light_field(folder_ / "a.lf.exr"), InputError);
  EXPECT_THROW((void)read_light_field(folder_ / "missing.lf.exr"), InputError);
  std::ofstream(folder_ / "b.lf.exr") << "no picture at all";
  EXPECT_THROW((void)read_light_field(folder_ / "b.lf.exr"), InputError);
}

TEST_F(LightFieldFile, UnwritableFolderLeavesNothing) {
  EXPECT_THROW(write_light_field(folder_ / "none" / "a.lf.exr", example()), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST(SampleTile, TexelCentresAndOrientation) {
  LightField field = example();
  // Row 0 lies at max y; texel (2, 2) of 5 is the rectangle's middle.
  const Eigen::Vector4f middle = sample_tile(field, 3, {0.05F, 0.15F});
  EXPECT_NEAR(middle.x(), field.tile(3)[12].x(), 1e-4);
  const Eigen::Vector4f top_left = sample_tile(field, 3, {-0.3F, 0.5F});
  EXPECT_NEAR(top_left.x(), field.tile(3)[0].x(), 1e-4);
}

}  // namespace
}  // namespace mf
