// SPDX-License-Identifier: Apache-2.0
#include "device/gige_control.h"

#include <cstdint>

namespace mf {

namespace {

// GigE Vision 1.2, the register "control channel privilege".
bool has_forgotten_us(ArvDevice* device) {
  constexpr std::uint64_t privilege_register = 0x0a00;
  constexpr std::uint32_t exclusive = 1, control = 2;
  std::uint32_t privilege = 0;
  if (arv_device_read_register(device, privilege_register, &privilege, nullptr) == 0) return false;
  return (privilege & (exclusive | control)) == 0;
}

}  // namespace

GigeControl::GigeControl(ArvDevice* device, std::chrono::milliseconds patience)
    : device_(device), patience_(patience), last_frame_(std::chrono::steady_clock::now()) {}

bool GigeControl::is_lost() {
  using std::chrono::steady_clock;
  if (asking_.valid()) return asking_.wait_for(std::chrono::seconds(0)) == std::future_status::ready && asking_.get();
  if (steady_clock::now() - last_frame_ > patience_)
    asking_ = std::async(std::launch::async, [device = device_] { return has_forgotten_us(device); });
  return false;
}

}  // namespace mf
