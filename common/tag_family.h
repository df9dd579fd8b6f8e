// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

struct apriltag_family;

namespace mf {

// AprilTag's own family record. The detector that it is added to writes into it: one family a detector.
struct TagFamilyDeleter {
  void (*destroy)(apriltag_family*) = nullptr;
  void operator()(apriltag_family* family) const { destroy(family); }
};
using TagFamily = std::unique_ptr<apriltag_family, TagFamilyDeleter>;

// Throws InputError (field "family") for a name that is_known_tag_family() does not know.
[[nodiscard]] TagFamily make_tag_family(const std::string& name);

}  // namespace mf
