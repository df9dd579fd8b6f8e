// SPDX-License-Identifier: Apache-2.0
#include "common/json_fault.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <vector>

namespace mf {

namespace {

// Follows the parser and remembers which value it was in when it stumbled.
class PathTracker : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit PathTracker(std::string_view text) : text_(text) {}

  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(number_integer_t) override { return value(); }
  bool number_unsigned(number_unsigned_t) override { return value(); }
  bool number_float(number_float_t, const string_t&) override { return value(); }
  bool string(string_t&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool start_object(std::size_t) override {
    levels_.push_back({false, 0, {}});
    return true;
  }
  bool key(string_t& name) override {
    levels_.back().key = name;
    return true;
  }
  bool end_object() override { return end(); }
  bool start_array(std::size_t) override {
    levels_.push_back({true, 0, {}});
    return true;
  }
  bool end_array() override { return end(); }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::json::exception& e) override {
    fault_ = JsonFault{path(), problem(position, e.id)};
    return false;
  }

  [[nodiscard]] const std::optional<JsonFault>& fault() const { return fault_; }

 private:
  struct Level {
    bool is_array;
    std::size_t index;
    std::string key;
  };

  bool value() {
    if (levels_.empty()) return true;
    if (levels_.back().is_array) ++levels_.back().index;
    levels_.back().key.clear();
    return true;
  }
  bool end() {
    levels_.pop_back();
    return value();
  }
  [[nodiscard]] std::string path() const {
    std::string joined;
    for (const Level& level : levels_) {
      if (level.is_array)
        joined += fmt::format("[{}]", level.index);
      else if (!level.key.empty())
        joined += (joined.empty() ? "" : ".") + level.key;
    }
    return joined;
  }
  [[nodiscard]] std::string problem(std::size_t position, int error_id) const;

  std::string_view text_;
  std::vector<Level> levels_;
  std::optional<JsonFault> fault_;
};

bool is_word_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '+' || c == '-' || c == '.';
}

// Where the word at fault begins; the parser has read `read` characters. A number that is out of range was read to its
// end and perhaps one character further, any other word only as far as it could still have been right.
std::size_t word_start(std::string_view text, std::size_t read, bool read_to_its_end) {
  std::size_t start = std::min(read, text.size());
  while (read_to_its_end && start > 0 && !is_word_character(text[start - 1])) --start;
  if (start > 0) --start;
  while (start > 0 && is_word_character(text[start]) && is_word_character(text[start - 1])) --start;
  return start;
}

std::string word_at(std::string_view text, std::size_t start) {
  constexpr std::size_t longest = 24;
  std::size_t end = start;
  while (end < text.size() && end - start < longest && is_word_character(text[end])) ++end;
  return std::string(text.substr(start, std::max<std::size_t>(end - start, 1)));
}

std::string PathTracker::problem(std::size_t position, int error_id) const {
  constexpr int out_of_range = 406;  // nlohmann::json's id of a number that no double holds
  const std::size_t start = word_start(text_, position, error_id == out_of_range);
  const std::string_view before = text_.substr(0, start);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t line_start = before.rfind('\n') == std::string_view::npos ? 0 : before.rfind('\n') + 1;
  const std::string place = fmt::format("line {}, column {}", line, start - line_start + 1);
  if (position > text_.size() || text_.empty())
    return fmt::format("is no valid JSON: the file ends at {}: complete it", place);
  const std::string word = word_at(text_, start);
  const std::string_view sign_free = std::string_view(word).substr(word.starts_with('-') ? 1 : 0);
  if (error_id == out_of_range || sign_free.starts_with("NaN") || sign_free.starts_with("nan") ||
      sign_free.starts_with("Inf") || sign_free.starts_with("inf"))
    return fmt::format("is {} ({}): give a finite number", word, place);
  return fmt::format("is no valid JSON at {}, near '{}': correct the syntax", place, word);
}

}  // namespace

std::optional<JsonFault> find_json_fault(std::string_view text) {
  PathTracker tracker(text);
  nlohmann::json::sax_parse(text, &tracker);
  return tracker.fault();
}

}  // namespace mf
