#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "mono_pose_tracker/io/image_decoding.h"
#include "mono_pose_tracker/io/image_source.h"
#include "mono_pose_tracker/io/stamp.h"
#include "mono_pose_tracker/io/text_file.h"
#include "name_order.h"

namespace mono_pose_tracker {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSecond = 1000000000;

// A day of images at 30 Hz, each with a hundred letters.
constexpr std::size_t kMaxListBytes = std::size_t{1} << 28;

struct StampedFile {
  std::int64_t stamp_ns = 0;
  std::string path;
  std::string name, mask_name;  // as in SourceImage
};

/// The folder that all files are below.
fs::path common_folder(const std::vector<fs::path>& files) {
  fs::path common = files.front().parent_path();
  for (const fs::path& file : files) {
    const fs::path folder = file.parent_path();
    const auto end = std::mismatch(common.begin(), common.end(), folder.begin(), folder.end()).first;
    fs::path shared;
    for (auto part = common.begin(); part != end; ++part) shared /= *part;
    common = shared;
  }
  return common;
}

/// Whether each of the texts is there once only.
bool are_unique(const std::vector<std::string>& texts) {
  return std::set<std::string>(texts.begin(), texts.end()).size() == texts.size();
}

/// A name that stays on its line in the text files that hold it.
std::string without_control_characters(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '_');
  return name;
}

/// Gives the files their names.
std::vector<StampedFile> named(std::vector<StampedFile> files) {
  std::vector<fs::path> paths;
  std::vector<std::string> names;
  for (const StampedFile& file : files) {
    paths.push_back(fs::absolute(file.path).lexically_normal());
    names.push_back(paths.back().filename().string());
  }
  if (!are_unique(names)) {
    const fs::path common = common_folder(paths);
    for (std::size_t i = 0; i < files.size(); ++i) names[i] = paths[i].lexically_relative(common).string();
  }
  std::set<std::string> taken;
  std::map<std::string, int> last_number;
  for (std::size_t i = 0; i < files.size(); ++i) {
    files[i].mask_name = names[i];
    const fs::path name = files[i].name = without_control_characters(names[i]);
    int& number = last_number.emplace(files[i].name, 1).first->second;
    while (!taken.insert(files[i].name).second) {
      ++number;
      files[i].name = (name.parent_path() /
                       (name.stem().string() + "_" + std::to_string(number) + name.extension().string()))
                          .string();
    }
  }
  return files;
}

class ImageFiles : public ImageSource {
 public:
  explicit ImageFiles(std::vector<StampedFile> files) : files_(named(std::move(files))) {}

  SourceImage next() override {
    if (position_ == files_.size()) return {};
    const StampedFile& file = files_[position_++];
    DecodedImage decoded = read_image(file.path);
    const auto kind = decoded.problem.empty() ? SourceImage::Kind::kImage : SourceImage::Kind::kSkipped;
    return {kind, file.stamp_ns, file.name, file.mask_name, decoded.image, decoded.problem};
  }

  bool skip() override {
    if (position_ == files_.size()) return false;
    ++position_;
    return true;
  }

  int size() const override { return static_cast<int>(files_.size()); }

 private:
  std::vector<StampedFile> files_;
  std::size_t position_ = 0;
};

/// Whether it is written as a number, whatever its value.
bool is_number(const std::string& word) {
  static const std::regex number("[+-]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][+-]?[0-9]+)?");
  return word.size() < 1000 && std::regex_match(word, number);
}

StampedFile parse_line(const std::string& line, std::int64_t index, const fs::path& folder) {
  const std::size_t space = line.find_first_of(" \t");
  const std::string first = line.substr(0, space);
  StampedFile file;
  if (space != std::string::npos && parse_stamp(first, &file.stamp_ns)) {
    file.path = (folder / line.substr(line.find_first_not_of(" \t", space))).string();
    return file;
  }
  if (space != std::string::npos && is_number(first)) {
    throw std::runtime_error("the time stamp " + first + " is none: expected seconds, at most 4611686018");
  }
  file.stamp_ns = index * kSecond;
  file.path = (folder / line).string();
  return file;
}

std::vector<StampedFile> files_of_folder(const std::string& path) {
  std::error_code error;
  fs::directory_iterator folder(path, error);
  if (error)
    throw std::runtime_error(path + ": cannot be read (" + error.message() +
                             "): expected a folder of images");
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : folder) {
    const std::string name = entry.path().filename().string();
    if (name.front() != '.' && has_image_extension(name) && !entry.is_directory(error)) names.push_back(name);
  }
  if (names.empty()) {
    const fs::path list = fs::path(path) / "images.txt";
    throw std::runtime_error(path + ": holds no image: expected image files such as png, jpg, tif or pgm" +
                             (fs::exists(list, error) ? "; or the list in it, " + list.string() : ""));
  }
  std::vector<StampedFile> files;
  for (const std::string& name : in_order_of_names(std::move(names))) {
    StampedFile file;
    file.stamp_ns = static_cast<std::int64_t>(files.size()) * kSecond;
    file.path = (fs::path(path) / name).string();
    files.push_back(file);
  }
  return files;
}

std::vector<StampedFile> files_of_list(const std::string& path) {
  const char* const expected = "a text file with lines `timestamp path` or `path`";
  const std::string content = read_text_file(path, expected, kMaxListBytes);
  if (content.find('\0') != std::string::npos) {
    throw std::runtime_error(path + ": is no text: expected a folder of images or " + expected);
  }
  std::vector<StampedFile> files;
  std::istringstream lines(content);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::size_t start = line.find_first_not_of(" \t\r");
    if (start == std::string::npos || line[start] == '#') continue;
    line = line.substr(start, line.find_last_not_of(" \t\r") + 1 - start);
    try {
      files.push_back(
          parse_line(line, static_cast<std::int64_t>(files.size()), fs::path(path).parent_path()));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(path + ": line " + std::to_string(number) + ": " + error.what());
    }
  }
  if (files.empty()) throw std::runtime_error(path + ": names no image: expected " + expected);
  return files;
}

std::vector<StampedFile> files_of(const std::string& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    throw std::runtime_error(path + ": does not exist: expected a folder of images or a list of them");
  }
  if (fs::is_directory(path, ignored)) return files_of_folder(path);
  // It is read more than once, which a pipe can't be.
  if (!fs::is_regular_file(path, ignored)) {
    throw std::runtime_error(path + ": is neither a folder of images nor a file that lists them");
  }
  return files_of_list(path);
}

}  // namespace

std::unique_ptr<ImageSource> open_image_folder(const std::string& path) {
  return std::make_unique<ImageFiles>(files_of_folder(path));
}

std::unique_ptr<ImageSource> open_image_list(const std::string& path) {
  return std::make_unique<ImageFiles>(files_of_list(path));
}

std::unique_ptr<ImageSource> open_images(const std::string& path) {
  return std::make_unique<ImageFiles>(files_of(path));
}

std::vector<ImageFile> image_files(const std::string& path) {
  std::vector<ImageFile> files;
  for (const StampedFile& file : named(files_of(path)))
    files.push_back({file.path, file.name, file.stamp_ns});
  return files;
}

}  // namespace mono_pose_tracker
