#pragma once

#include <cstddef>
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

/// Largest YAML file that is read. A calibration has 1 kB and some tens of values, config/default.yaml 12 kB
/// and a hundred, in two levels.
struct YamlLimits {
  std::size_t bytes = 256 * 1024;
  std::size_t depth = 20;      // of nested lists and maps
  std::size_t values = 20000;  // with the aliases expanded
};

/// Reads the only document of a YAML file, within the limits. (A file of 800 bytes of aliases can stand for
/// gigabytes, one that holds itself for ever.) Throws std::runtime_error, one line that names the path, the
/// line and `expected` (what the file should have been), also for a key given twice: which of the two was
/// meant? And for a second document, of which nothing would be heeded.
YamlValue read_yaml_file(const std::string& path, const std::string& expected, const YamlLimits& limits = {});

/// The same of a file's content; the message does not name the path.
YamlValue parse_yaml(const std::string& content, const std::string& expected, const YamlLimits& limits = {});

}  // namespace mono_pose_tracker
