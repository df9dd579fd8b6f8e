// SPDX-License-Identifier: Apache-2.0
#include "device/v4l2_controls.h"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstring>

#include "common/error.h"

namespace mf {

namespace {

bool is_menu(const v4l2_query_ext_ctrl& control) {
  return control.type == V4L2_CTRL_TYPE_MENU || control.type == V4L2_CTRL_TYPE_INTEGER_MENU;
}

bool is_number(const v4l2_query_ext_ctrl& control) {
  return control.type == V4L2_CTRL_TYPE_INTEGER || control.type == V4L2_CTRL_TYPE_INTEGER64 ||
         control.type == V4L2_CTRL_TYPE_BOOLEAN || control.type == V4L2_CTRL_TYPE_BITMASK || is_menu(control);
}

v4l2_ext_controls one(v4l2_ext_control& control) {
  v4l2_ext_controls list{};
  list.which = V4L2_CTRL_WHICH_CUR_VAL;
  list.count = 1;
  list.controls = &control;
  return list;
}

}  // namespace

std::string v4l2_control_name(const std::string& title) {
  std::string name;
  bool gap = false;
  for (const char c : title) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) {
      gap = !name.empty();
      continue;
    }
    if (gap) name += '_';
    gap = false;
    name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return name;
}

V4l2Controls::V4l2Controls(const V4l2Device& device) : device_(&device) {
  constexpr std::uint32_t next = V4L2_CTRL_FLAG_NEXT_CTRL | V4L2_CTRL_FLAG_NEXT_COMPOUND;
  v4l2_query_ext_ctrl query{};
  query.id = next;
  // A driver that does not count on would keep us here for ever.
  for (std::uint32_t before = 0; device.control(VIDIOC_QUERY_EXT_CTRL, &query) == 0 && query.id > before;) {
    before = query.id;
    query.name[sizeof query.name - 1] = '\0';
    if (is_number(query)) ids_[v4l2_control_name(query.name)] = query.id;
    query = {};
    query.id = before | next;
  }
}

std::optional<v4l2_query_ext_ctrl> V4l2Controls::description(std::uint32_t id) const {
  v4l2_query_ext_ctrl query{};
  query.id = id;
  if (device_->control(VIDIOC_QUERY_EXT_CTRL, &query) != 0 || (query.flags & V4L2_CTRL_FLAG_DISABLED) != 0)
    return std::nullopt;
  return query;
}

bool V4l2Controls::has(const std::string& feature) const {
  const auto found = ids_.find(feature);
  if (found == ids_.end()) return false;
  const auto query = description(found->second);
  return query && (query->flags & V4L2_CTRL_FLAG_INACTIVE) == 0;
}

v4l2_query_ext_ctrl V4l2Controls::demand(const std::string& feature) const {
  const auto found = ids_.find(feature);
  const auto query = found == ids_.end() ? std::nullopt : description(found->second);
  if (!query)
    throw InputError(
        device_->node(), feature,
        fmt::format("the camera has no such control: `v4l2-ctl -d {} -l` shows what it has", device_->node()));
  return *query;
}

std::int64_t V4l2Controls::read(const v4l2_query_ext_ctrl& query, const std::string& feature) const {
  v4l2_ext_control control{};
  control.id = query.id;
  v4l2_ext_controls list = one(control);
  device_->demand(VIDIOC_G_EXT_CTRLS, &list, feature, "the camera does not tell it");
  return query.type == V4L2_CTRL_TYPE_INTEGER64 ? std::int64_t{control.value64} : std::int64_t{control.value};
}

void V4l2Controls::write(const v4l2_query_ext_ctrl& query, const std::string& feature, std::int64_t value) const {
  v4l2_ext_control control{};
  control.id = query.id;
  if (query.type == V4L2_CTRL_TYPE_INTEGER64)
    control.value64 = value;
  else
    control.value = static_cast<std::int32_t>(value);
  v4l2_ext_controls list = one(control);
  device_->demand(VIDIOC_S_EXT_CTRLS, &list, feature, "the camera refuses it now: it may follow an automatic control");
}

std::optional<std::string> V4l2Controls::entry(const v4l2_query_ext_ctrl& query, std::int64_t index) const {
  v4l2_querymenu item{};
  item.id = query.id;
  item.index = static_cast<std::uint32_t>(index);
  if (device_->control(VIDIOC_QUERYMENU, &item) != 0) return std::nullopt;  // menus may have holes
  if (query.type == V4L2_CTRL_TYPE_INTEGER_MENU) return fmt::format("{}", std::int64_t{item.value});
  const auto* text = reinterpret_cast<const char*>(item.name);
  return std::string(text, strnlen(text, sizeof item.name));
}

double V4l2Controls::number(const std::string& feature) const {
  return static_cast<double>(read(demand(feature), feature));
}

void V4l2Controls::set_number(const std::string& feature, double value) {
  const v4l2_query_ext_ctrl query = demand(feature);
  if (!(value >= static_cast<double>(query.minimum) && value <= static_cast<double>(query.maximum)))
    throw InputError(device_->node(), feature,
                     fmt::format("{} lies outside of what the camera takes, {} to {}", value,
                                 std::int64_t{query.minimum}, std::int64_t{query.maximum}));
  write(query, feature, std::llround(value));
}

std::string V4l2Controls::choice(const std::string& feature) const {
  const v4l2_query_ext_ctrl query = demand(feature);
  const std::int64_t index = read(query, feature);
  return is_menu(query) ? entry(query, index).value_or(fmt::format("{}", index)) : fmt::format("{}", index);
}

void V4l2Controls::set_choice(const std::string& feature, const std::string& wanted) {
  const v4l2_query_ext_ctrl query = demand(feature);
  std::string entries;
  for (std::int64_t index = query.minimum; is_menu(query) && index <= query.maximum; ++index) {
    const std::optional<std::string> name = entry(query, index);
    if (!name) continue;
    if (*name == wanted) return write(query, feature, index);
    entries += (entries.empty() ? "" : ", ") + *name;
  }
  throw InputError(device_->node(), feature,
                   entries.empty() ? "has no entries to choose from: give a number"
                                   : fmt::format("'{}' is none of its entries: {}", wanted, entries));
}

std::optional<std::string> V4l2Controls::name_of(std::uint32_t id) const {
  for (const auto& [name, candidate] : ids_)
    if (candidate == id) return name;
  return std::nullopt;
}

std::optional<std::int64_t> V4l2Controls::value(std::uint32_t id) const {
  const std::optional<std::string> name = name_of(id);
  const auto query = name ? description(id) : std::nullopt;
  return query ? std::optional(read(*query, *name)) : std::nullopt;
}

}  // namespace mf
