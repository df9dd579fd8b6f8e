// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/mock_device.h"

#include "common/error.h"

namespace mf::sim {

namespace {

void must(gboolean done, GError* error, const std::string& node) {
  if (done != 0) return;
  const std::string why = error != nullptr ? error->message : "unknown";
  g_clear_error(&error);
  throw InputError(node, "", "umockdev refuses it: " + why + ": run under umockdev-wrapper");
}

}  // namespace

void EndAnswers::operator()(UMockdevIoctlBase* handler) const {
  g_signal_handlers_disconnect_by_data(handler, self);
  g_object_unref(handler);
}

MockHandler add_mock_device(UMockdevTestbed* testbed, const MockDevice& device, MockAnswer answer, gpointer self) {
  MockHandler handler(umockdev_ioctl_base_new(), EndAnswers{self});
  g_signal_connect(handler.get(), "handle-ioctl", G_CALLBACK(answer), self);
  GError* error = nullptr;
  must(umockdev_testbed_add_from_string(testbed, device.description.c_str(), &error), error, device.node);
  must(umockdev_testbed_attach_ioctl(testbed, device.node.c_str(), handler.get(), &error), error, device.node);
  return handler;
}

void remove_mock_device(UMockdevTestbed* testbed, const MockDevice& device) {
  umockdev_testbed_uevent(testbed, device.path.c_str(), "remove");
  GError* error = nullptr;
  must(umockdev_testbed_detach_ioctl(testbed, device.node.c_str(), &error), error, device.node);
  umockdev_testbed_remove_device(testbed, device.path.c_str());
  std::filesystem::remove(real_node(testbed, device));  // it leaves a link be
}

std::filesystem::path real_node(UMockdevTestbed* testbed, const MockDevice& device) {
  const std::unique_ptr<gchar, FreeWith<g_free>> root(umockdev_testbed_get_root_dir(testbed));
  return root.get() + device.node;
}

MockData argument_bytes(UMockdevIoctlClient* client, std::size_t count) {
  return MockData(umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, count, nullptr));
}

void put(UMockdevIoctlData& data, std::span<const std::uint8_t> bytes) {
  umockdev_ioctl_data_update(&data, 0, const_cast<guint8*>(bytes.data()),  // only read
                             static_cast<gint>(bytes.size()));
}

void finish(UMockdevIoctlClient* client, long result) {
  umockdev_ioctl_client_complete(client, result, 0);
}

void fail(UMockdevIoctlClient* client, int error) {
  umockdev_ioctl_client_complete(client, -1, error);
}

}  // namespace mf::sim
