#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace mono_pose_tracker {

/// The 16-bit values that become black and white in 8 bits.
struct GreyLevels {
  double black = 0, white = 65536;
};

/// Options of GreyLevelChoice.
struct GreyLevelOptions {
  int first_images = 5;        // that auto looks at, before the levels stay
  double least_bright = 256;   // a first image whose brightest value is below tells nothing: a lens cap
  int most_dark_images = 100;  // after so many of these they count as well
  double tail_share = 1e-3;    // of the pixels below and above what counts as the range of an image
  double least_range =
      1.0 / 8;          // of the values of so many bits: a narrower range is stretched (thermal cameras)
  double margin = 0.5;  // of the range, on either side: the scene changes
};

/// Chooses the grey levels of the 16-bit images of a recording or topic. setting: "auto"; a number of
/// significant bits, "8" to "16", of the lower ones; or "BLACK:WHITE", two values. auto: from the first
/// images, the smallest of 8, 10, 12, 14 and 16 bits that holds their values; if they use a small part of
/// that range, that part. Constant afterwards: brightness must not depend on the image's content.
class GreyLevelChoice {
 public:
  /// Throws std::invalid_argument on another setting, with a text that says what was expected.
  explicit GreyLevelChoice(const std::string& setting = "auto", const GreyLevelOptions& options = {});

  /// Inspects an image (CV_16UC1 to 4; other depths are ignored). True when the levels have been settled by
  /// it.
  bool look_at(const cv::Mat& image);
  bool is_settled() const { return is_settled_; }
  const GreyLevels& levels() const { return levels_; }
  /// The chosen levels and the reason, one line. Empty if no image has 16 bits.
  std::string text() const;

 private:
  void settle_by_range();

  GreyLevelOptions options_;
  GreyLevels levels_;
  std::string reason_;
  bool is_settled_ = false;
  int looked_at_ = 0, dark_ = 0;
  double lowest_ = 65535, highest_ = 0, brightest_ = 0;  // of the images looked at
};

/// The size that an image file promises, in px, or the problem in one line.
struct ImageHeader {
  std::uint64_t width = 0, height = 0;
  std::string problem;  // empty when there is a size
};

/// Reads the head of a PNG, JPEG, BMP, PGM/PPM/PBM, TIFF, WebP or JPEG 2000 file: the numbers that its
/// decoder will ask memory for. Of other formats, and of heads that are cut, the size is not known.
ImageHeader read_image_header(const std::vector<unsigned char>& bytes);

/// By its first bytes.
bool is_jpeg(const std::vector<unsigned char>& bytes);

/// True for a JPEG that has an end-of-image marker of its own; markers inside its segments (an EXIF
/// thumbnail's) do not count.
bool has_end_of_jpeg(const std::vector<unsigned char>& bytes);

/// What libjpeg makes of the coded data of a JPEG.
struct JpegData {
  cv::Mat image;           // CV_8UC1 or CV_8UC3 (BGR); empty: to be decoded otherwise
  bool end_early = false;  // before the last pixel, whatever stands behind: libjpeg makes up the rest in grey
};

/// Where the data are neither grey nor of three channels, or libjpeg refuses them, there is no image. Throws
/// for lack of memory.
JpegData read_jpeg_data(const std::vector<unsigned char>& bytes);

/// Largest decoded image [px]: a small file can claim more than the available memory. It exceeds the cameras
/// of robots; at 8 bytes a pixel it takes 0.8 GB.
constexpr std::uint64_t kMaxImagePixels = 100'000'000;

/// An image as the tracker takes it (CV_8UC1 or CV_8UC3, BGR), or the problem in one line.
struct DecodedImage {
  cv::Mat image;
  std::string problem;  // empty when there is an image
  /// CV_8UC1, 0 where the file is transparent (alpha 0), else 255; empty: nowhere, or all of it is.
  cv::Mat mask = cv::Mat();
};

/// True for the file names that are taken for images (by their extension).
bool has_image_extension(const std::string& path);

/// Reads an image file of at most kMaxImagePixels. The orientation tag is ignored, because a calibration
/// refers to the pixels as stored. levels: for 16 bits.
DecodedImage read_image(const std::string& path, const GreyLevels& levels = {});

/// As read_image, with all bits and channels of the file.
DecodedImage read_unchanged(const std::string& path);

/// As read_image, from the bytes of the file. The size is read from the header and checked against max_pixels
/// before decoding; formats with an unknown header are refused.
DecodedImage decode_image(const std::vector<unsigned char>& bytes, std::uint64_t max_pixels = kMaxImagePixels,
                          const GreyLevels& levels = {});

/// As decode_image, with all bits and channels.
DecodedImage decode_unchanged(const std::vector<unsigned char>& bytes,
                              std::uint64_t max_pixels = kMaxImagePixels);

/// Images of 16 bits between these levels, by default their upper 8 bits; what is transparent is in the mask.
DecodedImage to_8_bit(const cv::Mat& image, const GreyLevels& levels = {});

/// Of an image whose fourth channel is alpha: CV_8UC1, 0 where alpha is 0, else 255. Empty where it has no
/// alpha, or all of it is 0 (programs that draw nothing transparent fill in zeros), or none.
cv::Mat mask_of_alpha(const cv::Mat& image);

/// What an image says as a mask (CV_8UC1): 255 wherever any channel but transparency is not zero, which may
/// be the number of an object, however small and of however many bits. Where some of it is transparent, alpha
/// alone says: 0 = ignore.
cv::Mat mask_of_image(const cv::Mat& image);

/// Writes an image in the format of the path's extension, atomically: readers get the whole file or none.
/// False when the extension names no format or one that cannot hold the image. Throws std::runtime_error
/// naming the path and the reason when the file cannot be written.
bool write_image_as_named(const std::string& path, const cv::Mat& image);

/// Writes an image (8 bits a channel) in the format of the path's extension, and as PNG when the extension
/// names no format or one that cannot hold the image (readers detect the format by content). Otherwise as
/// write_image_as_named.
void write_image(const std::string& path, const cv::Mat& image);

}  // namespace mono_pose_tracker
