#include <algorithm>
#include <cstddef>
#include <ctime>
#include <filesystem>
#include <iomanip>
#include <iterator>
#include <limits>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/text.h"
#include "io/files.h"
#include "io/image_coding.h"
#include "io/image_source.h"
#include "io/stamp.h"

namespace mono_pose_tracker {
namespace {

bool is_digit(const std::string& name, std::size_t i) {
  return i < name.size() && name[i] >= '0' && name[i] <= '9';
}

// Its whole numbers filled up with zeros.
std::string padded(const std::string& name) {
  const std::size_t digits = std::numeric_limits<std::uint64_t>::digits10 + 1;
  std::string result;
  for (std::size_t i = 0; i < name.size();) {
    if (!is_digit(name, i)) {
      result += name[i++];
      continue;
    }
    std::size_t end = i;
    while (is_digit(name, end)) ++end;
    const bool is_fraction = i >= 2 && name[i - 1] == '.' && is_digit(name, i - 2);
    if (!is_fraction && end - i < digits) result.append(digits - (end - i), '0');
    result.append(name, i, end - i);
    i = end;
  }
  return result;
}

// A name goes before those that only go on: shot before shot (1), 1 before 1.5. In its extension no number
// counts.
std::string sort_key(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  return padded(dot == 0 ? name : name.substr(0, dot));
}

}  // namespace

std::vector<std::string> in_order_of_names(std::vector<std::string> names) {
  std::vector<std::pair<std::string, std::string>> keyed;
  keyed.reserve(names.size());
  for (std::string& name : names) keyed.emplace_back(sort_key(name), std::move(name));
  std::sort(keyed.begin(), keyed.end());
  std::transform(keyed.begin(), keyed.end(), names.begin(),
                 [](auto& entry) { return std::move(entry.second); });
  return names;
}

namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSecond = 1000000000;

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

/// Whether all texts are different.
bool are_unique(const std::vector<std::string>& texts) {
  return std::set<std::string>(texts.begin(), texts.end()).size() == texts.size();
}

/// A name without control characters, which occupies one line of a text file.
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
  explicit ImageFiles(std::vector<StampedFile> files, const GreyLevels& levels = {})
      : files_(named(std::move(files))), levels_(levels) {}

  SourceImage next() override {
    if (position_ == files_.size()) return {};
    const StampedFile& file = files_[position_++];
    DecodedImage decoded = read_image(file.path, levels_);
    const auto kind = decoded.problem.empty() ? SourceImage::Kind::kImage : SourceImage::Kind::kSkipped;
    return {kind, file.stamp_ns, file.name, file.mask_name, decoded.image, decoded.problem, decoded.mask};
  }

  bool skip() override {
    if (position_ == files_.size()) return false;
    ++position_;
    return true;
  }

  bool rewind() override {
    position_ = 0;
    return true;
  }

  int size() const override { return static_cast<int>(files_.size()); }

 private:
  std::vector<StampedFile> files_;
  const GreyLevels levels_;
  std::size_t position_ = 0;
};

/// Whether the text has the form of a number, whatever its value.
bool is_number(const std::string& word) {
  static const std::regex number("[+-]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][+-]?[0-9]+)?");
  return word.size() < 1000 && std::regex_match(word, number);
}

/// Path of an image named in a list, or its path in the folder data next to the list (EuRoC).
std::string resolved(const fs::path& folder, const std::string& name) {
  std::string slashed = name;
  std::replace(slashed.begin(), slashed.end(), '\\', '/');
  std::error_code ignored;
  for (const fs::path& path : {folder / name, folder / "data" / name, folder / slashed}) {
    if (fs::exists(path, ignored)) return path.string();
  }
  return (folder / name).string();
}

/// The path of the words that follow a time stamp. An association of colour and depth images names two, with
/// a time stamp between: that which is not of depth.
std::string path_of(const fs::path& folder, std::string rest) {
  const bool is_quoted = rest.size() > 2 && rest.front() == '"' && rest.back() == '"';
  if (is_quoted) rest = rest.substr(1, rest.size() - 2);
  const std::string whole = resolved(folder, rest);
  std::error_code ignored;
  if (is_quoted || fs::exists(whole, ignored)) return whole;
  std::istringstream words(rest);
  std::string first, stamp, second, more;
  std::int64_t unused = 0;
  const bool are_two = words >> first >> stamp >> second && !(words >> more) && has_image_extension(first) &&
                       has_image_extension(second) && parse_stamp(stamp, &unused);
  if (!are_two) return whole;
  return resolved(folder, first.find("depth") == std::string::npos ? first : second);
}

/// A line of KITTI's raw recordings, which is a date and a time (UTC) and has no path.
bool parse_date_and_time(const std::string& line, std::int64_t* stamp_ns) {
  static const std::regex form(
      "((19|20)[0-9]{2}-[0-9]{2}-[0-9]{2})[ T]([0-9]{2}:[0-9]{2}):([0-9]{2}([.][0-9]+)?)");
  std::smatch parts;
  if (line.size() > 100 || !std::regex_match(line, parts, form)) return false;
  std::istringstream minute(parts[1].str() + ' ' + parts[3].str());
  std::tm time = {};
  std::int64_t seconds_ns = 0;
  if (!(minute >> std::get_time(&time, "%Y-%m-%d %H:%M")) || !parse_stamp(parts[4].str(), &seconds_ns))
    return false;
  *stamp_ns = static_cast<std::int64_t>(timegm(&time)) * kSecond + seconds_ns;
  return true;
}

/// A list as it is read, line by line.
struct ListReader {
  fs::path folder;     // that its paths are relative to
  bool is_ns = false;  // its first line says so: "#timestamp [ns],filename"
  bool has_stamps_only = false;
  std::vector<StampedFile> files;

  void add(const std::string& line) {
    StampedFile of_date;
    if (parse_date_and_time(line, &of_date.stamp_ns)) {
      has_stamps_only = true;
      files.push_back(of_date);
      return;
    }
    const std::size_t end = line.find_first_of(" \t,");
    const std::string first = line.substr(0, end);
    StampedFile file;
    const bool is_stamp = parse_stamp_of_any_unit(first, is_ns, &file.stamp_ns);
    const std::size_t rest = end == std::string::npos ? end : line.find_first_not_of(" \t,", end);
    if (!is_stamp && is_number(first)) {
      throw std::runtime_error("the time stamp " + first +
                               " is invalid: expected seconds, at most 4611686018, or whole nanoseconds");
    }
    if (!is_stamp && add_path_first(line)) return;
    has_stamps_only |= is_stamp && rest == std::string::npos;
    if (!is_stamp) file.stamp_ns = static_cast<std::int64_t>(files.size()) * kSecond;
    if (!is_stamp) file.path = path_of(folder, line);
    if (is_stamp && rest != std::string::npos) file.path = path_of(folder, line.substr(rest));
    if (is_stamp && rest == std::string::npos) file.name = first;
    files.push_back(file);
  }

  /// A line whose time stamp follows the path; false: it is none.
  bool add_path_first(const std::string& line) {
    const std::size_t stamp = line.find_last_of(" \t,");
    if (stamp == std::string::npos) return false;
    const std::string path = line.substr(0, line.find_last_not_of(" \t,", stamp) + 1);
    StampedFile file;
    if (!has_image_extension(path) || !parse_stamp_of_any_unit(line.substr(stamp + 1), is_ns, &file.stamp_ns))
      return false;
    file.path = path_of(folder, path);
    files.push_back(file);
    return true;
  }
};

/// Images in a folder, by name; none where it is no folder that can be read.
std::vector<std::string> images_in(const fs::path& path) {
  std::error_code error;
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, error)) {
    const std::string name = entry.path().filename().string();
    if (name.front() != '.' && has_image_extension(name) && !entry.is_directory(error)) names.push_back(name);
  }
  return in_order_of_names(std::move(names));
}

/// The stamps that files are named after, in seconds or whole ms, us or ns since 1970; nothing where any of
/// them is named otherwise, such as by a count.
std::vector<std::int64_t> stamps_in_names(const std::vector<std::string>& names) {
  static const std::regex stamp("[1-4][0-9]{9}([.][0-9]+)?|[1-4]([0-9]{12}|[0-9]{15}|[0-9]{18})");
  std::vector<std::int64_t> stamps;
  for (const std::string& name : names) {
    const std::string stem = fs::path(name).stem().string();
    std::int64_t stamp_ns = 0;
    if (!std::regex_match(stem, stamp) || !parse_stamp_of_any_unit(stem, false, &stamp_ns)) return {};
    if (!stamps.empty() && stamp_ns <= stamps.back()) return {};
    stamps.push_back(stamp_ns);
  }
  return stamps;
}

std::vector<StampedFile> files_of_folder(const std::string& path) {
  std::error_code error;
  const fs::directory_iterator folder(path, error);
  if (error)
    throw std::runtime_error(path + ": cannot be read (" + error.message() +
                             "): expected a folder of images");
  const std::vector<std::string> names = images_in(path);
  if (names.empty()) {
    const fs::path list = fs::path(path) / "images.txt";
    throw std::runtime_error(path + ": holds no image: expected image files such as png, jpg, tif or pgm" +
                             (fs::exists(list, error) ? "; or the list in it, " + list.string() : "") +
                             unread_images(path));
  }
  const std::vector<std::int64_t> stamps = stamps_in_names(names);
  std::vector<StampedFile> files;
  for (const std::string& name : names) {
    StampedFile file;
    file.stamp_ns = stamps.empty() ? static_cast<std::int64_t>(files.size()) * kSecond : stamps[files.size()];
    file.path = (fs::path(path) / name).string();
    files.push_back(file);
  }
  return files;
}

/// Images for a list of time stamps only (KITTI's times.txt, EuRoC's), in a folder next to it. They are named
/// after the stamps, or are equal in number.
void find_images_of_stamps(const std::string& path, const fs::path& folder, std::vector<StampedFile>* files) {
  for (const char* subfolder : {".", "data", "image_0", "image_2", "image_00/data", "images", "rgb"}) {
    const fs::path images = folder / subfolder;
    const std::vector<std::string> names = images_in(images);
    if (names.empty()) continue;
    std::map<std::string, std::string> by_stem;
    for (const std::string& name : names) by_stem.emplace(fs::path(name).stem().string(), name);
    const bool are_named = std::all_of(files->begin(), files->end(),
                                       [&](const StampedFile& f) { return by_stem.count(f.name) > 0; });
    if (!are_named && names.size() != files->size()) {
      throw std::runtime_error(path + ": holds " + std::to_string(files->size()) +
                               " time stamps, but there are " + std::to_string(names.size()) + " images in " +
                               images.lexically_normal().string() + ": expected one time stamp per image");
    }
    for (std::size_t i = 0; i < files->size(); ++i) {
      StampedFile& file = (*files)[i];
      file.path = (images / (are_named ? by_stem.at(file.name) : names[i])).lexically_normal().string();
    }
    return;
  }
  throw std::runtime_error(path +
                           ": holds time stamps only, and its folder has no images: expected lines "
                           "`timestamp path` or `path`");
}

std::vector<StampedFile> files_of_list(const std::string& path) {
  const char* const expected = "a text file with lines `timestamp path` or `path`";
  const std::string content = read_text_file(path, expected);
  if (content.find('\0') != std::string::npos) {
    throw std::runtime_error(path + ": is not a text file: expected a folder of images or " + expected);
  }
  ListReader reader;
  reader.folder = fs::path(path).parent_path();
  std::istringstream lines(content);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::size_t start = line.find_first_not_of(" \t\r");
    if (start == std::string::npos) continue;
    if (line[start] == '#') {
      reader.is_ns |= line.find("[ns]") != std::string::npos;
      continue;
    }
    line = line.substr(start, line.find_last_not_of(" \t\r") + 1 - start);
    try {
      reader.add(line);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(path + ": line " + std::to_string(number) + ": " + error.what());
    }
  }
  std::vector<StampedFile>& files = reader.files;
  if (files.empty()) throw std::runtime_error(path + ": lists no image: expected " + expected);
  if (reader.has_stamps_only) {
    const auto has_path = [](const StampedFile& file) { return !file.path.empty(); };
    if (std::any_of(files.begin(), files.end(), has_path)) {
      throw std::runtime_error(path + ": has some lines with a time stamp but no path: expected " + expected);
    }
    find_images_of_stamps(path, reader.folder, &files);
  }
  return std::move(files);
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

/// How many images are in which subfolders, not hidden ones, down to a depth that cameras use (DCIM/100CANON)
/// and data sets (mav0/cam0/data). A folder of other things may be large: only its first entries are seen.
std::map<std::string, int> images_in_subfolders(const std::string& path) {
  constexpr int kMostDepth = 3, kMostEntries = 100'000;
  std::map<std::string, int> images;
  std::error_code error;
  fs::recursive_directory_iterator entry(path, fs::directory_options::skip_permission_denied, error);
  for (int seen = 0; !error && entry != fs::end(entry) && seen < kMostEntries; entry.increment(error)) {
    ++seen;
    const bool is_hidden = entry->path().filename().string().front() == '.';
    if (is_hidden || entry.depth() == kMostDepth) entry.disable_recursion_pending();
    const bool is_in_subfolder =
        entry.depth() > 0 && !is_hidden && has_image_extension(entry->path().string());
    std::error_code ignored;
    if (is_in_subfolder && !entry->is_directory(ignored))
      ++images[entry->path().parent_path().lexically_relative(path).string()];
  }
  return images;
}

/// The first of the folders.
std::string listed(const std::map<std::string, int>& folders) {
  constexpr std::size_t kMost = 4;
  std::string text;
  for (auto folder = folders.begin(); folder != folders.end(); ++folder) {
    if (std::distance(folders.begin(), folder) == kMost) return text + ", ...";
    text += (text.empty() ? "" : ", ") + one_line(folder->first);
  }
  return text;
}

}  // namespace

std::string unread_images(const std::string& path) {
  static const std::set<std::string> kinds = {".heic", ".heif", ".avif", ".jxl", ".gif", ".dng", ".cr2",
                                              ".cr3",  ".nef",  ".nrw",  ".arw", ".raf", ".orf", ".rw2",
                                              ".pef",  ".srw",  ".raw",  ".exr", ".hdr", ".psd", ".insp"};
  std::map<std::string, int> unread;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, error)) {
    const std::string extension = lower_case(entry.path().extension().string());
    if (entry.path().filename().string().front() != '.' && kinds.count(extension) > 0) ++unread[extension];
  }
  std::string text;
  for (const auto& [extension, count] : unread) {
    text += (text.empty() ? "; of kinds that are not supported: " : ", ") + std::to_string(count) + " " +
            extension;
  }
  if (!unread.empty()) text += " (convert them to png or jpg)";
  const std::map<std::string, int> folders = images_in_subfolders(path);
  int images = 0;
  for (const auto& folder : folders) images += folder.second;
  if (images > 0) {
    text += "; " + std::to_string(images) + " images are in its subfolders (" + listed(folders) +
            "), which are not searched: give one of the subfolders, or a list of the images";
  }
  return text;
}

std::unique_ptr<ImageSource> open_image_folder(const std::string& path) {
  return std::make_unique<ImageFiles>(files_of_folder(path));
}

std::unique_ptr<ImageSource> open_image_list(const std::string& path) {
  return std::make_unique<ImageFiles>(files_of_list(path));
}

std::unique_ptr<ImageSource> open_images(const std::string& path, const GreyLevels& levels) {
  return std::make_unique<ImageFiles>(files_of(path), levels);
}

void look_at_first(const std::string& path, GreyLevelChoice* levels) {
  for (const StampedFile& file : files_of(path)) {
    if (levels->is_settled()) return;
    const cv::Mat image = read_unchanged(file.path).image;
    if (!image.empty() && image.depth() != CV_16U) return;
    levels->look_at(image);
  }
}

std::string mixed_bits_text(const std::string& path) {
  const std::vector<StampedFile> files = named(files_of(path));
  if (files.empty()) return "";
  const auto bits_of = [&](std::size_t index) {
    const cv::Mat image = read_unchanged(files[index].path).image;
    return image.empty() ? 0 : static_cast<int>(8 * image.elemSize1());
  };
  const int first = bits_of(0);
  for (const std::size_t other : {std::min<std::size_t>(1, files.size() - 1), files.size() - 1}) {
    const int bits = first > 0 ? bits_of(other) : 0;
    if (bits == 0 || bits == first) continue;
    return formatted(
        "%s has %d bits per channel and %s has %d: one of them may be a depth image, which cannot be "
        "tracked. Give a folder or a list of the colour images",
        files.front().name.c_str(), first, files[other].name.c_str(), bits);
  }
  return "";
}

std::vector<ImageFile> image_files(const std::string& path) {
  std::vector<ImageFile> files;
  for (const StampedFile& file : named(files_of(path)))
    files.push_back({file.path, file.name, file.stamp_ns});
  return files;
}

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

}  // namespace

MaskFolder::MaskFolder(const std::string& folder, int min_jpeg_level)
    : folder_(folder), min_jpeg_level_(min_jpeg_level) {
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
  return read_mask(found->second, size, problem, min_jpeg_level_);
}

cv::Mat read_mask(const std::string& path, const cv::Size& size, std::string* problem, int min_jpeg_level) {
  const DecodedImage decoded = read_unchanged(path);
  *problem = decoded.problem;
  if (!problem->empty()) return {};
  if (decoded.image.size() != size) {
    *problem =
        path + ": is " + text(decoded.image.size()) + ": expected " + text(size) + ", the size of the image";
    return {};
  }
  if (is_jpeg_name(path)) return mask_of_image(decoded.image >= min_jpeg_level);
  return mask_of_image(decoded.image);
}

}  // namespace mono_pose_tracker
