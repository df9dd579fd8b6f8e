// SPDX-License-Identifier: Apache-2.0
// Tiles straight from the views against those of the whole light field, which is the reference.
#include "host/light_field/just_in_time.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "host/light_field/emitter_blender.h"
#include "host/light_field/emitter_light.h"
#include "host/light_field/ray_answer.h"
#include "host/light_field/resample.h"
#include "tests/host/light_field/synthetic_views.h"

namespace mf {
namespace {

const PlaneRectangle square{{}, {-0.2, -0.2}, {0.2, 0.2}};

// A globe lamp behind a striped leaf, before a sky that differs by direction.
Eigen::Vector3f lamp_and_sky(const Eigen::Vector3f& o, const Eigen::Vector3f& d) {
  const Eigen::Vector3f to = Eigen::Vector3f(0.3F, 0.2F, 0.9F) - o;
  const float along = to.dot(d);
  const bool hit = along > 0 && to.squaredNorm() - along * along < 0.05F * 0.05F;
  const Eigen::Vector3f at = o + (0.45F - o.z()) / d.z() * d;
  const bool hidden = std::sin(40 * at.x()) > 0.4F;
  if (hit) return Eigen::Vector3f::Constant(hidden ? 0.05F : 100.F);
  return {0.2F + 0.1F * d.x(), 0.2F, 0.1F + 0.2F * d.z()};
}

class JustInTime : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    views_ = new std::vector(testing::analytic_views(200, 0.25F, 96, lamp_and_sky));
    ResampleOptions options;
    options.directions = 661;
    options.size = 32;
    options.proxy = "sphere:1.2";
    const Resampling focused(*views_, square, options, Team(), Progress());
    focused_ = new LightField(focused.field());
    penalty_ = focused.penalty();
    whole_ = new LightField(resample(*views_, square, options, Progress()).field);
    dark_ = new DarkTiles(tiles_without_emitters(*whole_));
  }
  static void TearDownTestSuite() {
    delete views_;
    delete focused_;
    delete dark_;
    delete whole_;
  }

  static std::vector<PlaneTile> tiles(const std::vector<TileRequest>& requests, int most_texels, bool rough = false) {
    return resample_just_in_time(*views_, *focused_, penalty_, requests, {most_texels, rough});
  }

  // Light of all requests at p: Σ tile(p) · solid angle of its cells.
  static Eigen::Vector3f light_at(const std::vector<PlaneTile>& tiles, const std::vector<TileRequest>& requests,
                                  const Eigen::Vector2f& p) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (std::size_t i = 0; i < tiles.size(); ++i)
      for (const std::uint32_t cell : requests[i].cells)
        sum += whole_->directions.solid_angles_sr[cell] * sample(tiles[i].image(), p).head<3>();
    return sum;
  }

  static std::vector<FieldView>* views_;
  static LightField* focused_;  // no texels
  static PenaltyOptions penalty_;
  static LightField* whole_;
  static DarkTiles* dark_;  // without the lamp
};
std::vector<FieldView>* JustInTime::views_ = nullptr;
LightField* JustInTime::focused_ = nullptr;
PenaltyOptions JustInTime::penalty_;
LightField* JustInTime::whole_ = nullptr;
DarkTiles* JustInTime::dark_ = nullptr;

// Runs of seven cells each, over the given part of the plane.
std::vector<TileRequest> runs_of_cells(std::size_t cells, const Eigen::Vector2f& low, const Eigen::Vector2f& high) {
  std::vector<TileRequest> requests;
  for (std::uint32_t i = 0; i < cells; ++i) {
    if (i % 7 == 0) requests.push_back({{}, low, high});
    requests.back().cells.push_back(i);
  }
  return requests;
}

TEST_F(JustInTime, AsFineAsTheFieldItIsTheField) {
  ASSERT_EQ(whole_->emitters.size(), 1U);
  const auto requests = runs_of_cells(whole_->directions.size(), {-0.2F, -0.2F}, {0.2F, 0.2F});
  const auto ours = tiles(requests, 32), field = merged_tiles(whole_->directions, dark_->images, requests);
  const Eigen::Vector3f middle = light_at(field, requests, {0, 0});
  for (std::size_t i = 0; i < requests.size(); ++i)
    for (const float x : {-0.15F, -0.04F, 0.07F, 0.18F})
      for (const float y : {-0.17F, 0.02F, 0.12F}) {
        const Eigen::Vector3f difference =
            (sample(ours[i].image(), {x, y}) - sample(field[i].image(), {x, y})).head<3>();
        float solid_angle = 0;
        for (const std::uint32_t cell : requests[i].cells) solid_angle += whole_->directions.solid_angles_sr[cell];
        EXPECT_LT(difference.norm() * solid_angle, 0.01F * middle.norm()) << i << " at " << x << " " << y;
      }
}

// The dark tiles lack the lamp's light, all of it and nothing else.
TEST_F(JustInTime, DarkTilesLackTheLampAndNothingElse) {
  const auto requests = runs_of_cells(whole_->directions.size(), {-0.2F, -0.2F}, {0.2F, 0.2F});
  const auto all = merged_tiles(whole_->directions, images_of(*whole_), requests);
  const auto dark = merged_tiles(whole_->directions, dark_->images, requests);
  const ShadedEmitter& e = whole_->emitters.front();
  float lit = 0, expected = 0, left = 0, sky = 0;
  for (int i = 0; i < 64; ++i) {
    const Eigen::Vector2f p(-0.18F + 0.045F * static_cast<float>(i % 8), -0.17F + 0.045F * static_cast<float>(i / 8));
    const Eigen::Vector3f at(p.x(), p.y(), 0), to = e.emitter.position - at;
    const float sine = e.emitter.radius_m / to.norm();
    expected += e.visibility(at, to.normalized()).value_or(0) * 3.14159F * sine * sine * e.radiance.x();
    lit += light_at(all, requests, p).x() - light_at(dark, requests, p).x();
    left += light_at(dark, requests, p).x();
    sky += 0.2F * 2 * 3.14159F;
  }
  EXPECT_NEAR(lit, expected, 0.05F * expected);
  EXPECT_NEAR(left, sky, 0.02F * sky);
}

TEST_F(JustInTime, APreviewOfAPartOfThePlaneBringsTheSameLight) {
  const Eigen::Vector2f low(-0.05F, 0.02F), high(0.06F, 0.15F);
  const auto requests = runs_of_cells(whole_->directions.size(), low, high);
  const auto field = merged_tiles(whole_->directions, dark_->images, requests);
  for (const bool rough : {false, true}) {
    const auto ours = tiles(requests, 8, rough);
    EXPECT_LE(ours.back().texels.size(), 64U);  // beside the lamp
    for (const float u : {0.F, 0.3F, 0.6F, 1.F})
      for (const float v : {0.F, 0.5F, 1.F}) {
        const Eigen::Vector2f p = low + Eigen::Vector2f(u, v).cwiseProduct(high - low);
        const Eigen::Vector3f expected = light_at(field, requests, p);
        EXPECT_LT((light_at(ours, requests, p) - expected).norm(), 0.01F * expected.norm())
            << rough << " at " << p.transpose();
      }
  }
}

// Views that pass a ray beside the lamp too far off to speak for it are not asked; the answer is that of all.
TEST_F(JustInTime, TheNearestViewsAnswerForAll) {
  const Surroundings& s = focused_->surroundings;
  const EmitterBlender blender(*views_, s, focused_->emitters, EmitterBlender::Lit::no);
  std::vector<std::uint32_t> candidates(views_->size());
  std::iota(candidates.begin(), candidates.end(), 0U);
  int answered = 0;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3f p(-0.18F + 0.018F * static_cast<float>(i % 20), 0.05F, 0);
    const Eigen::Vector3f at = focused_->emitters.front().emitter.position +
                               Eigen::Vector3f(-0.2F + 0.02F * static_cast<float>(i / 20), 0.01F, 0);
    const Eigen::Vector3f d = (at - p).normalized();
    if (emitter_met(focused_->emitters, p, d) != nullptr) continue;
    const RayAnswer of_all = answer_of(*views_, s, {p, d, 0.02F}, {{4, 1, 0, 1}, nullptr, &blender, {}});
    const Eigen::Vector4f answer = blender.radiance(nullptr, p, d, 0.02F, candidates);
    EXPECT_LE((answer.head<3>() - of_all.radiance).norm(), 1e-4F * of_all.radiance.norm()) << i;
    EXPECT_NEAR(answer.w(), of_all.confidence, 1e-4F) << i;
    answered += of_all.speaking.empty() ? 0 : 1;
  }
  EXPECT_GT(answered, 200);
}

// Of cells beside the lamp: where it covers a good part of one, the black that it leaves moves fast over the plane.
TEST_F(JustInTime, BeyondTheRectangleTheRimHoldsOn) {
  const std::vector<TileRequest> requests{{{300, 301}, {0.5F, -0.1F}, {0.9F, 0.1F}}};
  const PlaneTile tile = tiles(requests, 8).front();
  const PlaneTile field = merged_tiles(whole_->directions, dark_->images, requests).front();
  for (const float y : {-0.1F, 0.F, 0.1F}) {
    const Eigen::Vector4f there = sample(tile.image(), {0.7F, y}), rim = sample(field.image(), {0.7F, y});
    EXPECT_LT((there - rim).head<3>().norm(), 0.03F * rim.head<3>().norm()) << y;
  }
}

}  // namespace
}  // namespace mf
