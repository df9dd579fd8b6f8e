// SPDX-License-Identifier: Apache-2.0
#include "device/clock_fit.h"

#include <algorithm>
#include <cmath>

#include "common/check.h"

namespace mf {

namespace {

struct Point {
  double x = 0, y = 0;  // device time and host − device, ns, relative to the first pair
};

// The edge of the lower convex hull over `at`. `points` rise in x.
std::pair<Point, Point> lower_edge(const std::vector<Point>& points, double at) {
  std::vector<Point> hull;
  for (const Point& p : points) {
    while (hull.size() > 1) {
      const Point &a = hull[hull.size() - 2], &b = hull.back();
      if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0) break;
      hull.pop_back();
    }
    hull.push_back(p);
  }
  std::size_t right = 1;
  while (right + 1 < hull.size() && hull[right].x < at) ++right;
  return {hull[right - 1], hull[right]};
}

// A slope over less than this says more of the jitter than of the clock.
constexpr double least_span_ns = 5e9;

}  // namespace

std::int64_t DeviceClock::host_ns(std::int64_t device_ns) const {
  const double since = static_cast<double>(device_ns - device_at_ns);
  // The whole of the difference stays an integer: a double would round hours to microseconds.
  return host_at_ns + (device_ns - device_at_ns) + std::llround(since * (host_per_device - 1));
}

ClockFit::ClockFit(const ClockFitOptions& options) : options_(options) {
  check(options.bucket_ns > 0 && options.buckets >= 4 && options.early_ns > 0 && options.late_ns > 0,
        "the clock's fit has a window");
}

double ClockFit::offset_of(std::int64_t device_ns, std::int64_t host_ns) const {
  return static_cast<double>((host_ns - first_host_ns_) - (device_ns - first_device_ns_));
}

ClockEvent ClockFit::judge(std::int64_t device_ns, std::int64_t host_ns) {
  if (buckets_.empty()) return ClockEvent::none;
  if (device_ns < last_device_ns_) return ClockEvent::restarted;
  if (!settled_) return ClockEvent::none;
  const std::int64_t late = host_ns - settled_->host_ns(device_ns);
  if (late < -options_.early_ns) return ClockEvent::jumped;
  if (late < options_.late_ns) {
    late_since_ns_.reset();
    return ClockEvent::none;
  }
  if (!late_since_ns_) late_since_ns_ = host_ns;
  return host_ns - *late_since_ns_ >= options_.late_for_ns ? ClockEvent::jumped : ClockEvent::none;
}

void ClockFit::start_over(std::int64_t device_ns, std::int64_t host_ns) {
  buckets_.clear();
  settled_.reset();
  late_since_ns_.reset();
  first_device_ns_ = device_ns;
  first_host_ns_ = host_ns;
}

ClockEvent ClockFit::add(std::int64_t device_ns, std::int64_t host_ns) {
  const ClockEvent event = judge(device_ns, host_ns);
  if (event != ClockEvent::none) ++events_;
  if (event != ClockEvent::none || buckets_.empty()) start_over(device_ns, host_ns);
  put(device_ns, host_ns);
  last_device_ns_ = device_ns;
  return event;
}

void ClockFit::put(std::int64_t device_ns, std::int64_t host_ns) {
  const std::int64_t number = (device_ns - first_device_ns_) / options_.bucket_ns;
  const double offset = offset_of(device_ns, host_ns);
  if (buckets_.empty() || buckets_.back().number != number) {
    settled_ = clock();
    buckets_.push_back({number, device_ns, host_ns, 0, 0});
    if (buckets_.size() > static_cast<std::size_t>(options_.buckets)) buckets_.pop_front();
  }
  Bucket& bucket = buckets_.back();
  if (offset < offset_of(bucket.device_ns, bucket.host_ns)) {
    bucket.device_ns = device_ns;
    bucket.host_ns = host_ns;
  }
  bucket.sum_offsets_ns += offset;
  ++bucket.count;
}

std::optional<DeviceClock> ClockFit::clock() const {
  if (buckets_.empty()) return std::nullopt;
  std::vector<Point> points;
  double mean_x = 0, mean_y = 0, count = 0;
  for (const Bucket& b : buckets_) {
    points.push_back({static_cast<double>(b.device_ns - first_device_ns_), offset_of(b.device_ns, b.host_ns)});
    mean_x += b.count * points.back().x;
    mean_y += b.sum_offsets_ns;
    count += b.count;
  }
  mean_x /= count;
  mean_y /= count;
  const bool long_enough = points.back().x - points.front().x >= least_span_ns;
  Point at = *std::min_element(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.y < b.y; });
  double slope = 0;
  if (long_enough) {
    const auto [left, right] = lower_edge(points, mean_x);
    slope = (right.y - left.y) / (right.x - left.x);
    at = left;
  }
  // The line at the mean time, where it is known best.
  const double y = at.y + slope * (mean_x - at.x);
  const std::int64_t device_at = first_device_ns_ + std::llround(mean_x);
  const std::int64_t host_at = first_host_ns_ + std::llround(mean_x) + std::llround(y);
  return DeviceClock{device_at, host_at, 1 + slope, mean_y - y};
}

}  // namespace mf
