#include <algorithm>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "mono_pose_tracker/io/image_decoding.h"
#include "mono_pose_tracker/io/image_source.h"
#include "mono_pose_tracker/io/stamp.h"
#include "mono_pose_tracker/io/text_file.h"

namespace mono_pose_tracker {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSecond = 1000000000;

struct StampedFile {
  std::int64_t stamp_ns;
  std::string path;
};

class ImageFiles : public ImageSource {
 public:
  explicit ImageFiles(std::vector<StampedFile> files) : files_(std::move(files)) {}

  SourceImage next() override {
    if (position_ == files_.size()) return {};
    const StampedFile& file = files_[position_++];
    DecodedImage decoded = read_image(file.path);
    const auto kind = decoded.problem.empty() ? SourceImage::Kind::kImage : SourceImage::Kind::kSkipped;
    return {kind, file.stamp_ns, fs::path(file.path).filename().string(), decoded.image, decoded.problem};
  }

  int size() const override { return static_cast<int>(files_.size()); }

 private:
  std::vector<StampedFile> files_;
  std::size_t position_ = 0;
};

StampedFile parse_line(const std::string& line, std::int64_t index, const fs::path& folder) {
  const std::size_t space = line.find_first_of(" \t");
  std::int64_t stamp_ns = 0;
  if (space != std::string::npos && parse_stamp(line.substr(0, space), &stamp_ns)) {
    return {stamp_ns, (folder / line.substr(line.find_first_not_of(" \t", space))).string()};
  }
  return {index * kSecond, (folder / line).string()};
}

}  // namespace

std::unique_ptr<ImageSource> open_image_folder(const std::string& path) {
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
    throw std::runtime_error(path + ": holds no image: expected image files such as png, jpg, tif or pgm");
  }
  std::sort(names.begin(), names.end());
  std::vector<StampedFile> files;
  for (const std::string& name : names) {
    files.push_back({static_cast<std::int64_t>(files.size()) * kSecond, (fs::path(path) / name).string()});
  }
  return std::make_unique<ImageFiles>(std::move(files));
}

std::unique_ptr<ImageSource> open_image_list(const std::string& path) {
  const char* const expected = "a text file with lines `timestamp path` or `path`";
  const std::string content = read_text_file(path, expected);
  if (content.find('\0') != std::string::npos) {
    throw std::runtime_error(path + ": is no text: expected a folder of images or " + expected);
  }
  std::vector<StampedFile> files;
  std::istringstream lines(content);
  std::string line;
  while (std::getline(lines, line)) {
    const std::size_t start = line.find_first_not_of(" \t\r");
    if (start == std::string::npos || line[start] == '#') continue;
    line = line.substr(start, line.find_last_not_of(" \t\r") + 1 - start);
    files.push_back(parse_line(line, static_cast<std::int64_t>(files.size()), fs::path(path).parent_path()));
  }
  if (files.empty()) throw std::runtime_error(path + ": names no image: expected " + expected);
  return std::make_unique<ImageFiles>(std::move(files));
}

std::unique_ptr<ImageSource> open_images(const std::string& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    throw std::runtime_error(path + ": does not exist: expected a folder of images or a list of them");
  }
  return fs::is_directory(path, ignored) ? open_image_folder(path) : open_image_list(path);
}

}  // namespace mono_pose_tracker
