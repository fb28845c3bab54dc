#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

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

/// The files that a program is about to write. None may be one of its inputs, and no two options may write
/// the same file.
class WrittenFiles {
 public:
  explicit WrittenFiles(Inputs inputs) : inputs_(std::move(inputs)) {}

  /// option: that asks for the file. Empty paths name nothing. Throws std::runtime_error naming the path.
  void add(const std::filesystem::path& path, const std::string& option) {
    if (path.empty()) return;
    inputs_.refuse_to_overwrite(path);
    const auto [entry, is_new] = option_of_.emplace(followed(path), option);
    if (is_new || entry->second == option) return;
    throw std::runtime_error(path.string() + ": would be written twice, by " + entry->second + " and by " +
                             option);
  }

 private:
  const Inputs inputs_;
  std::map<std::string, std::string> option_of_;  // by the file
};

}  // namespace mono_pose_tracker
