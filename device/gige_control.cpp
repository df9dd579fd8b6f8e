// SPDX-License-Identifier: Apache-2.0
#include "device/gige_control.h"

#include <cstdint>

namespace mf {

namespace {

// By the register "control channel privilege" of GigE Vision 1.2. Aravis asks six times, for half a second each.
bool answers_as_ours(ArvDevice* device) {
  constexpr std::uint64_t privilege_register = 0x0a00;
  constexpr std::uint32_t exclusive = 1, control = 2;
  std::uint32_t privilege = 0;
  if (arv_device_read_register(device, privilege_register, &privilege, nullptr) == 0) return false;
  return (privilege & (exclusive | control)) != 0;
}

}  // namespace

GigeControl::GigeControl(ArvDevice* device, std::chrono::milliseconds patience)
    : device_(device), patience_(patience), last_frame_(std::chrono::steady_clock::now()) {}

bool GigeControl::is_lost() {
  using std::chrono::steady_clock;
  if (asking_.valid()) return asking_.wait_for(std::chrono::seconds(0)) == std::future_status::ready && asking_.get();
  if (steady_clock::now() - last_frame_ > patience_)
    asking_ = std::async(std::launch::async, [device = device_] { return !answers_as_ours(device); });
  return false;
}

}  // namespace mf
