// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/provenance.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/error.h"
#include "host/light_field/ray_answer.h"
#include "host/light_field/resample.h"
#include "tests/host/light_field/synthetic_views.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

const PlaneRectangle square{{}, {-0.2, -0.2}, {0.2, 0.2}};

// Each view in a colour of its own: what a texel shows tells who lit it.
std::vector<FieldView> coloured_views(int count) {
  std::vector<FieldView> views =
      testing::analytic_views(count, 0.25F, 32, [](const auto&, const auto&) { return Eigen::Vector3f::Ones(); });
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].frame = 2 * i + 1;  // every second frame of the session was used
    const Eigen::Array3f colour(1 + static_cast<float>(i % 5), 1 + static_cast<float>(i % 7),
                                1 + static_cast<float>(i % 11));
    for (PremultipliedImage& level : views[i].levels)
      for (int y = 0; y < level.height(); ++y)
        for (int x = 0; x < level.width(); ++x) level.at(x, y).head<3>().array() *= colour;
  }
  return views;
}

ResampleResult resampled(const std::vector<FieldView>& views, const std::string& proxy) {
  ResampleOptions options;
  options.directions = 150;
  options.size = 32;
  options.proxy = proxy;
  options.provenance = true;
  ResampleResult r = resample(views, square, options, {});
  for (std::size_t i = 0; i < 2 * views.size() + 1; ++i) r.provenance->frames.push_back(std::to_string(i) + ".png");
  return r;
}

TEST(Provenance, TellsWhoLitTheTexels) {
  const auto views = coloured_views(120);
  for (const std::string proxy : {"sphere:inf", "sphere:1.4", "plane"}) {
    const ResampleResult r = resampled(views, proxy);
    const Provenance& p = *r.provenance;
    EXPECT_EQ(p.side, 2);
    EXPECT_EQ(p.k, proxy == "plane" ? 15 : 6);
    int lit = 0, right = 0;
    for (std::size_t i = 0; i < r.field.directions.size(); ++i)
      for (int by = 0; by < 2; ++by)
        for (int bx = 0; bx < 2; ++bx) {
          Eigen::Vector3f expected = Eigen::Vector3f::Zero();
          float sum = 0;
          for (const Provenance::Share& share : p.of_block(p.block(i, bx, by))) {
            if (share.weight <= 0) continue;
            ASSERT_EQ(share.frame % 2, 1U);
            const Eigen::Vector4f& any = views[share.frame / 2].levels.back().at(0, 0);
            expected += share.weight * any.head<3>() / any.w();
            sum += share.weight;
          }
          // The block's middle lies between four texels.
          Eigen::Vector4f texel = Eigen::Vector4f::Zero();
          for (int t = 0; t < 4; ++t)
            texel += 0.25F * r.field.tile(i)[(16 * by + 7 + t / 2) * 32 + 16 * bx + 7 + t % 2];
          if (texel.w() < 0.9F) continue;
          ASSERT_NEAR(sum, 1, 1e-4);
          // Tiles average a view's weight over the cell's parts: near borders the shares differ a little.
          right += (texel.head<3>() - expected).norm() < 0.12F * expected.norm() ? 1 : 0;
          ++lit;
        }
    EXPECT_GT(lit, 200) << proxy;
    EXPECT_GT(right, 0.97 * lit) << proxy;
  }
}

TEST(Provenance, FilesComeBackAndPointsFindTheirBlock) {
  const test::TemporaryFolder folder;
  const ResampleResult r = resampled(coloured_views(60), "sphere:inf");
  write_provenance(folder / "p.exr", *r.provenance);
  const Provenance back = read_provenance(folder / "p.exr");
  EXPECT_EQ(back.side, r.provenance->side);
  EXPECT_EQ(back.frames, r.provenance->frames);
  EXPECT_EQ(back.emitter, r.provenance->emitter);
  ASSERT_EQ(back.shares.size(), r.provenance->shares.size());
  for (std::size_t i = 0; i < back.shares.size(); ++i) {
    ASSERT_EQ(back.shares[i].frame, r.provenance->shares[i].frame);
    ASSERT_EQ(back.shares[i].weight, r.provenance->shares[i].weight);
  }
  EXPECT_EQ(back.block_at(square, 32, 3, {-0.1F, 0.1F}), back.block(3, 0, 0));  // row 0 is at max y
  EXPECT_EQ(back.block_at(square, 32, 3, {0.1F, -5}), back.block(3, 1, 1));
}

TEST(Provenance, DamageIsNamed) {
  const test::TemporaryFolder folder;
  EXPECT_THROW((void)read_provenance(folder / "missing.exr"), InputError);
  std::ofstream(folder / "bad.exr") << "no picture";
  EXPECT_THROW((void)read_provenance(folder / "bad.exr"), InputError);
  EXPECT_THROW(write_provenance(folder / "none" / "p.exr", {1, 1, {"a"}, {{0, 1.0F}}, {0}}), InputError);
}

// A view that saw the very ray speaks alone, up to its border; the other views fill in when it is left out.
TEST(RayAnswer, AViewAnswersForItsOwnRays) {
  const auto views = coloured_views(80);
  const Surroundings s = sphere_surroundings({0, 0, 0}, 2);
  int asked = 0;
  for (std::uint32_t v = 0; v < views.size(); v += 7) {
    const Eigen::Vector3f d = views[v].pixel_from_world.row(2).head<3>().normalized();
    const Eigen::Vector3f p = views[v].centre_in_world - views[v].centre_in_world.z() / d.z() * d;
    const WantedRay ray{p, d, 0.02F};
    const RayAnswer own = answer_of(views, s, ray, {{6, 1, 0, 1}, nullptr, nullptr, {}});
    ASSERT_FALSE(own.speaking.empty());
    EXPECT_EQ(own.speaking[0].view, v);
    EXPECT_GT(own.speaking[0].weight, 0.9F);
    for (const SpeakingView& other : answer_of(views, s, ray, {{6, 1, 0, 1}, nullptr, nullptr, v}).speaking)
      EXPECT_NE(other.view, v);
    ++asked;
  }
  EXPECT_GT(asked, 8);
}

}  // namespace
}  // namespace mf
