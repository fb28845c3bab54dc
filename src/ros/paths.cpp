#include "ros/paths.h"

#include <ros/package.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace mono_pose_tracker {
namespace {

bool starts_with(const std::string& text, const std::string& prefix) { return text.rfind(prefix, 0) == 0; }

std::string expand_prefix(const std::string& path) {
  if (starts_with(path, "file://")) return path.substr(7);
  if (starts_with(path, "package://")) {
    const std::size_t slash = path.find('/', 10);
    const std::string package = path.substr(10, slash == std::string::npos ? slash : slash - 10);
    const std::string folder = ros::package::getPath(package);
    if (folder.empty()) throw std::runtime_error(path + ": package \"" + package + "\" is not found");
    return slash == std::string::npos ? folder : folder + path.substr(slash);
  }
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody here changes the environment
  const char* home = std::getenv("HOME");
  if (home != nullptr && (path == "~" || starts_with(path, "~/"))) return home + path.substr(1);
  return path;
}

}  // namespace

std::string expand_path(const std::string& path) {
  if (path.empty()) return path;
  return std::filesystem::absolute(expand_prefix(path)).lexically_normal().string();
}

std::string one_file_problem(const std::string& parameter, const std::string& path,
                             const std::string& other_parameter, const std::string& other_path) {
  if (path.empty() || other_path.empty()) return "";
  const std::string a = expand_path(path), b = expand_path(other_path);
  std::error_code none_there;
  if (a != b && !std::filesystem::equivalent(a, b, none_there)) return "";
  return "~" + parameter + " and ~" + other_parameter + " are the same file, " + b + ": they must differ";
}

}  // namespace mono_pose_tracker
