// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>

#include "common/file_bytes.h"
#include "host/light_field/resample.h"
#include "tests/host/light_field/reference_tiles.h"
#include "tests/host/light_field/synthetic_views.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

const PlaneRectangle square{{}, {-0.2, -0.2}, {0.2, 0.2}};

// A papered wall 1.4 m about the origin, so that views focused elsewhere disagree; nothing of it is bright enough for
// an emitter.
Eigen::Vector3f wall(const Eigen::Vector3f& o, const Eigen::Vector3f& d) {
  const float b = o.dot(d), t = -b + std::sqrt(b * b - o.squaredNorm() + 1.4F * 1.4F);
  const Eigen::Vector3f x = o + t * d;
  return {1.2F + std::sin(9 * x.x()) * std::cos(8 * x.y()), 1 + 0.5F * std::sin(12 * x.z()), 0.7F};
}

const std::vector<FieldView>& views() {
  static const std::vector<FieldView> all = testing::analytic_views(120, 0.25F, 64, wall);
  return all;
}

ResampleOptions options_for(const std::string& proxy) {
  ResampleOptions options;
  options.proxy = proxy;
  options.directions = 300;
  options.size = 27;  // blocks are cut at two edges
  return options;
}

// RMS over random rays, relative; and of the confidence, absolute.
struct Difference {
  double radiance = 0, confidence = 0;
};

Difference difference_from_reference(const std::vector<FieldView>& all, const ResampleOptions& options,
                                     std::size_t each) {
  Resampling resampling(all, square, options, Team(), {});
  const LightField& field = resampling.field();
  testing::ReferenceTiles reference(all, field, options.proxy == "plane" ? 15 : 6);
  std::mt19937 random(3);
  std::uniform_int_distribution<int> any(0, options.size - 1);
  std::vector<Eigen::Vector4f> tile(field.texel_count());
  double difference = 0, total = 0, confidence = 0;
  int texels = 0;
  for (std::size_t direction = 0; direction < field.directions.size(); direction += each) {
    resampling.fill(direction, tile.data());
    for (int i = 0; i < 12; ++i, ++texels) {
      const int x = any(random), y = any(random);
      const Eigen::Vector4f expected = reference.texel(direction, x, y);
      const Eigen::Vector4f& actual = tile[static_cast<std::size_t>(y * options.size + x)];
      difference += static_cast<double>((actual - expected).head<3>().squaredNorm());
      total += static_cast<double>(expected.head<3>().squaredNorm());
      confidence += static_cast<double>(std::abs(actual.w() - expected.w()));
    }
  }
  return {std::sqrt(difference / total), confidence / texels};
}

class AgainstReference : public ::testing::TestWithParam<const char*> {};

TEST_P(AgainstReference, TilesAreWhatTheDefinitionSays) {
  const Difference d = difference_from_reference(views(), options_for(GetParam()), 3);
  EXPECT_LT(d.radiance, 0.01);
  EXPECT_LT(d.confidence, 0.01);
}

// So many views that those of a block's texels are not the same, and a lamp that few of them see.
TEST(AgainstReference, PlaneWithManyViewsAndALamp) {
  const std::vector<FieldView> many =
      testing::analytic_views(1500, 0.15F, 48, [](const Eigen::Vector3f& o, const Eigen::Vector3f& d) {
        const Eigen::Vector3f lamp = Eigen::Vector3f(0.3F, 0.2F, 0.9F).normalized();
        return Eigen::Vector3f(wall(o, d) + (d.dot(lamp) > 0.995F ? 300.0F : 0.0F) * Eigen::Vector3f::Ones());
      });
  ResampleOptions options = options_for("plane");
  options.size = 64;
  const Difference d = difference_from_reference(many, options, 5);
  EXPECT_LT(d.radiance, 0.01);
  EXPECT_LT(d.confidence, 0.01);
}

// A lamp that a view shows in nothing but its soft border keeps its radiance.
TEST(PlaneTiles, ALampAtAViewsBorderIsAsBrightAsItIs) {
  const Eigen::Vector3f centre(0, 0, -0.8F);
  const std::vector<FieldView> one{testing::analytic_view(
      centre, Eigen::Vector3f::Zero(), 64, [&](const Eigen::Vector3f&, const Eigen::Vector3f& d) {
        constexpr float two_columns = 30 / (1.2F * 64);  // from the middle to what they begin at
        const Eigen::Vector3f aside = Eigen::Vector3f::UnitZ().unitOrthogonal();
        return Eigen::Vector3f(Eigen::Vector3f::Ones() * (d.dot(aside) < -two_columns * d.z() ? 1000.0F : 1.0F));
      })};
  ResampleOptions options = options_for("plane");
  options.size = 64;
  options.fill = false;
  Resampling resampling(one, {{}, {-0.35, -0.35}, {0.35, 0.35}}, options, Team(), {});
  std::vector<Eigen::Vector4f> tile(resampling.field().texel_count());
  resampling.fill(0, tile.data());
  float brightest = 0, seen = 0;
  for (const Eigen::Vector4f& texel : tile) {
    brightest = std::max(brightest, texel.x());
    if (texel.x() > 900) seen = std::max(seen, texel.w());
  }
  EXPECT_NEAR(brightest, 1000, 2);
  EXPECT_LT(seen, 0.2F) << "not the border alone";
}

INSTANTIATE_TEST_SUITE_P(Proxies, AgainstReference,
                         ::testing::Values("plane", "sphere:1.4", "sphere:0.7", "sphere:inf"), [](const auto& name) {
                           std::string word = name.param;
                           std::replace_if(
                               word.begin(), word.end(), [](char c) { return !std::isalnum(c); }, '_');
                           return word;
                         });

// However many threads, and whatever was asked before: the same bytes.
TEST(ResampleToFile, IsTheSameWithAnyNumberOfThreads) {
  const test::TemporaryFolder folder;
  for (const char* proxy : {"plane", "sphere:1.4"}) {
    std::vector<std::string> files;
    for (const std::size_t threads : {1U, 3U}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      Resampling resampling(views(), square, options_for(proxy), Team(), {});
      if (threads > 1) {
        std::vector<Eigen::Vector4f> tile(resampling.field().texel_count());
        resampling.fill(17, tile.data());
      }
      Team alone;
      const ResampleResult r = resample_to_file(resampling, folder / "a.lf.exr", false, alone, {});
      EXPECT_TRUE(r.field.rgbc.empty());
      files.push_back(read_file_bytes(folder / "a.lf.exr"));
    }
    EXPECT_TRUE(files[0] == files[1]) << proxy;
  }
}

// Streamed into a file and read by OpenEXR: what resample() keeps in memory, rounded to half floats.
TEST(ResampleToFile, HoldsWhatResampleReturns) {
  const test::TemporaryFolder folder;
  const ResampleResult kept = resample(views(), square, options_for("sphere:1.4"), {});
  Resampling resampling(views(), square, options_for("sphere:1.4"), Team(), {});
  Team alone;
  const ResampleResult streamed = resample_to_file(resampling, folder / "a.lf.exr", true, alone, {});
  EXPECT_DOUBLE_EQ(streamed.mean_confidence, kept.mean_confidence);
  const LightField back = read_light_field(folder / "a.lf.exr");
  EXPECT_TRUE(back.absolute);
  ASSERT_EQ(back.rgbc.size(), kept.field.rgbc.size());
  for (std::size_t i = 0; i < back.rgbc.size(); ++i)
    for (int c = 0; c < 4; ++c) {
      std::uint16_t expected = to_half(kept.field.rgbc[i][c]);
      ASSERT_EQ(to_half(back.rgbc[i][c]), expected);
    }
}

}  // namespace
}  // namespace mf
