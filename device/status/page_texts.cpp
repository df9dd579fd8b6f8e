// SPDX-License-Identifier: Apache-2.0
#include "device/status/page_texts.h"

#include <nlohmann/json.hpp>

#include "device/rig_status_json.h"

namespace mf {

namespace {

std::string event(const char* name, const std::string& data) {
  return std::string("event: ") + name + "\ndata: " + data + "\n\n";
}

std::string text_of(const nlohmann::json& json_value) {
  return json_value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::shared_ptr<const PageTexts> PageTextMaker::make(const RigNews& news, std::chrono::steady_clock::time_point now) {
  nlohmann::json all{{"connected", news.connected}, {"problem", news.problem}, {"remote_start", remote_start_}};
  if (news.start_answer)
    all["start_answer"] = {{"number", news.start_answer->number},
                           {"accepted", news.start_answer->accepted},
                           {"reason", news.start_answer->reason}};
  if (news.status) {
    nlohmann::json status = rig_status_to_json(*news.status);
    if (news.status->preview && previewed_ != news.status) {
      preview_event_ = std::make_shared<const std::string>(event("preview", text_of(status["preview"])));
      ++preview_number_;
    }
    if (previewed_ != news.status) seconds_left_ = forecast_.seconds_left(*news.status, now);
    previewed_ = news.status;
    if (status.contains("preview")) status["preview"].erase("grey");
    all["status"] = std::move(status);
    all["age_s"] = std::chrono::duration<double>(now - news.status_at).count();
    if (seconds_left_) all["seconds_left"] = *seconds_left_;
  }
  PageTexts texts;
  texts.number = ++number_;
  texts.preview_number = preview_number_;
  texts.status = text_of(all);
  texts.status_event = event("status", texts.status);
  texts.preview_event = preview_event_;
  return std::make_shared<const PageTexts>(std::move(texts));
}

}  // namespace mf
