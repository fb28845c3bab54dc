#include "io/image_header.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>

namespace mono_pose_tracker {
namespace {

enum class Order { kBig, kLittle };

// The first marker, and what begins the next: all that OpenCV takes for one.
constexpr std::string_view kJpeg = "\xff\xd8\xff";

/// The bytes of a file; what lies beyond its end reads as zero, and a size of zero is none.
class Bytes {
 public:
  explicit Bytes(const std::vector<unsigned char>& bytes) : bytes_(bytes) {}

  std::uint64_t size() const { return bytes_.size(); }

  std::uint64_t number(std::uint64_t at, int count, Order order) const {
    if (at > size() || size() - at < static_cast<std::uint64_t>(count)) return 0;
    std::uint64_t value = 0;
    for (int i = 0; i < count; ++i) {
      value = 256 * value + bytes_[at + (order == Order::kBig ? i : count - 1 - i)];
    }
    return value;
  }

  bool has(std::uint64_t at, std::string_view text) const {
    return at <= size() && size() - at >= text.size() &&
           std::memcmp(bytes_.data() + at, text.data(), text.size()) == 0;
  }

  /// The first 0xff from here on; size() when there is none.
  std::uint64_t next_ff(std::uint64_t at) const {
    if (at >= size()) return size();
    const void* found = std::memchr(bytes_.data() + at, 0xff, size() - at);
    return found ? static_cast<std::uint64_t>(static_cast<const unsigned char*>(found) - bytes_.data())
                 : size();
  }

 private:
  const std::vector<unsigned char>& bytes_;
};

struct Size {
  std::uint64_t width = 0, height = 0;
};

struct Jpeg {
  Size size;
  bool complete = false;
};

/// ITU T.81, annex B: markers, most with a segment of a stated length; after a start of scan the coded data,
/// in which 0xff is followed by 0 or by the number of a restart.
Jpeg walk_jpeg(const Bytes& bytes) {
  Jpeg jpeg;
  bool has_scan = false;
  for (std::uint64_t at = bytes.next_ff(2); at < bytes.size(); at = bytes.next_ff(at)) {
    while (bytes.number(at, 1, Order::kBig) == 0xff) ++at;  // fill bytes
    const std::uint64_t marker = bytes.number(at++, 1, Order::kBig);
    const bool has_length = marker > 0x01 && !(marker >= 0xd0 && marker <= 0xd9);
    if (marker == 0xd9 && has_scan) {
      jpeg.complete = at <= bytes.size();
      return jpeg;
    }
    if (!has_length) continue;
    const bool is_frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (is_frame && jpeg.size.width == 0) {
      jpeg.size = {bytes.number(at + 5, 2, Order::kBig), bytes.number(at + 3, 2, Order::kBig)};
    }
    const std::uint64_t length = bytes.number(at, 2, Order::kBig);
    if (length < 2) return jpeg;
    at += length;
    has_scan |= marker == 0xda;
  }
  return jpeg;
}

Size bmp_size(const Bytes& bytes) {
  if (bytes.number(14, 4, Order::kLittle) == 12) {
    return {bytes.number(18, 2, Order::kLittle), bytes.number(20, 2, Order::kLittle)};
  }
  const auto height = static_cast<std::int32_t>(bytes.number(22, 4, Order::kLittle));
  // Negative: from top to bottom.
  return {bytes.number(18, 4, Order::kLittle),
          static_cast<std::uint64_t>(std::abs(static_cast<std::int64_t>(height)))};
}

/// A number of a PNM head, after white space and # comments; 0 when there is none.
std::uint64_t pnm_number(const Bytes& bytes, std::uint64_t* at) {
  const auto byte = [&] { return static_cast<int>(bytes.number(*at, 1, Order::kBig)); };
  while (*at < bytes.size() && !std::isdigit(byte())) {
    if (byte() == '#') {
      while (*at < bytes.size() && byte() != '\n' && byte() != '\r') ++*at;
    } else if (!std::isspace(byte())) {
      return 0;
    }
    ++*at;
  }
  std::uint64_t value = 0;
  for (; *at < bytes.size() && std::isdigit(byte()); ++*at) {
    value = 10 * value + static_cast<std::uint64_t>(byte() - '0');
    if (value > std::numeric_limits<std::int32_t>::max()) return value;  // no decoder takes more
  }
  return value;
}

Size pnm_size(const Bytes& bytes) {
  std::uint64_t at = 2;
  const std::uint64_t width = pnm_number(bytes, &at);
  return {width, pnm_number(bytes, &at)};
}

/// TIFF 6.0, and BigTIFF, whose counts and offsets are of 8 bytes: the first image's width and height.
Size tiff_size(const Bytes& bytes, Order order) {
  const bool big = bytes.number(2, 2, order) == 43;
  const std::uint64_t directory = big ? bytes.number(8, 8, order) : bytes.number(4, 4, order);
  const std::uint64_t entries = bytes.number(directory, big ? 8 : 2, order);
  const std::uint64_t entry_size = big ? 20 : 12;
  Size size;
  for (std::uint64_t i = 0; i < std::min(entries, bytes.size() / entry_size); ++i) {
    const std::uint64_t at = directory + (big ? 8 : 2) + i * entry_size;
    const std::uint64_t tag = bytes.number(at, 2, order), type = bytes.number(at + 2, 2, order);
    if (tag != 256 && tag != 257) continue;
    constexpr std::uint64_t kShort = 3, kLong8 = 16;
    const int count = type == kShort ? 2 : type == kLong8 ? 8 : 4;
    std::uint64_t* value = tag == 256 ? &size.width : &size.height;
    *value = std::max(*value, bytes.number(at + (big ? 12 : 8), count, order));
  }
  return size;
}

Size webp_size(const Bytes& bytes) {
  constexpr std::uint64_t kChunk = 20;  // where the payload of the first chunk begins
  if (bytes.has(12, "VP8X")) {
    return {bytes.number(kChunk + 4, 3, Order::kLittle) + 1, bytes.number(kChunk + 7, 3, Order::kLittle) + 1};
  }
  if (bytes.has(12, "VP8L")) {
    const std::uint64_t bits = bytes.number(kChunk + 1, 4, Order::kLittle);
    return {(bits & 0x3fff) + 1, ((bits >> 14) & 0x3fff) + 1};
  }
  if (!bytes.has(12, "VP8 ")) return {};
  return {bytes.number(kChunk + 6, 2, Order::kLittle) & 0x3fff,
          bytes.number(kChunk + 8, 2, Order::kLittle) & 0x3fff};
}

/// The size of a JPEG 2000 codestream (its marker SIZ), which begins here.
Size codestream_size(const Bytes& bytes, std::uint64_t at) {
  if (!bytes.has(at, std::string_view("\xff\x4f\xff\x51", 4))) return {};
  const auto number = [&](std::uint64_t offset) { return bytes.number(at + offset, 4, Order::kBig); };
  const std::uint64_t right = number(8), bottom = number(12), left = number(16), top = number(20);
  if (right <= left || bottom <= top) return {};
  return {right - left, bottom - top};
}

/// A JP2 file is a row of boxes; the size in its head is not what the decoder goes by.
Size jp2_size(const Bytes& bytes) {
  for (std::uint64_t at = 0; at < bytes.size();) {
    std::uint64_t length = bytes.number(at, 4, Order::kBig), head = 8;
    if (length == 1) length = bytes.number(at + 8, 8, Order::kBig), head = 16;
    if (bytes.has(at + 4, "jp2c")) return codestream_size(bytes, at + head);
    if (length < head || length > bytes.size() - at) return {};
    at += length;
  }
  return {};
}

/// Nothing for a format that is not known.
std::optional<Size> size_in_head(const Bytes& bytes) {
  if (bytes.has(0, std::string_view("\x89PNG\r\n\x1a\n", 8))) {
    return Size{bytes.number(16, 4, Order::kBig), bytes.number(20, 4, Order::kBig)};
  }
  if (bytes.has(0, kJpeg)) return walk_jpeg(bytes).size;
  if (bytes.has(0, "BM")) return bmp_size(bytes);
  if (bytes.has(0, std::string_view("II*\0", 4)) || bytes.has(0, std::string_view("II+\0", 4))) {
    return tiff_size(bytes, Order::kLittle);
  }
  if (bytes.has(0, std::string_view("MM\0*", 4)) || bytes.has(0, std::string_view("MM\0+", 4))) {
    return tiff_size(bytes, Order::kBig);
  }
  if (bytes.has(0, "RIFF") && bytes.has(8, "WEBP")) return webp_size(bytes);
  if (bytes.has(0, std::string_view("\0\0\0\fjP  \r\n\x87\n", 12))) return jp2_size(bytes);
  if (bytes.has(0, "\xff\x4f")) return codestream_size(bytes, 0);
  for (const char* kind : {"P1", "P2", "P3", "P4", "P5", "P6"}) {
    if (bytes.has(0, kind) && std::isspace(static_cast<int>(bytes.number(2, 1, Order::kBig)))) {
      return pnm_size(bytes);
    }
  }
  return std::nullopt;
}

// Whatever else a file begins with, OpenCV may take it for this one, whose library ends the process where it
// is damaged.
bool is_dicom(const Bytes& bytes) { return bytes.has(128, "DICM"); }

}  // namespace

ImageHeader read_image_header(const std::vector<unsigned char>& content) {
  if (content.empty()) return {0, 0, "is empty"};
  const Bytes bytes(content);
  const std::optional<Size> size = is_dicom(bytes) ? std::nullopt : size_in_head(bytes);
  if (!size) return {0, 0, "cannot be decoded as an image (PNG, JPEG, TIFF, BMP, PNM, WebP, JPEG 2000)"};
  if (size->width == 0 || size->height == 0) {
    return {0, 0, "cannot be decoded as an image: its header has no image size"};
  }
  return {size->width, size->height, {}};
}

bool is_jpeg(const std::vector<unsigned char>& bytes) { return Bytes(bytes).has(0, kJpeg); }

bool has_end_of_jpeg(const std::vector<unsigned char>& bytes) { return walk_jpeg(Bytes(bytes)).complete; }

}  // namespace mono_pose_tracker
