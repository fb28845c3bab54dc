#include "name_order.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace mono_pose_tracker {

namespace {

bool is_digit(const std::string& name, std::size_t i) {
  return i < name.size() && name[i] >= '0' && name[i] <= '9';
}

// Its whole numbers filled up with zeros.
std::string padded(const std::string& name) {
  constexpr std::size_t kDigits = 20;  // those of 64 bits
  std::string result;
  for (std::size_t i = 0; i < name.size();) {
    if (!is_digit(name, i)) {
      result += name[i++];
      continue;
    }
    std::size_t end = i;
    while (is_digit(name, end)) ++end;
    const bool is_fraction = i >= 2 && name[i - 1] == '.' && is_digit(name, i - 2);
    if (!is_fraction && end - i < kDigits) result.append(kDigits - (end - i), '0');
    result.append(name, i, end - i);
    i = end;
  }
  return result;
}

// A name goes before those that only go on: shot before shot (1), 1 before 1.5. In its extension no number
// counts.
std::string sort_key(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  return padded(dot == 0 ? name : name.substr(0, dot));
}

}  // namespace

std::vector<std::string> in_order_of_names(std::vector<std::string> names) {
  std::vector<std::pair<std::string, std::string>> keyed;
  keyed.reserve(names.size());
  for (std::string& name : names) keyed.emplace_back(sort_key(name), std::move(name));
  std::sort(keyed.begin(), keyed.end());
  std::transform(keyed.begin(), keyed.end(), names.begin(),
                 [](auto& entry) { return std::move(entry.second); });
  return names;
}

}  // namespace mono_pose_tracker
