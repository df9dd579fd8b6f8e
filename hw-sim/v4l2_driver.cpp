// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/v4l2_driver.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "common/error.h"
#include "device/clock.h"
#include "device/v4l2_formats.h"

namespace mf::sim {

namespace {

constexpr std::uint32_t capture = V4L2_BUF_TYPE_VIDEO_CAPTURE;

template <typename T>
T& as(void* argument) {
  return *static_cast<T*>(argument);
}

void put_text(__u8* target, std::size_t size, const std::string& text) {
  std::copy_n(text.begin(), std::min(size - 1, text.size()), target);  // zeros follow: the structs were cleared
}

timeval stamp_now(bool monotonic) {
  // The clock that nobody names: an hour off ours.
  const std::int64_t ns = clock_ns(CLOCK_MONOTONIC) + (monotonic ? 0 : 3600 * std::int64_t{1'000'000'000});
  return {ns / 1'000'000'000, ns % 1'000'000'000 / 1000};
}

}  // namespace

SharedFrames::SharedFrames(const std::string& file, std::size_t bytes) : size_(bytes) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  void* address = MAP_FAILED;
  if (descriptor >= 0 && ::ftruncate(descriptor, static_cast<off_t>(bytes)) == 0)
    address = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (address == MAP_FAILED) throw InputError(file, "", std::strerror(error));
  address_ = static_cast<std::uint8_t*>(address);
}

SharedFrames::~SharedFrames() {
  ::munmap(address_, size_);
}

V4l2Driver::V4l2Driver(const V4l2CameraOptions& options, std::string file)
    : options_(options), file_(std::move(file)), controls_(options.exposure_s), fourcc_(options.fourccs.front()) {
  crop_ = {0, 0, static_cast<std::uint32_t>(options.width), static_cast<std::uint32_t>(options.height)};
  interval_ = {1000, static_cast<std::uint32_t>(std::lround(1000 * options.frame_rate_hz))};
}

void V4l2Driver::set(bool& flag, bool value) {
  const std::lock_guard lock(mutex_);
  flag = value;
}

int V4l2Driver::handle(Client client, std::uint32_t request, void* argument) {
  const std::lock_guard lock(mutex_);
  if (std::find(gone_.begin(), gone_.end(), client) != gone_.end()) return ENODEV;
  switch (request) {
    case VIDIOC_REQBUFS:
    case VIDIOC_QUERYBUF:
    case VIDIOC_QBUF:
    case VIDIOC_DQBUF:
    case VIDIOC_STREAMON:
    case VIDIOC_STREAMOFF:
    case VIDIOC_S_FMT:
      return stream(client, request, argument);
    default:
      return query(request, argument);
  }
}

int V4l2Driver::query(std::uint32_t request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP:
      return capabilities(as<v4l2_capability>(argument));
    case VIDIOC_ENUM_FMT:
      return enumerate_format(as<v4l2_fmtdesc>(argument));
    case VIDIOC_ENUM_FRAMESIZES:
      return enumerate_size(as<v4l2_frmsizeenum>(argument));
    case VIDIOC_G_FMT:
      return get_format(as<v4l2_format>(argument));
    case VIDIOC_TRY_FMT:
      return set_format(as<v4l2_format>(argument), false);
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM:
      return parameters(as<v4l2_streamparm>(argument), request == VIDIOC_S_PARM);
    case VIDIOC_G_SELECTION:
    case VIDIOC_S_SELECTION:
      return selection(as<v4l2_selection>(argument), request == VIDIOC_S_SELECTION);
    case VIDIOC_ENUMINPUT:
      return input(as<v4l2_input>(argument));
    case VIDIOC_G_INPUT:
      as<int>(argument) = 0;
      return 0;
    case VIDIOC_S_INPUT:
      return as<int>(argument) == 0 ? 0 : EINVAL;
    case VIDIOC_QUERYCTRL:
      return controls_.query(as<v4l2_queryctrl>(argument));
    case VIDIOC_QUERY_EXT_CTRL:
      return controls_.query(as<v4l2_query_ext_ctrl>(argument));
    case VIDIOC_QUERYMENU:
      return controls_.query_menu(as<v4l2_querymenu>(argument));
    case VIDIOC_G_CTRL:
      return controls_.get(as<v4l2_control>(argument));
    case VIDIOC_S_CTRL:
      return controls_.set(as<v4l2_control>(argument));
    case VIDIOC_G_EXT_CTRLS:
      return controls_.get(as<v4l2_ext_controls>(argument));
    case VIDIOC_S_EXT_CTRLS:
    case VIDIOC_TRY_EXT_CTRLS:
      return controls_.set(as<v4l2_ext_controls>(argument), request == VIDIOC_S_EXT_CTRLS);
    default:
      return ENOTTY;
  }
}

int V4l2Driver::stream(Client client, std::uint32_t request, void* argument) {
  if (occupied_for(client)) return EBUSY;
  if (request == VIDIOC_S_FMT) return set_format(as<v4l2_format>(argument), true);
  if (request == VIDIOC_REQBUFS) return request_buffers(client, as<v4l2_requestbuffers>(argument));
  if (client != owner_) return EINVAL;
  switch (request) {
    case VIDIOC_QUERYBUF:
      return query_buffer(as<v4l2_buffer>(argument));
    case VIDIOC_QBUF:
      return queue_buffer(as<v4l2_buffer>(argument));
    case VIDIOC_DQBUF:
      return dequeue_buffer(as<v4l2_buffer>(argument));
    case VIDIOC_STREAMON:
      if (!streaming_) ++counts_.streamers;
      streaming_ = true;
      sequence_ = 0;
      return 0;
    default:  // STREAMOFF gives all buffers back to the client
      streaming_ = false;
      waiting_.clear();
      filled_.clear();
      for (Buffer& buffer : buffers_) buffer.queued = false;
      return 0;
  }
}

int V4l2Driver::capabilities(v4l2_capability& c) const {
  c = {};
  put_text(c.driver, sizeof c.driver, "mirrorfield-sim");
  put_text(c.card, sizeof c.card, options_.card);
  put_text(c.bus_info, sizeof c.bus_info, "platform:mirrorfield-sim");
  c.version = 6U << 16U | 1U << 8U;
  c.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_EXT_PIX_FORMAT;
  c.capabilities = c.device_caps | V4L2_CAP_DEVICE_CAPS;
  return 0;
}

int V4l2Driver::enumerate_format(v4l2_fmtdesc& d) const {
  if (d.type != capture || d.index >= options_.fourccs.size()) return EINVAL;
  const std::uint32_t index = d.index;
  d = {};
  d.index = index;
  d.type = capture;
  d.pixelformat = options_.fourccs[index];
  put_text(d.description, sizeof d.description, fourcc_name(d.pixelformat));
  return 0;
}

int V4l2Driver::enumerate_size(v4l2_frmsizeenum& size) const {
  if (size.index != 0) return EINVAL;
  size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
  size.discrete = {crop_.width, crop_.height};
  return 0;
}

std::uint32_t V4l2Driver::line_bytes(std::uint32_t fourcc, std::uint32_t width) const {
  const auto known = known_v4l2_format(fourcc);
  const auto least = static_cast<std::uint32_t>(known ? known->wire.bytes_for(width) : 3 * std::size_t{width});
  const std::uint32_t step = options_.line_alignment_bytes;
  return (least + step - 1) / step * step;
}

std::uint32_t V4l2Driver::image_bytes() const {
  return line_bytes(fourcc_, crop_.width) * crop_.height;
}

std::uint32_t V4l2Driver::buffer_bytes() const {
  constexpr std::uint32_t page = 4096;
  return (image_bytes() + page - 1) / page * page;
}

int V4l2Driver::get_format(v4l2_format& f) const {
  if (f.type != capture) return EINVAL;
  f.fmt.pix = {};
  f.fmt.pix.width = crop_.width;
  f.fmt.pix.height = crop_.height;
  f.fmt.pix.pixelformat = fourcc_;
  f.fmt.pix.field = V4L2_FIELD_NONE;
  f.fmt.pix.bytesperline = line_bytes(fourcc_, crop_.width);
  f.fmt.pix.sizeimage = image_bytes();
  f.fmt.pix.colorspace = V4L2_COLORSPACE_RAW;
  return 0;
}

// As drivers do: what cannot be had is changed, not refused. The picture's size is the crop's.
int V4l2Driver::set_format(v4l2_format& f, bool keep) {
  if (f.type != capture) return EINVAL;
  const std::uint32_t wanted = f.fmt.pix.pixelformat, before = fourcc_;
  if (keep && !buffers_.empty() && wanted != fourcc_) return EBUSY;
  const bool there = std::find(options_.fourccs.begin(), options_.fourccs.end(), wanted) != options_.fourccs.end();
  fourcc_ = there ? wanted : options_.fourccs.front();
  const int error = get_format(f);
  if (!keep) fourcc_ = before;
  return error;
}

int V4l2Driver::parameters(v4l2_streamparm& p, bool write) {
  if (p.type != capture) return EINVAL;
  const v4l2_fract asked = p.parm.capture.timeperframe;
  if (write && asked.numerator > 0 && asked.denominator > 0) {
    const double hz = static_cast<double>(asked.denominator) / asked.numerator;
    const double taken = std::min(hz, options_.highest_frame_rate_hz);
    interval_ = {1000, static_cast<std::uint32_t>(std::lround(1000 * taken))};
  }
  p.parm.capture = {};
  p.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
  p.parm.capture.timeperframe = interval_;
  p.parm.capture.readbuffers = 3;
  return 0;
}

int V4l2Driver::selection(v4l2_selection& s, bool write) {
  if (!options_.crops) return ENOTTY;
  if (s.type != capture) return EINVAL;
  const v4l2_rect sensor{0, 0, static_cast<std::uint32_t>(options_.width), static_cast<std::uint32_t>(options_.height)};
  if (s.target == V4L2_SEL_TGT_CROP_BOUNDS || s.target == V4L2_SEL_TGT_CROP_DEFAULT) {
    if (write) return EINVAL;
    s.r = sensor;
    return 0;
  }
  if (s.target != V4L2_SEL_TGT_CROP) return EINVAL;
  if (write && !buffers_.empty()) return EBUSY;
  if (write) {
    crop_.width = std::clamp(s.r.width & ~1U, 2U, sensor.width);  // whole cells of the mosaic
    crop_.height = std::clamp(s.r.height & ~1U, 2U, sensor.height);
    crop_.left = std::clamp(s.r.left & ~1, 0, static_cast<int>(sensor.width - crop_.width));
    crop_.top = std::clamp(s.r.top & ~1, 0, static_cast<int>(sensor.height - crop_.height));
  }
  s.r = crop_;
  return 0;
}

int V4l2Driver::input(v4l2_input& i) const {
  if (i.index != 0) return EINVAL;
  i = {};
  put_text(i.name, sizeof i.name, "Sensor");
  i.type = V4L2_INPUT_TYPE_CAMERA;
  return 0;
}

bool V4l2Driver::occupied_for(Client client) const {
  return busy_ || (owner_ != nullptr && owner_ != client);
}

void V4l2Driver::release() {
  owner_ = nullptr;
  streaming_ = false;
  buffers_.clear();
  waiting_.clear();
  filled_.clear();
  memory_.reset();
}

int V4l2Driver::request_buffers(Client client, v4l2_requestbuffers& r) {
  if (r.type != capture || r.memory != V4L2_MEMORY_MMAP) return EINVAL;
  release();
  r.capabilities = V4L2_BUF_CAP_SUPPORTS_MMAP;
  if (r.count == 0) return 0;
  constexpr std::uint32_t most = 32;
  r.count = std::min(r.count, most);
  buffers_.resize(r.count);
  try {
    memory_ = std::make_shared<SharedFrames>(file_, std::size_t{buffer_bytes()} * r.count);
  } catch (const InputError&) {
    release();
    return ENOMEM;
  }
  owner_ = client;
  return 0;
}

void V4l2Driver::tell(v4l2_buffer& b) const {
  const Buffer& buffer = buffers_[b.index];
  b.flags = V4L2_BUF_FLAG_MAPPED | buffer.flags | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  b.flags |= options_.monotonic_stamps ? V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC : V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  if (buffer.queued) b.flags |= V4L2_BUF_FLAG_QUEUED;
  b.memory = V4L2_MEMORY_MMAP;
  b.field = V4L2_FIELD_NONE;
  b.bytesused = buffer.bytes_used;
  b.sequence = buffer.sequence;
  b.timestamp = buffer.stamp;
  b.m.offset = b.index * buffer_bytes();
  b.length = buffer_bytes();
}

int V4l2Driver::query_buffer(v4l2_buffer& b) const {
  if (b.type != capture || b.index >= buffers_.size()) return EINVAL;
  tell(b);
  return 0;
}

int V4l2Driver::queue_buffer(v4l2_buffer& b) {
  if (b.type != capture || b.memory != V4L2_MEMORY_MMAP || b.index >= buffers_.size()) return EINVAL;
  if (buffers_[b.index].queued) return EINVAL;
  buffers_[b.index] = {};
  buffers_[b.index].queued = true;
  waiting_.push_back(b.index);
  tell(b);
  return 0;
}

int V4l2Driver::dequeue_buffer(v4l2_buffer& b) {
  if (b.type != capture || b.memory != V4L2_MEMORY_MMAP || !streaming_) return EINVAL;
  if (filled_.empty()) return EAGAIN;
  b.index = filled_.front();
  filled_.pop_front();
  buffers_[b.index].queued = false;
  tell(b);
  return 0;
}

void V4l2Driver::client_came(Client client) {
  const std::lock_guard lock(mutex_);
  open_.push_back(client);
}

void V4l2Driver::client_gone(Client client) {
  const std::lock_guard lock(mutex_);
  std::erase(gone_, client);  // its address may be another's next
  std::erase(open_, client);
  if (client == owner_) release();
}

void V4l2Driver::unplug() {
  const std::lock_guard lock(mutex_);
  gone_.insert(gone_.end(), open_.begin(), open_.end());
  open_.clear();
  release();
  controls_ = V4l2SimControls(options_.exposure_s);
  fourcc_ = options_.fourccs.front();
  crop_ = {0, 0, static_cast<std::uint32_t>(options_.width), static_cast<std::uint32_t>(options_.height)};
  interval_ = {1000, static_cast<std::uint32_t>(std::lround(1000 * options_.frame_rate_hz))};
}

double V4l2Driver::period_s() const {
  const std::lock_guard lock(mutex_);
  return static_cast<double>(interval_.numerator) / interval_.denominator;
}

void V4l2Driver::add_faults(const V4l2Faults& faults) {
  const std::lock_guard lock(mutex_);
  faults_.skipped += faults.skipped;
  faults_.damaged += faults.damaged;
  faults_.cut += faults.cut;
}

V4l2CameraCounts V4l2Driver::counts() const {
  const std::lock_guard lock(mutex_);
  V4l2CameraCounts counts = counts_;
  counts.streaming = streaming_;
  return counts;
}

V4l2Mode V4l2Driver::mode() const {
  return {fourcc_,
          crop_.left,
          crop_.top,
          static_cast<int>(crop_.width),
          static_cast<int>(crop_.height),
          line_bytes(fourcc_, crop_.width),
          controls_.exposure_s(),
          controls_.value(V4L2_CID_GAIN),
          controls_.value(V4L2_CID_WIDE_DYNAMIC_RANGE) != 0};
}

std::optional<V4l2Driver::Shot> V4l2Driver::begin_shot() {
  const std::lock_guard lock(mutex_);
  if (!streaming_ || hung_) return std::nullopt;
  const std::uint64_t number = ++sequence_;
  if (faults_.skipped > 0) {
    --faults_.skipped;
    return std::nullopt;
  }
  if (waiting_.empty()) {
    ++counts_.without;
    return std::nullopt;
  }
  Shot shot{waiting_.front(), number, mode(), memory_};
  waiting_.pop_front();
  if (faults_.damaged > 0) {
    --faults_.damaged;
    shot.damaged = true;
  } else if (faults_.cut > 0) {
    --faults_.cut;
    shot.cut = true;
  }
  return shot;
}

void V4l2Driver::end_shot(const Shot& shot) {
  const std::lock_guard lock(mutex_);
  if (memory_ != shot.memory || !streaming_ || !buffers_[shot.index].queued) return;  // stopped meanwhile
  Buffer& buffer = buffers_[shot.index];
  buffer.bytes_used = shot.cut ? image_bytes() / 2 : image_bytes();
  buffer.sequence = static_cast<std::uint32_t>(shot.number - 1);
  buffer.flags = shot.damaged ? V4L2_BUF_FLAG_ERROR : 0;
  buffer.stamp = stamp_now(options_.monotonic_stamps);
  filled_.push_back(shot.index);
  ++counts_.frames;
}

void V4l2Driver::expose(const V4l2Camera::Fill& fill) {
  const std::optional<Shot> shot = begin_shot();
  if (!shot) return;
  const std::size_t bytes = std::size_t{shot->mode.bytes_per_line} * static_cast<std::size_t>(shot->mode.height);
  constexpr std::size_t page = 4096;
  const std::size_t each = (bytes + page - 1) / page * page;
  fill(shot->number, shot->mode, shot->memory->bytes().subspan(shot->index * each, bytes));
  end_shot(*shot);
}

}  // namespace mf::sim
