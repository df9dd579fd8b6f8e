// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/v4l2_camera.h"

#include <fmt/format.h>
#include <umockdev.h>

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <list>
#include <mutex>
#include <thread>
#include <utility>

#include "common/error.h"
#include "hw-sim/v4l2_driver.h"

namespace mf::sim {

namespace {

using Clock = std::chrono::steady_clock;

// How long a DQBUF waits. Clients block their signals meanwhile, so it is short.
constexpr std::chrono::milliseconds dequeue_patience{20};

struct DataRelease {
  void operator()(UMockdevIoctlData* data) const { umockdev_ioctl_data_unref(data); }
};
using Data = std::unique_ptr<UMockdevIoctlData, DataRelease>;

Data resolve(UMockdevIoctlData* parent, std::size_t offset, std::size_t size) {
  GError* error = nullptr;
  Data data(umockdev_ioctl_data_resolve(parent, offset, size, &error));
  g_clear_error(&error);
  return data;
}

// One ioctl of a client: its argument fetched from the client, and sent back with the answer.
class Call {
 public:
  explicit Call(UMockdevIoctlClient* client)
      : client_(client), request_(static_cast<std::uint32_t>(umockdev_ioctl_client_get_request(client))) {
    if (const std::size_t size = _IOC_SIZE(request_); size > 0)
      argument_ = resolve(umockdev_ioctl_client_get_arg(client), 0, size);
    if (argument_ != nullptr && has_list()) fetch_list();
  }

  [[nodiscard]] UMockdevIoctlClient* client() const { return client_; }
  [[nodiscard]] std::uint32_t request() const { return request_; }
  // 0 or errno.
  [[nodiscard]] int run(V4l2Driver& driver) {
    return argument_ == nullptr ? ENOTTY : driver.handle(client_, request_, argument_->data);
  }
  void answer(int error) {
    if (argument_ != nullptr && (_IOC_DIR(request_) & _IOC_READ) != 0) send_back();
    umockdev_ioctl_client_complete(client_, error == 0 ? 0 : -1, error);
  }

 private:
  [[nodiscard]] bool has_list() const {
    return request_ == VIDIOC_G_EXT_CTRLS || request_ == VIDIOC_S_EXT_CTRLS || request_ == VIDIOC_TRY_EXT_CTRLS;
  }
  void fetch_list() {
    auto* controls = reinterpret_cast<v4l2_ext_controls*>(argument_->data);
    list_ = resolve(argument_.get(), offsetof(v4l2_ext_controls, controls), controls->count * sizeof(v4l2_ext_control));
    if (list_ == nullptr) controls->count = 0;
  }
  // umockdev sends back only what it is told has changed, and puts the client's own pointers in again.
  void send_back() const {
    for (UMockdevIoctlData* data : {argument_.get(), list_.get()}) {
      if (data == nullptr) continue;
      std::vector<std::uint8_t> copy(data->data, data->data + data->data_len);
      umockdev_ioctl_data_update(data, 0, copy.data(), static_cast<int>(copy.size()));
    }
  }

  UMockdevIoctlClient* client_;
  std::uint32_t request_;
  Data argument_, list_;
};

std::string name_of(const V4l2CameraOptions& o) {
  return fmt::format("video{}", o.number);
}

std::string node_of(const V4l2CameraOptions& o) {
  return "/dev/" + name_of(o);
}

void require_camera(const V4l2CameraOptions& o) {
  const auto refuse = [&](const char* field, const char* why) { throw InputError(node_of(o), field, why); };
  if (o.fourccs.empty()) refuse("fourccs", "must name a format");
  if (o.width < 2 || o.height < 2 || o.width % 2 != 0 || o.height % 2 != 0)
    refuse("width, height", "must be even and above 0");
  if (!(o.frame_rate_hz > 0 && o.frame_rate_hz <= 1000)) refuse("frame_rate_hz", "must lie above 0, up to 1000");
  if (o.line_alignment_bytes == 0) refuse("line_alignment_bytes", "must be above 0");
  if (!has_umockdev())
    throw InputError(node_of(o), "",
                     "umockdev's preload library is not active: start the program with umockdev-wrapper");
}

std::string sysfs_path(const V4l2CameraOptions& o) {
  return "/devices/platform/mirrorfield-sim/video4linux/" + name_of(o);
}

std::string lasting_name(const V4l2CameraOptions& o) {
  return fmt::format("v4l/by-id/mirrorfield-{}-video-index0", o.serial);
}

// In umockdev's own format: what sysfs and udev tell of the device, and a plain file as its node.
std::string description(const V4l2CameraOptions& o) {
  return fmt::format(
      "P: {0}\nN: {1}=00\nS: {5}\nE: DEVNAME=/dev/{1}\nE: DEVLINKS=/dev/{5}\nE: MAJOR=81\nE: MINOR={4}\n"
      "E: SUBSYSTEM=video4linux\nE: ID_VENDOR=Mirrorfield\nE: ID_SERIAL_SHORT={3}\nE: ID_V4L_CAPABILITIES=:capture:\n"
      "A: dev=81:{4}\nA: index=0\nA: name={2}\n\n",
      sysfs_path(o), name_of(o), o.card, o.serial, o.number, lasting_name(o));
}

[[noreturn]] void refuse(const std::string& node, GError* error) {
  const std::string why = error == nullptr ? "umockdev refuses it" : error->message;
  g_clear_error(&error);
  throw InputError(node, "", why);
}

std::string root_of(UMockdevTestbed* testbed) {
  gchar* root = umockdev_testbed_get_root_dir(testbed);
  std::string text(root);
  g_free(root);
  return text;
}

}  // namespace

bool has_umockdev() {
  // umockdev_in_mock_environment() says no in Debian 12, whether it is there or not.
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);)
    if (line.find("libumockdev-preload") != std::string::npos) return true;
  return false;
}

struct V4l2Camera::Impl {
  using Shared = std::shared_ptr<Impl>;
  struct Waiting {
    Call call;
    Clock::time_point until;
  };

  UMockdevTestbed* testbed;
  V4l2CameraOptions options;
  Fill fill;
  V4l2Driver driver;
  UMockdevIoctlBase* handler = nullptr;
  bool plugged = false;
  std::mutex mutex;  // of what follows
  std::condition_variable changed;
  std::list<Waiting> waiting;
  bool ending = false;
  std::thread clock;

  Impl(UMockdevTestbed* t, const V4l2CameraOptions& o, Fill f)
      : testbed(t), options(o), fill(std::move(f)), driver(o, root_of(t) + node_of(o)) {}
  static void attach(const Shared&);
  void plug();
  void pull();
  void take(UMockdevIoctlClient*);
  void run();
  void serve_waiting();

  // What umockdev calls, in a thread of its own.
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    (*static_cast<Shared*>(self))->take(client);
    return 1;
  }
  static void on_connected(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    (*static_cast<Shared*>(self))->driver.client_came(client);
    g_object_weak_ref(G_OBJECT(client), on_gone, new Shared(*static_cast<Shared*>(self)));
  }
  static void on_gone(gpointer self, GObject* client) {
    const std::unique_ptr<Shared> shared(static_cast<Shared*>(self));
    (*shared)->driver.client_gone(client);
  }
  static void end_sharing(gpointer self, GClosure*) { delete static_cast<Shared*>(self); }
  static void connect(gpointer object, const char* signal, GCallback callback, const Shared& self) {
    g_signal_connect_data(object, signal, callback, new Shared(self), end_sharing, GConnectFlags{});
  }
};

void V4l2Camera::Impl::attach(const Shared& self) {
  self->handler = umockdev_ioctl_base_new();
  connect(self->handler, "handle-ioctl", G_CALLBACK(on_ioctl), self);
  connect(self->handler, "client-connected", G_CALLBACK(on_connected), self);
  GError* error = nullptr;
  const std::string node = node_of(self->options);
  if (umockdev_testbed_attach_ioctl(self->testbed, node.c_str(), self->handler, &error) == 0) refuse(node, error);
}

void V4l2Camera::Impl::plug() {
  GError* error = nullptr;
  if (umockdev_testbed_add_from_string(testbed, description(options).c_str(), &error) == 0)
    refuse(node_of(options), error);
  plugged = true;
}

void V4l2Camera::Impl::pull() {
  plugged = false;
  const std::string path = "/sys" + sysfs_path(options);
  umockdev_testbed_uevent(testbed, path.c_str(), "remove");
  umockdev_testbed_remove_device(testbed, path.c_str());
  std::filesystem::remove(root_of(testbed) + "/dev/" + lasting_name(options));  // umockdev forgets the link
  driver.unplug();
}

void V4l2Camera::Impl::take(UMockdevIoctlClient* client) {
  Call call(client);
  const int error = call.run(driver);
  {
    const std::lock_guard lock(mutex);
    if (call.request() != VIDIOC_DQBUF || error != EAGAIN || ending) return call.answer(error);
    g_object_ref(client);
    waiting.push_back({std::move(call), Clock::now() + dequeue_patience});
  }
  changed.notify_all();
}

void V4l2Camera::Impl::serve_waiting() {
  std::list<Waiting> ready;
  {
    const std::lock_guard lock(mutex);
    for (auto i = waiting.begin(); i != waiting.end();) {
      const auto next = std::next(i);
      const int error = i->call.run(driver);
      if (error != EAGAIN || Clock::now() >= i->until || ending) {
        i->call.answer(error);
        ready.splice(ready.end(), waiting, i);
      }
      i = next;
    }
  }
  for (const Waiting& answered : ready) g_object_unref(answered.call.client());
}

// The camera's own time: a frame a period, and between them those who waited long enough.
void V4l2Camera::Impl::run() {
  auto next = Clock::now();
  std::unique_lock lock(mutex);
  while (!ending) {
    const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(driver.period_s()));
    next = std::max(next, Clock::now() - period);  // a machine that slept does not make up for it
    auto until = next;
    for (const Waiting& w : waiting) until = std::min(until, w.until);
    changed.wait_until(lock, until, [&] { return ending; });
    lock.unlock();
    if (Clock::now() >= next) {
      driver.expose(fill);
      next += period;
    }
    serve_waiting();
    lock.lock();
  }
}

V4l2Camera::V4l2Camera(UMockdevTestbed* testbed, const V4l2CameraOptions& options, Fill fill) {
  require_camera(options);
  impl_ = std::make_shared<Impl>(testbed, options, std::move(fill));
  Impl::attach(impl_);
  impl_->plug();
  impl_->clock = std::thread([this] { impl_->run(); });
}

V4l2Camera::~V4l2Camera() {
  if (impl_->plugged) impl_->pull();
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ending = true;
  }
  impl_->changed.notify_all();
  impl_->clock.join();
  impl_->serve_waiting();
  umockdev_testbed_detach_ioctl(impl_->testbed, node_of(impl_->options).c_str(), nullptr);
  g_object_unref(impl_->handler);
}

void V4l2Camera::unplug() {
  if (impl_->plugged) impl_->pull();
}

void V4l2Camera::replug() {
  if (impl_->plugged) return;
  impl_->plug();
  umockdev_testbed_uevent(impl_->testbed, ("/sys" + sysfs_path(impl_->options)).c_str(), "add");
}

void V4l2Camera::add_faults(const V4l2Faults& faults) {
  impl_->driver.add_faults(faults);
}

void V4l2Camera::hang(bool hung) {
  impl_->driver.hold(hung);
}

void V4l2Camera::occupy(bool busy) {
  impl_->driver.occupy(busy);
}

V4l2CameraCounts V4l2Camera::counts() const {
  return impl_->driver.counts();
}

}  // namespace mf::sim
