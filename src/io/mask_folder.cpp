#include "io/mask_folder.h"

#include <filesystem>
#include <stdexcept>

#include "io/image_decoding.h"
#include "io/mask_image.h"
#include "lower_case.h"

namespace mono_pose_tracker {
namespace {

namespace fs = std::filesystem;

std::string text(const cv::Size& size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height);
}

bool is_jpeg_name(const std::string& path) {
  const std::string extension = lower_case(fs::path(path).extension().string());
  return extension == ".jpg" || extension == ".jpeg";
}

// The name that the next one would have, where this is the first of frames that are counted from 0; else
// none.
std::string second_of_count(std::string name) {
  if (name.empty() || name.find_first_not_of('0') != std::string::npos) return {};
  name.back() = '1';
  return name;
}

// What was 0 is some tens in the blocks of an outline when it comes out of a JPEG.
constexpr int kLeastOfJpeg = 64;

}  // namespace

MaskFolder::MaskFolder(const std::string& folder) : folder_(folder) {
  std::error_code error;
  fs::recursive_directory_iterator entries(folder, error);
  const auto fail = [&] {
    throw std::runtime_error(folder + ": cannot be read (" + error.message() +
                             "): expected a folder of masks");
  };
  if (error) fail();
  for (const auto end = fs::end(entries); entries != end; entries.increment(error)) {
    const fs::path& file = entries->path();
    if (!has_image_extension(file.string()) || entries->is_directory(error)) continue;
    const fs::path name = file.lexically_relative(folder).replace_extension();
    is_flat_ &= !name.has_parent_path();
    std::string& path = path_by_name_[name.string()];
    // Of two masks with one name the first by its extension: the order of a folder is no order.
    if (path.empty() || file.string() < path) path = file.string();
  }
  if (error) fail();
  if (path_by_name_.empty()) {
    throw std::runtime_error(folder + ": holds no image: expected masks with the base names of the images");
  }
}

cv::Mat MaskFolder::mask_of(const std::string& mask_name, const cv::Size& size, std::string* problem) const {
  problem->clear();
  fs::path name(mask_name);
  if (is_flat_) name = name.filename();
  const auto found = path_by_name_.find(name.replace_extension().string());
  if (found == path_by_name_.end()) {
    *problem = folder_ + ": has no mask for " + mask_name;
    if (path_by_name_.count(second_of_count(name.string())) > 0)
      *problem += ": frame numbers start at 0; masks that are numbered from 1 are off by one frame";
    return {};
  }
  const DecodedImage decoded = read_unchanged(found->second);
  if (!decoded.problem.empty()) {
    *problem = decoded.problem;
    return {};
  }
  if (decoded.image.size() != size) {
    *problem = found->second + ": is " + text(decoded.image.size()) + ": expected " + text(size) +
               ", the size of the image";
    return {};
  }
  if (is_jpeg_name(found->second)) return mask_of_image(decoded.image >= kLeastOfJpeg);
  return mask_of_image(decoded.image);
}

}  // namespace mono_pose_tracker
