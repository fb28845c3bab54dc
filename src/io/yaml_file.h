#pragma once

#include <string>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// A value of a YAML file.
struct YamlValue {
  enum class Kind { kNothing, kText, kList, kMap };
  Kind kind = Kind::kNothing;
  int line = 0;                                            // from 1
  std::string text;                                        // kText: as it is written, without quotes
  std::vector<YamlValue> items;                            // kList
  std::vector<std::pair<std::string, YamlValue>> entries;  // kMap, in the file's order; no key twice

  const YamlValue* find(const std::string& key) const;  // of a map; null when there is none
};

/// Reads the only document of a YAML file, of which there is more than the file only as far as these limits
/// go: 256 KiB, nested 20 deep, 20,000 values with its aliases written out. (A file of 800 bytes of aliases
/// can stand for gigabytes, one that holds itself for ever.) Throws std::runtime_error, one line that names
/// the path, the line and `expected` (what the file should have been), also for a key given twice: which of
/// the two was meant? And for a second document, of which nothing would be heeded.
YamlValue read_yaml_file(const std::string& path, const std::string& expected);

/// The same of a file's content; the message does not name the path.
YamlValue parse_yaml(const std::string& content, const std::string& expected);

}  // namespace mono_pose_tracker
