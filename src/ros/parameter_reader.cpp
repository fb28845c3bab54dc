#include "ros/parameter_reader.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <stdexcept>

namespace mono_pose_tracker {
namespace {

std::string to_text(XmlRpc::XmlRpcValue& value) {
  char text[64];
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return static_cast<bool>(value) ? "true" : "false";
    case XmlRpc::XmlRpcValue::TypeInt:
      return std::to_string(static_cast<int>(value));
    case XmlRpc::XmlRpcValue::TypeDouble:
      std::snprintf(text, sizeof(text), "%.17g", static_cast<double>(value));
      return text;
    case XmlRpc::XmlRpcValue::TypeString:
      return static_cast<std::string>(value);
    default:
      return value.toXml();
  }
}

/// Parameters below the node's name that other libraries read. image_transport's plugins have theirs below
/// the topics that are published, and below their own names of what is subscribed to.
bool is_of_a_library(const std::string& key) {
  if (key == "diagnostic_period" || key == "num_worker_threads") return true;
  const auto is_below = [&key](const char* folder) { return key.rfind(folder, 0) == 0; };
  constexpr std::array folders{"debug_image/", "image_raw/",       "mask/",
                               "compressed/",  "compressedDepth/", "theora/"};
  return std::any_of(folders.begin(), folders.end(), is_below);
}

std::string joined(const std::vector<std::string>& parts, const char* separator) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : separator) + part;
  return text;
}

}  // namespace

void ParameterReader::read(const OptionEntry& option) {
  XmlRpc::XmlRpcValue value;
  if (handle_.getParam(option.key, value)) {
    const std::string text = to_text(value);
    if (!set_option(option, text) || !is_in_range(option)) {
      problems_.push_back("~" + option.key + " is " + text + ", expected " + expected_value(option));
    }
  }
  values_.emplace_back(option.key, option_text(option));
}

void ParameterReader::check(const std::string& owner) const {
  if (problems_.empty()) return;
  std::vector<std::string> all = problems_;
  for (std::string& line : unknown(owner)) all.push_back(std::move(line));
  throw std::invalid_argument(joined(all, "; "));
}

bool ParameterReader::is_known(const std::string& key) const {
  return is_of_a_library(key) ||
         std::any_of(values_.begin(), values_.end(), [&](const auto& v) { return v.first == key; });
}

std::vector<std::string> ParameterReader::unknown(const std::string& owner) const {
  std::vector<OptionEntry> table;
  for (const auto& value : values_) table.push_back({value.first, {}, 0, 0, {}});
  std::vector<std::string> all, lines;
  handle_.getParamNames(all);
  const std::string prefix = handle_.getNamespace() + "/";
  for (const std::string& name : all) {
    if (name.rfind(prefix, 0) != 0) continue;
    const std::string key = name.substr(prefix.size());
    if (is_known(key)) continue;
    const std::string meant = suggestion_for(table, key);
    lines.push_back("~" + key + " is not a parameter of " + owner +
                    (meant.empty() ? "" : "; did you mean ~" + meant + "?"));
  }
  return lines;
}

std::string ParameterReader::effective() const {
  std::vector<std::string> parts;
  for (const auto& [key, text] : values_) parts.push_back(key + ": " + (text.empty() ? "''" : text));
  return joined(parts, ", ");
}

}  // namespace mono_pose_tracker
