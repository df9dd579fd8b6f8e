// SPDX-License-Identifier: Apache-2.0
#include "device/aravis_features.h"

#include <cmath>

#include "device/aravis_handles.h"

namespace mf {

bool AravisFeatures::has(const std::string& feature) const {
  // One description serves many models: what it has in it, this camera need not have implemented. Aravis' own
  // "available" does not ask for that.
  return arv_device_is_feature_implemented(device_, feature.c_str(), nullptr) != 0 &&
         arv_device_is_feature_available(device_, feature.c_str(), nullptr) != 0;
}

double AravisFeatures::number(const std::string& feature) const {
  Failure failure(camera_, feature);
  ArvGcNode* node = arv_device_get_feature(device_, feature.c_str());
  double value = 0;
  if (ARV_IS_GC_BOOLEAN(node))
    value = arv_device_get_boolean_feature_value(device_, feature.c_str(), failure) != 0 ? 1 : 0;
  else if (ARV_IS_GC_INTEGER(node))
    value = static_cast<double>(arv_device_get_integer_feature_value(device_, feature.c_str(), failure));
  else
    value = arv_device_get_float_feature_value(device_, feature.c_str(), failure);
  failure.raise_if_any("the camera does not tell it");
  return value;
}

void AravisFeatures::set_number(const std::string& feature, double value) {
  Failure failure(camera_, feature);
  ArvGcNode* node = arv_device_get_feature(device_, feature.c_str());
  if (ARV_IS_GC_COMMAND(node))
    arv_device_execute_command(device_, feature.c_str(), failure);
  else if (ARV_IS_GC_BOOLEAN(node))
    arv_device_set_boolean_feature_value(device_, feature.c_str(), value != 0 ? 1 : 0, failure);
  else if (ARV_IS_GC_INTEGER(node))
    arv_device_set_integer_feature_value(device_, feature.c_str(), std::llround(value), failure);
  else
    arv_device_set_float_feature_value(device_, feature.c_str(), value, failure);
  failure.raise_if_any("the camera refuses it");
}

std::string AravisFeatures::choice(const std::string& feature) const {
  Failure failure(camera_, feature);
  const char* entry = arv_device_get_string_feature_value(device_, feature.c_str(), failure);
  failure.raise_if_any("the camera does not tell it");
  return text_or_empty(entry);
}

void AravisFeatures::set_choice(const std::string& feature, const std::string& entry) {
  Failure failure(camera_, feature);
  arv_device_set_string_feature_value(device_, feature.c_str(), entry.c_str(), failure);
  failure.raise_if_any("choose one that the camera has");
}

}  // namespace mf
