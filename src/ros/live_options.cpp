#include "ros/live_options.h"

#include <dynamic_reconfigure/config_tools.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "ros/parameters.h"

namespace mono_pose_tracker {
namespace {

using dynamic_reconfigure::ConfigTools;

/// Calls visit(pointer, least, most) for each number or truth value; least and most are of its type.
template <typename Visit>
void for_each_value(const std::vector<OptionEntry>& entries, Visit visit) {
  for (const OptionEntry& entry : entries) {
    std::visit(
        [&](auto* value) {
          using T = std::remove_pointer_t<decltype(value)>;
          if constexpr (std::is_same_v<T, bool>) {
            visit(entry, value, false, true);
          } else if constexpr (std::is_arithmetic_v<T>) {
            const auto bound = [](double limit) {
              return static_cast<T>(std::clamp(limit, static_cast<double>(std::numeric_limits<T>::lowest()),
                                               static_cast<double>(std::numeric_limits<T>::max())));
            };
            visit(entry, value, bound(entry.min), bound(entry.max));
          }
        },
        entry.value);
  }
}

/// The type that dynamic_reconfigure sends a T as.
template <typename T>
using Sent =
    std::conditional_t<std::is_same_v<T, bool>, bool, std::conditional_t<std::is_integral_v<T>, int, double>>;

template <typename T>
const char* type_name() {
  return std::is_same_v<T, bool> ? "bool" : std::is_integral_v<T> ? "int" : "double";
}

}  // namespace

std::vector<OptionEntry> LiveOptions::entries() {
  std::vector<OptionEntry> live{{"publish_period", &publish_period, 0.01, 1e3, {}}};
  for (const OptionEntry& entry : option_table(&tracker)) {
    if (entry.changeable) live.push_back(entry);
  }
  return live;
}

std::string LiveOptions::changes_since(LiveOptions before) const {
  LiveOptions now = *this;
  const std::vector<OptionEntry> old_entries = before.entries(), entries = now.entries();
  std::string changes;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const std::string text = option_text(entries[i]);
    if (text == option_text(old_entries[i])) continue;
    changes += (changes.empty() ? "" : ", ") + entries[i].key + ": " + text;
  }
  return changes;
}

LiveOptions LiveOptions::__getMin__() {
  LiveOptions options;
  for_each_value(options.entries(),
                 [](const OptionEntry&, auto* value, auto least, auto) { *value = least; });
  return options;
}

LiveOptions LiveOptions::__getMax__() {
  LiveOptions options;
  for_each_value(options.entries(), [](const OptionEntry&, auto* value, auto, auto most) { *value = most; });
  return options;
}

void LiveOptions::__clamp__() {
  for_each_value(entries(), [](const OptionEntry&, auto* value, auto least, auto most) {
    *value = std::clamp(*value, least, most);
  });
}

dynamic_reconfigure::ConfigDescription LiveOptions::__getDescriptionMessage__() {
  dynamic_reconfigure::ConfigDescription description;
  dynamic_reconfigure::Group group;
  group.name = "Default";
  LiveOptions options;
  for_each_value(options.entries(), [&](const OptionEntry& entry, auto* value, auto, auto) {
    dynamic_reconfigure::ParamDescription parameter;
    parameter.name = entry.key;
    parameter.type = type_name<std::remove_pointer_t<decltype(value)>>();
    parameter.description = expected_value(entry) + "; explained in config/default.yaml";
    group.parameters.push_back(parameter);
  });
  description.groups.push_back(group);
  __getMin__().__toMessage__(description.min);
  __getMax__().__toMessage__(description.max);
  options.__toMessage__(description.dflt);
  return description;
}

void LiveOptions::__fromServer__(const ros::NodeHandle& handle) {
  ParameterReader reader(handle);
  for (const OptionEntry& entry : entries()) reader.read(entry);
}

void LiveOptions::__toServer__(const ros::NodeHandle& handle) const {
  LiveOptions copy = *this;
  for_each_value(copy.entries(), [&](const OptionEntry& entry, auto* value, auto, auto) {
    handle.setParam(entry.key, static_cast<Sent<std::remove_pointer_t<decltype(value)>>>(*value));
  });
}

void LiveOptions::__fromMessage__(const dynamic_reconfigure::Config& message) {
  for_each_value(entries(), [&](const OptionEntry& entry, auto* value, auto, auto) {
    using T = std::remove_pointer_t<decltype(value)>;
    auto sent = static_cast<Sent<T>>(*value);
    if constexpr (std::is_same_v<Sent<T>, bool>) {
      for (const auto& parameter : message.bools) {
        if (parameter.name == entry.key) *value = parameter.value != 0;
      }
    } else if (ConfigTools::getParameter(message, entry.key, sent)) {
      // No range holds NaN, and the nearest value in range is none: the one before stays.
      if constexpr (std::is_floating_point_v<Sent<T>>) {
        if (std::isnan(sent)) return;
      }
      *value = static_cast<T>(sent);
    }
  });
}

void LiveOptions::__toMessage__(dynamic_reconfigure::Config& message) const {
  LiveOptions copy = *this;
  for_each_value(copy.entries(), [&](const OptionEntry& entry, auto* value, auto, auto) {
    ConfigTools::appendParameter(message, entry.key,
                                 static_cast<Sent<std::remove_pointer_t<decltype(value)>>>(*value));
  });
  dynamic_reconfigure::GroupState group;
  group.name = "Default";
  group.state = true;
  message.groups.push_back(group);
}

}  // namespace mono_pose_tracker
