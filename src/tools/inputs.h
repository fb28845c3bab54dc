#pragma once

#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>

namespace mono_pose_tracker {

/// The path in full, links followed as far as there is something: one file, one text.
inline std::string followed(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::path whole =
      std::filesystem::weakly_canonical(std::filesystem::absolute(path), error);
  return (error ? path.lexically_normal() : whole).string();
}

/// The files and folders that a program reads, of which it must write over none.
class Inputs {
 public:
  /// Empty paths name nothing.
  void add(const std::filesystem::path& path) {
    if (!path.empty()) paths_.insert(followed(path));
  }

  /// The folder with all the files in it; no folder: nothing more than add.
  void add_folder(const std::filesystem::path& folder) {
    add(folder);
    std::error_code error;
    for (std::filesystem::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
      add(entry->path());
    }
  }

  /// Throws std::runtime_error when the path is, links followed, one of them.
  void refuse_to_overwrite(const std::filesystem::path& output) const {
    if (!output.empty() && paths_.count(followed(output)) > 0) {
      throw std::runtime_error(output.string() + ": would be written over, and is read");
    }
  }

 private:
  std::set<std::string> paths_;
};

}  // namespace mono_pose_tracker
