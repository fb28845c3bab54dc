#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "io/image_coding.h"

namespace mono_pose_tracker {

// By name, numbers in it by their value: frame_2 before frame_10. What stands behind a point after a digit is
// a fraction (1403636579.81 is later than 1403636579.7635), and goes as text.
std::vector<std::string> in_order_of_names(std::vector<std::string> names);

/// The next image of a recording, or why there is none.
struct SourceImage {
  enum class Kind { kImage, kSkipped, kEnd };
  Kind kind = Kind::kEnd;
  std::int64_t stamp_ns = 0;
  /// No two images of a recording have the same: the file's name, or that of the file which a frame of a
  /// video or bag would be written to (its number with six digits, .png). Where files of several folders have
  /// one name, the path below what these folders have in common; where one file is named several times, with
  /// _2, _3 ... before its extension. Control characters, such as an end of line, are _ in it.
  std::string name;
  std::string mask_name;  // what its mask is named after: the path below that common folder, or the number
  cv::Mat image;          // kImage: CV_8UC1 or CV_8UC3 (BGR)
  std::string problem;    // kSkipped: one line that names the file or frame
  cv::Mat mask;           // of an image with alpha, as DecodedImage has it
};

/// A recording, read image by image in order. An image that cannot be read is skipped; the rest follows.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  virtual SourceImage next() = 0;
  /// Passes over an image, whether it can be read or not, with less work than reading it where there is a
  /// way. False at the end.
  virtual bool skip() { return next().kind != SourceImage::Kind::kEnd; }
  /// Goes back to the first image; images that have been read before are skipped without reading what lies
  /// between. False where that is not possible, and the recording has to be opened again.
  virtual bool rewind() { return false; }
  /// How many images there are, or -1 when that is not known.
  virtual int size() const { return -1; }
  /// How wide a pixel is shown, over how high: not 1 of an anamorphic video.
  virtual double pixel_aspect() const { return 1; }
};

/// Image files of a folder sorted by name (numbers by their value), stamped with their index in seconds, or
/// with their names where all of these are times since 1970 (1305031102.175304.png, 1403636579763555584.png).
/// Throws std::runtime_error, one line, when there is no such folder or no image in it.
std::unique_ptr<ImageSource> open_image_folder(const std::string& path);

/// Images named by a text file: lines `timestamp path` or just `path` (then the index in seconds is the
/// stamp), # comments, paths relative to the file. The stamp may be in whole nanoseconds. Also EuRoC's
/// data.csv, associations of colour and depth as TUM has them, and time stamps alone with the images beside
/// the file (KITTI's times.txt). Throws std::runtime_error, one line, when the list cannot be read or names
/// nothing.
std::unique_ptr<ImageSource> open_image_list(const std::string& path);

/// Looks at the first images of a folder or list that can be read, for their levels where they have 16 bits.
void look_at_first(const std::string& path, GreyLevelChoice* levels);

/// A warning where the first two images or the last one differ in the bits of a channel, as where the colour
/// and depth images of one camera are together. One line; empty: they do not differ.
std::string mixed_bits_text(const std::string& path);

/// A folder or a list; levels: of images of 16 bits. Throws std::runtime_error, one line, when it is neither
/// (it is read more than once, which a pipe can't be), and as those above.
std::unique_ptr<ImageSource> open_images(const std::string& path, const GreyLevels& levels = {});

/// Of a folder: images that it holds and that are not read, being of a format that OpenCV does not read or in
/// folders of their own. A text that goes on after another, with a semicolon first; empty: none.
std::string unread_images(const std::string& path);

/// A file of a recording, and the name and the stamp that it has there (SourceImage).
struct ImageFile {
  std::string path, name;
  std::int64_t stamp_ns = 0;
};

/// The files of a folder or a list, whether they can be read or not. Throws as open_images.
std::vector<ImageFile> image_files(const std::string& path);

/// A video file: frame i is stamped i / fps, or with the container's time where that differs by more than
/// half a frame (a variable frame rate). One that ends long before it should says so as what is skipped last.
/// Throws std::runtime_error, one line, when it cannot be opened.
/// key_frame_distance: frames between key frames, at most, by default that of x264. Up to there decoding
/// takes no longer than seeking, which decodes from a key frame.
std::unique_ptr<ImageSource> open_video(const std::string& path, std::int64_t key_frame_distance = 250);

/// Mask images of a folder and of the folders in it, found by the name of the image they belong to, whatever
/// their extension.
class MaskFolder {
 public:
  /// Throws std::runtime_error, one line, when there is no such folder or no image in it. min_jpeg_level:
  /// lower grey levels of a JPEG are 0. Its compression makes some tens of 0 in the blocks along an outline.
  explicit MaskFolder(const std::string& folder, int min_jpeg_level = 64);

  /// Mask of an image (SourceImage::mask_name; its folders count where the masks lie in folders): CV_8UC1 of
  /// the given size, 0 = ignore, 255 = use. Empty, with one line in *problem, when there is none, it cannot
  /// be read or it has another size.
  cv::Mat mask_of(const std::string& mask_name, const cv::Size& size, std::string* problem) const;

  /// True when no mask lies in a folder of its own: images of several folders share those of their name.
  bool is_flat() const { return is_flat_; }

 private:
  std::string folder_;
  int min_jpeg_level_;
  bool is_flat_ = true;
  std::map<std::string, std::string> path_by_name_;  // by the path below folder_, without its extension
};

/// Reads a mask file of the given size as MaskFolder does; empty, with one line in *problem, when it cannot.
cv::Mat read_mask(const std::string& path, const cv::Size& size, std::string* problem,
                  int min_jpeg_level = 64);

}  // namespace mono_pose_tracker
