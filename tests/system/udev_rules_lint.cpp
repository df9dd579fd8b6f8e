// SPDX-License-Identifier: Apache-2.0
#include "tests/system/udev_rules_lint.h"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <set>
#include <sstream>

namespace mf::test {

namespace {

struct Term {
  std::string key, operation, value;  // key without its {attribute}
};

// The terms of a rule; nothing when it is none.
std::vector<Term> terms_of(const std::string& line, bool& malformed) {
  static const std::regex term(R"re(\s*([A-Z]+)(\{[^}]*\})?\s*(==|!=|\+=|-=|:=|=)\s*"([^"]*)"\s*(,|$))re");
  std::vector<Term> terms;
  auto at = line.cbegin();
  std::smatch match;
  while (at != line.cend() && std::regex_search(at, line.cend(), match, term, std::regex_constants::match_continuous)) {
    terms.push_back({match[1], match[3], match[4]});
    at = match[0].second;
  }
  malformed = at != line.cend();
  return terms;
}

// ENV and ATTR could be assigned, but here they never are: a lost "=" would set a property or write to /sys.
const std::set<std::string> comparisons{"ACTION", "DEVPATH", "KERNEL", "KERNELS", "SUBSYSTEM", "SUBSYSTEMS",
                                        "DRIVER", "DRIVERS", "ATTR",   "ATTRS",   "ENV",       "TAGS",
                                        "TEST",   "CONST",   "RESULT", "PROGRAM", "SYSCTL"};
const std::set<std::string> additions{"TAG", "SYMLINK", "RUN"};
const std::set<std::string> assignments{"GROUP", "MODE", "OWNER", "LABEL", "GOTO", "IMPORT", "OPTIONS"};

bool is_comparison(const std::string& operation) {
  return operation == "==" || operation == "!=";
}

std::string fault_of(const Term& t) {
  if (comparisons.contains(t.key))
    return is_comparison(t.operation) ? ""
                                      : fmt::format("{} is assigned with {}: compare it with ==", t.key, t.operation);
  if (additions.contains(t.key)) return t.operation == "+=" ? "" : t.key + " must be added with +=";
  if (!assignments.contains(t.key)) return t.key + " is no key that these rules know";
  if (t.operation != "=") return t.key + " must be assigned with =";
  static const std::regex mode("0[0-7]{3}");
  if (t.key == "MODE" && !std::regex_match(t.value, mode)) return "MODE must be four octal digits";
  if (t.key == "MODE" && t.value.back() != '0') return fmt::format("MODE {} lets everybody in", t.value);
  return "";
}

bool has(const std::vector<Term>& terms, const std::string& key, const std::string& value = "") {
  return std::any_of(terms.begin(), terms.end(),
                     [&](const Term& t) { return t.key == key && (value.empty() || t.value == value); });
}

std::vector<std::string> faults_of_rule(const std::string& file_name, const std::vector<Term>& terms) {
  std::vector<std::string> faults;
  for (const Term& t : terms)
    if (const std::string why = fault_of(t); !why.empty()) faults.push_back(why);
  const bool grants = has(terms, "MODE") || has(terms, "GROUP") || has(terms, "OWNER");
  if (grants && !(has(terms, "MODE") && has(terms, "GROUP"))) faults.emplace_back("MODE and GROUP belong together");
  if ((grants || has(terms, "TAG") || has(terms, "RUN")) && !has(terms, "SUBSYSTEM"))
    faults.emplace_back("names no SUBSYSTEM: it would hold for any device");
  if (has(terms, "TAG", "uaccess") && file_name >= "70") faults.emplace_back("uaccess is too late from 70 on");
  static const std::regex everybody(R"(chmod.*(\s0?[0-7]{2}[2367]\s|[ao]\+[rx]*w))");
  for (const Term& t : terms)
    if (t.key == "RUN" && std::regex_search(t.value, everybody)) faults.emplace_back("RUN lets everybody write");
  return faults;
}

}  // namespace

std::vector<std::string> lint_udev_rules(const std::string& file_name, const std::string& text) {
  static const std::regex example("#[A-Z]+(==|!=|\\{).*");
  std::vector<std::string> faults;
  std::set<std::string> wanted_labels;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (std::regex_match(line, example)) line.erase(0, 1);
    if (line.empty() || line.front() == '#') continue;
    bool malformed = false;
    const std::vector<Term> terms = terms_of(line, malformed);
    if (malformed) faults.push_back(fmt::format("{}:{}: is no KEY==\"value\", ...", file_name, number));
    for (const std::string& why : faults_of_rule(file_name, terms))
      faults.push_back(fmt::format("{}:{}: {}", file_name, number, why));
    for (const Term& t : terms) {
      if (t.key == "GOTO") wanted_labels.insert(t.value);
      if (t.key == "LABEL") wanted_labels.erase(t.value);  // a label stands after its GOTO
    }
  }
  for (const std::string& label : wanted_labels) faults.push_back(fmt::format("{}: no LABEL {}", file_name, label));
  return faults;
}

}  // namespace mf::test
