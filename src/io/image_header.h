#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace mono_pose_tracker {

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

}  // namespace mono_pose_tracker
