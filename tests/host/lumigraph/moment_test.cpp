// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/moment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/atomic_file.h"
#include "host/lumigraph/leave_one_out.h"
#include "host/lumigraph/lumigraph.h"
#include "host/lumigraph/path_times.h"
#include "tests/host/lumigraph/made_photos.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

constexpr double period = 2;

TEST(TimeBetween, GoesRoundWithThePeriod) {
  EXPECT_NEAR(time_between(0.1, 1.9, period), 0.2, 1e-12);
  EXPECT_NEAR(time_between(1.9, 0.1, period), 0.2, 1e-12);
  EXPECT_NEAR(time_between(7.3, 1.3, period), 0, 1e-12);
  EXPECT_DOUBLE_EQ(time_between(0, 1, period), 1);
  EXPECT_DOUBLE_EQ(time_between(7.3, 1.3, std::numeric_limits<double>::infinity()), 6);
}

TEST(MomentOf, NeedsTheTimeOfEveryPhoto) {
  PhotoSet set;
  set.source = "made";
  set.photos.resize(2);
  set.photos[0].time_s = 1;
  set.photos[1].name = "late.png";
  EXPECT_TRUE(test::contains(test::input_error_of([&] { static_cast<void>(moment_of(set, period, 4)); }), "late.png"));
  set.photos[1].time_s = 6;
  EXPECT_DOUBLE_EQ(moment_of(set, period, 4).penalty_per_s, 2);
  EXPECT_DOUBLE_EQ(moment_of(set, {}, 4).penalty_per_s, 0.8);
}

class PathTimes : public ::testing::Test {
 protected:
  std::vector<double> read(const char* text) {
    write_file_atomically(folder_ / "path.json", text);
    return read_path_times(folder_ / "path.json");
  }
  test::TemporaryFolder folder_;
};

TEST_F(PathTimes, AreThoseOfTheViewsAndLinearBetweenKeyFrames) {
  EXPECT_EQ(read(R"([{"time": 1}, {"time": 4}])"), (std::vector<double>{1, 4}));
  EXPECT_EQ(read(R"({"frames": 5, "views": [{"time": 1}, {"time": 3}, {"time": 2}]})"),
            (std::vector<double>{1, 2, 3, 2.5, 2}));
  EXPECT_TRUE(read(R"([{}, {}])").empty());
}

TEST_F(PathTimes, AreOfAllViewsOrOfNone) {
  const auto refused = [&](const char* text) { return test::input_error_of([&] { static_cast<void>(read(text)); }); };
  EXPECT_TRUE(test::contains(refused(R"([{"time": 1}, {}])"), "[1].time"));
  EXPECT_TRUE(test::contains(refused(R"({"frames": 3, "views": [{}, {"time": 1}]})"), "views[1].time"));
}

// A wall whose pattern swings from side to side, filmed by one camera that wanders before it.
class SwingingWall : public ::testing::Test {
 protected:
  static test::Paint paint_at(double time_s) {
    const auto swing = static_cast<float>(0.25 * std::sin(2 * std::numbers::pi * time_s / period));
    const test::Paint still = test::blotches(0.5F);
    return [=](const Eigen::Vector3f& x) { return still(x + swing * Eigen::Vector3f::UnitX()); };
  }

  static Rigid3 place(double t) {
    const Eigen::Vector3d from(0.8 * std::sin(0.71 * t), 0.6 * std::cos(1.13 * t), 3);
    return looking_at(from);
  }
  static Rigid3 looking_at(const Eigen::Vector3d& from) { return test::looking(from, {0.2 * from.x(), 0, 0}); }

  static PhotoSet film() {
    PhotoSet set;
    set.source = "made";
    for (int i = 0; i < 120; ++i) {
      const double t = 0.21 * i;
      PosedPhoto photo = test::photo_of(std::to_string(i), {test::pinhole(96, 45), place(t)}, wall, paint_at(t));
      photo.time_s = t;
      set.photos.push_back(std::move(photo));
    }
    return set;
  }

  inline static const PlaneProxy wall{Eigen::Vector3f::UnitZ(), 0};
};

TEST_F(SwingingWall, IsShownAsItIsAtTheWantedTime) {
  const PhotoSet set = film();
  const Lumigraph lumigraph(set, wall);
  double timed_db = 0;
  double timeless_db = 0;
  int views = 0;
  for (const double time : {0.3, 0.9, 1.4, 1.8})
    for (const double x : {-0.5, 0.1, 0.4}) {
      const View view{test::pinhole(96, 35), looking_at({x, 0.5 * x + 0.1, 3})};
      const ImageF truth = test::true_picture(view, wall, paint_at(time));
      LumigraphOptions options;
      const LumigraphPicture timeless = lumigraph.render(view, options);
      options.moment = moment_of(set, period, 4);
      options.moment->time_s = time;
      const LumigraphPicture timed = lumigraph.render(view, options);
      timed_db += psnr_db(timed.picture, truth, timed.covered);
      timeless_db += psnr_db(timeless.picture, truth, timeless.covered);
      ++views;
    }
  std::printf("swinging wall: %.1f dB with its time, %.1f dB without\n", timed_db / views, timeless_db / views);
  EXPECT_GT(timed_db / views, timeless_db / views + 8);
  EXPECT_GT(timed_db / views, 26);
}

TEST_F(SwingingWall, IsTheSameAPeriodLater) {
  const PhotoSet set = film();
  const Lumigraph lumigraph(set, wall);
  const View view{test::pinhole(96, 35), looking_at({0.2, 0.1, 3})};
  LumigraphOptions options;
  options.moment = moment_of(set, period, 4);
  options.moment->time_s = 0.75;
  const auto now = std::get<ImageF>(lumigraph.render(view, options).picture);
  options.moment->time_s = 0.75 + 5 * period;
  const auto later = std::get<ImageF>(lumigraph.render(view, options).picture);
  for (std::size_t i = 0; i < now.data.size(); ++i) ASSERT_NEAR(now.data[i], later.data[i], 1e-4) << i;
}

// Epipole consistency in space and time: a photo's own place and time give its picture.
TEST_F(SwingingWall, APhotosPlaceAndTimeGiveThePhoto) {
  const PhotoSet set = film();
  const Lumigraph lumigraph(set, PlaneProxy{Eigen::Vector3f(0.1F, 0, 1).normalized(), 0.2F});
  LumigraphOptions options;
  options.moment = moment_of(set, period, 4);
  for (const std::size_t i : {3U, 50U, 117U}) {
    options.moment->time_s = *set.photos[i].time_s;
    const LumigraphPicture picture = lumigraph.render({set.photos[i].camera, set.photos[i].cam_from_world}, options);
    EXPECT_GT(psnr_db(picture.picture, set.photos[i].picture, picture.covered), 45) << i;
  }
}

// The tiles' bounds hold with times too: a picture's pixels have the weights of ranking all photos.
TEST_F(SwingingWall, EveryPixelRanksAllPhotos) {
  const PhotoSet set = film();
  const Lumigraph lumigraph(set, wall);
  const View view{test::pinhole(80, 40), looking_at({0.3, -0.2, 2.8})};
  LumigraphOptions options;
  options.moment = moment_of(set, period, 4);
  options.moment->time_s = 1.1;
  const auto whole = std::get<ImageF>(lumigraph.render(view, options).picture);
  for (int y = 3; y < 80; y += 11)
    for (int x = 2; x < 80; x += 9) {
      const auto alone = std::get<ImageF>(lumigraph.render(pixel_of_view(view, {x + 0.5, y + 0.5}), options).picture);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(alone.at(0, 0, c), whole.at(x, y, c), 2e-4) << x << ", " << y;
    }
}

}  // namespace
}  // namespace mf
