#pragma once

#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>

namespace mono_pose_tracker {

/// The path in full, links followed as far as there is something: one file, one text.
inline std::string followed(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::path whole = std::filesystem::absolute(path, error);
  if (!error) whole = std::filesystem::weakly_canonical(whole, error);
  return (error ? path.lexically_normal() : whole).string();
}

/// The files and folders that a program reads and must not overwrite.
class Inputs {
 public:
  /// Empty paths are ignored.
  void add(const std::filesystem::path& path) {
    if (!path.empty()) paths_.insert(followed(path));
  }

  /// Throws std::runtime_error when the path, with links resolved, is one of them.
  void refuse_to_overwrite(const std::filesystem::path& output) const {
    if (!output.empty() && paths_.count(followed(output)) > 0) {
      throw std::runtime_error(output.string() + ": would be written over, but is an input");
    }
  }

 private:
  std::set<std::string> paths_;
};

}  // namespace mono_pose_tracker
