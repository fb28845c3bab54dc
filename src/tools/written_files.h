#pragma once

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "inputs.h"

namespace mono_pose_tracker {

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
