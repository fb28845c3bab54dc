#include "io/image_coding.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>
// Needs size_t and FILE.
#include <jerror.h>
#include <jpeglib.h>

#include "common/text.h"
#include "io/files.h"

namespace mono_pose_tracker {
namespace {

constexpr int kValues = 65536;

/// Histogram of the colours of an image, without alpha.
std::vector<std::int64_t> histogram(const cv::Mat& image) {
  std::vector<std::int64_t> counts(kValues, 0);
  const int channels = image.channels(), colours = std::min(channels, 3);
  for (int row = 0; row < image.rows; ++row) {
    const auto* pixel = image.ptr<std::uint16_t>(row);
    for (int column = 0; column < image.cols; ++column, pixel += channels) {
      for (int c = 0; c < colours; ++c) ++counts[pixel[c]];
    }
  }
  return counts;
}

/// The value below which this number of pixels lies.
int value_at(const std::vector<std::int64_t>& counts, std::int64_t below) {
  int value = 0;
  for (std::int64_t sum = counts[0]; sum <= below && value + 1 < kValues; sum += counts[++value]) {
  }
  return value;
}

}  // namespace

GreyLevelChoice::GreyLevelChoice(const std::string& setting, const GreyLevelOptions& options)
    : options_(options) {
  if (setting == "auto") return;
  const std::size_t colon = setting.find(':');
  int bits = 0;
  const bool are_levels = colon != std::string::npos &&
                          parse_decimal(setting.substr(0, colon), &levels_.black) &&
                          parse_decimal(setting.substr(colon + 1), &levels_.white) && levels_.black >= 0 &&
                          levels_.white > levels_.black && levels_.white <= kValues;
  if (!are_levels && (!parse_decimal(setting, &bits) || bits < 8 || bits > 16)) {
    throw std::invalid_argument(
        "is '" + setting +
        "': expected auto, a number of bits from 8 to 16, or BLACK:WHITE, such as 7000:9000");
  }
  if (!are_levels) levels_ = {0, std::pow(2.0, bits)};
  reason_ = "as configured";
  is_settled_ = true;
}

bool GreyLevelChoice::look_at(const cv::Mat& image) {
  if (is_settled_ || image.depth() != CV_16U || image.empty()) return false;
  const std::vector<std::int64_t> counts = histogram(image);
  const auto total = static_cast<std::int64_t>(image.total()) * std::min(image.channels(), 3);
  const auto tail = static_cast<std::int64_t>(options_.tail_share * static_cast<double>(total));
  const int brightest = value_at(counts, total - 1);
  if (brightest < options_.least_bright && ++dark_ <= options_.most_dark_images) return false;
  brightest_ = std::max<double>(brightest_, brightest);
  lowest_ = std::min<double>(lowest_, value_at(counts, tail));
  highest_ = std::max<double>(highest_, value_at(counts, total - 1 - tail));
  settle_by_range();
  is_settled_ = ++looked_at_ >= options_.first_images;
  return is_settled_;
}

void GreyLevelChoice::settle_by_range() {
  int bits = 8;
  while (bits < 16 && brightest_ >= std::pow(2.0, bits)) bits += 2;
  const double white = std::pow(2.0, bits), range = highest_ - lowest_;
  const bool is_narrow = range > 0 && range < options_.least_range * white;
  if (is_narrow) {
    levels_.black = std::max(0.0, std::floor(lowest_ - options_.margin * range));
    levels_.white = std::min<double>(kValues, std::ceil(highest_ + options_.margin * range));
    reason_ = formatted("the first images hold values from %.0f to %.0f", lowest_, highest_);
  } else {
    levels_ = {0, white};
    reason_ = formatted("the first images hold values up to %.0f, %d bits", brightest_, bits);
  }
}

std::string GreyLevelChoice::text() const {
  if (reason_.empty()) return "";
  return formatted("16-bit images: %.0f is mapped to black and %.0f to white (%s)", levels_.black,
                   levels_.white, reason_.c_str());
}

namespace {

enum class Order { kBig, kLittle };

// The first marker, and what begins the next: all that OpenCV takes for one.
constexpr std::string_view kJpeg = "\xff\xd8\xff";
constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n";

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
  if (bytes.has(0, kPng)) {
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
  if (!size && bytes.has(4, "ftyp"))
    return {0, 0, "is a HEIF image (HEIC, AVIF) or a video: convert it to images of png or jpg"};
  if (!size) return {0, 0, "cannot be decoded as an image (PNG, JPEG, TIFF, BMP, PNM, WebP, JPEG 2000)"};
  if (size->width == 0 || size->height == 0) {
    return {0, 0, "cannot be decoded as an image: its header has no image size"};
  }
  return {size->width, size->height, {}};
}

bool is_jpeg(const std::vector<unsigned char>& bytes) { return Bytes(bytes).has(0, kJpeg); }

bool has_end_of_jpeg(const std::vector<unsigned char>& bytes) { return walk_jpeg(Bytes(bytes)).complete; }

namespace {

struct ErrorManager {
  jpeg_error_mgr base = {};
  bool end_early = false;
  std::jmp_buf refused = {};
};

ErrorManager& manager_of(j_common_ptr decoder) { return *reinterpret_cast<ErrorManager*>(decoder->err); }

void note_warning(j_common_ptr decoder, int level) {
  if (level >= 0) return;
  const int code = decoder->err->msg_code;
  // A part that is damaged ends at the next restart, and what follows is good.
  const int marker = reinterpret_cast<j_decompress_ptr>(decoder)->unread_marker;
  if (code == JWRN_JPEG_EOF || (code == JWRN_HIT_MARKER && marker == JPEG_EOI)) {
    manager_of(decoder).end_early = true;
  }
}

void refuse(j_common_ptr decoder) { std::longjmp(manager_of(decoder).refused, 1); }

// Colours in OpenCV's order: of libjpeg-turbo only.
#ifdef JCS_EXTENSIONS
constexpr J_COLOR_SPACE kBgr = JCS_EXT_BGR;
#else
constexpr J_COLOR_SPACE kBgr = JCS_UNKNOWN;
#endif

// libjpeg leaves by longjmp: in what it may leave, from setjmp on, nothing has a destructor.
class Decoder {
 public:
  Decoder() {
    decoder_.err = jpeg_std_error(&errors_.base);
    errors_.base.emit_message = note_warning;
    errors_.base.error_exit = refuse;
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { jpeg_destroy_decompress(&decoder_); }

  // False, as of what follows, when libjpeg refuses.
  bool read_head(const std::vector<unsigned char>& bytes) {
    if (setjmp(errors_.refused) != 0) return false;
    jpeg_create_decompress(&decoder_);
    jpeg_mem_src(&decoder_, bytes.data(), static_cast<unsigned long>(bytes.size()));
    jpeg_read_header(&decoder_, TRUE);
    return true;
  }

  cv::Size size() const {
    return {static_cast<int>(decoder_.image_width), static_cast<int>(decoder_.image_height)};
  }
  int channels() const { return decoder_.num_components; }
  // Whether the pixels come as OpenCV has them.
  bool is_for_opencv() const { return channels() == 1 || (channels() == 3 && kBgr != JCS_UNKNOWN); }

  bool read_pixels(cv::Mat* image) {
    if (setjmp(errors_.refused) != 0) return false;
    if (is_for_opencv()) decoder_.out_color_space = channels() == 1 ? JCS_GRAYSCALE : kBgr;
    jpeg_start_decompress(&decoder_);
    while (decoder_.output_scanline < decoder_.output_height) {
      JSAMPROW row = image->ptr(static_cast<int>(decoder_.output_scanline));
      jpeg_read_scanlines(&decoder_, &row, 1);
    }
    jpeg_finish_decompress(&decoder_);
    return true;
  }

  bool end_early() const { return errors_.end_early; }

 private:
  ErrorManager errors_;
  jpeg_decompress_struct decoder_ = {};
};

}  // namespace

JpegData read_jpeg_data(const std::vector<unsigned char>& bytes) {
  JpegData data;
  Decoder decoder;
  if (!decoder.read_head(bytes)) return data;
  data.image.create(decoder.size(), CV_8UC(decoder.channels()));
  if (!decoder.read_pixels(&data.image) || !decoder.is_for_opencv()) data.image.release();
  data.end_early = decoder.end_early();
  return data;
}

namespace {

// No image that may be decoded has a larger file: 100 megapixels of 8 bytes, not compressed.
constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{1} << 30;

std::string problem_of_size(const std::vector<unsigned char>& bytes, std::uint64_t max_pixels) {
  const ImageHeader header = read_image_header(bytes);
  if (!header.problem.empty()) return header.problem;
  if (header.height <= max_pixels / header.width) return "";
  return "is " + std::to_string(header.width) + " x " + std::to_string(header.height) +
         ": expected at most " + std::to_string(max_pixels) + " pixels";
}

/// Whether a PNG ends before its last chunk does. libpng prints lines of its own for each of these.
bool is_cut_png(const Bytes& bytes) {
  constexpr std::uint64_t kLengthKindAndCrc = 12;
  if (!bytes.has(0, kPng)) return false;
  for (std::uint64_t at = kPng.size(); at < bytes.size();) {
    const std::uint64_t end = at + kLengthKindAndCrc + bytes.number(at, 4, Order::kBig);
    if (end <= bytes.size() && bytes.has(at + 4, "IEND")) return false;
    at = end;
  }
  return true;
}

// libjpeg fills what a file lacks with grey and calls that a success, and OpenCV takes it.
DecodedImage decode_jpeg(const std::vector<unsigned char>& bytes) {
  JpegData data;
  data.end_early = !has_end_of_jpeg(bytes);
  if (!data.end_early) data = read_jpeg_data(bytes);
  if (data.end_early) return {{}, "is a JPEG that ends too early"};
  return {data.image, {}};
}

// Error of reading the file; nothing if it was read.
std::string read_bytes(const std::string& path, std::vector<unsigned char>* bytes) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return "is a folder";
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error)) {
    return "is not a regular file";  // a device could be read for ever
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > kMaxFileBytes) {
    return "has " + std::to_string(size) + " bytes: expected at most " + std::to_string(kMaxFileBytes);
  }
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return "cannot be read (" + system_error_text() + ")";
  if (!error) bytes->reserve(size);
  return read_whole(stream, kMaxFileBytes, bytes) ? "" : "has too many bytes";
}

DecodedImage read_with(const std::function<DecodedImage(const std::vector<unsigned char>&)>& decode,
                       const std::string& path) {
  std::vector<unsigned char> bytes;
  DecodedImage decoded;
  decoded.problem = read_bytes(path, &bytes);
  if (decoded.problem.empty()) decoded = decode(bytes);
  if (!decoded.problem.empty()) decoded.problem = path + ": " + decoded.problem;
  return decoded;
}

}  // namespace

bool has_image_extension(const std::string& path) {
  const std::string extension = lower_case(std::filesystem::path(path).extension().string());
  static const char* const kExtensions[] = {".png", ".jpg", ".jpeg", ".bmp", ".tif",  ".tiff",
                                            ".pgm", ".ppm", ".pnm",  ".pbm", ".webp", ".jp2"};
  return std::find(std::begin(kExtensions), std::end(kExtensions), extension) != std::end(kExtensions);
}

cv::Mat mask_of_alpha(const cv::Mat& image) {
  if (image.channels() != 4) return {};
  cv::Mat alpha;
  cv::extractChannel(image, alpha, 3);
  const int seen = cv::countNonZero(alpha);
  return seen == 0 || seen == static_cast<int>(alpha.total()) ? cv::Mat() : cv::Mat(alpha != 0);
}

DecodedImage to_8_bit(const cv::Mat& image, const GreyLevels& levels) {
  cv::Mat result = image;
  if (image.depth() == CV_16U) {
    const double factor = 256 / (levels.white - levels.black);
    image.convertTo(result, CV_8U, factor, -levels.black * factor);
  } else if (image.depth() != CV_8U) {
    return {{}, "holds " + cv::typeToString(image.type()) + " pixels: expected 8 or 16 bits per channel"};
  }
  if (result.channels() == 4) {
    cv::cvtColor(result, result, cv::COLOR_BGRA2BGR);
  } else if (result.channels() != 1 && result.channels() != 3) {
    return {{}, "has " + std::to_string(result.channels()) + " channels: expected 1, 3 or 4"};
  }
  return {result, {}, mask_of_alpha(image)};
}

DecodedImage decode_unchanged(const std::vector<unsigned char>& bytes, std::uint64_t max_pixels) {
  const std::string problem = problem_of_size(bytes, max_pixels);
  if (!problem.empty()) return {{}, problem};
  if (is_cut_png(Bytes(bytes))) return {{}, "is a PNG that ends too early"};
  DecodedImage decoded;
  try {
    if (is_jpeg(bytes)) decoded = decode_jpeg(bytes);
    if (!decoded.problem.empty() || !decoded.image.empty()) return decoded;
    decoded.image =
        cv::imdecode(bytes, cv::IMREAD_UNCHANGED);  // unchanged: orientation tags are ignored as well
  } catch (const std::exception&) {
    // What the decoder can't make sense of, or finds no memory for, is no image either.
  }
  if (decoded.image.empty()) return {{}, "cannot be decoded as an image"};
  return decoded;
}

DecodedImage decode_image(const std::vector<unsigned char>& bytes, std::uint64_t max_pixels,
                          const GreyLevels& levels) {
  DecodedImage decoded = decode_unchanged(bytes, max_pixels);
  if (!decoded.problem.empty()) return decoded;
  try {
    return to_8_bit(decoded.image, levels);
  } catch (const std::exception&) {
    return {{}, "needs more memory than is available"};
  }
}

DecodedImage read_unchanged(const std::string& path) {
  return read_with([](const auto& bytes) { return decode_unchanged(bytes); }, path);
}

DecodedImage read_image(const std::string& path, const GreyLevels& levels) {
  return read_with([&](const auto& bytes) { return decode_image(bytes, kMaxImagePixels, levels); }, path);
}

cv::Mat mask_of_image(const cv::Mat& image) {
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  // A cut-out has the object's colours, black ones among them, and what is cut out in its alpha.
  if (channels.size() == 4) {
    double least = 0, most = 0;
    cv::minMaxIdx(channels[3], &least, &most);
    if (least < most) return channels[3] != 0;
  }
  cv::Mat mask = channels[0] != 0;
  for (std::size_t i = 1; i < std::min<std::size_t>(channels.size(), 3); ++i) mask |= channels[i] != 0;
  return mask;
}

namespace {

bool encode(const std::string& extension, const cv::Mat& image, std::vector<unsigned char>* bytes) {
  try {
    return cv::imencode(extension, image, *bytes) && !bytes->empty();
  } catch (const cv::Exception&) {  // the format is not for such an image
    return false;
  }
}

// OpenCV makes something else of grey levels in a bitmap, and some of its versions of colours in a graymap.
bool can_hold(const std::string& extension_as_given, const cv::Mat& image) {
  const std::string extension = lower_case(extension_as_given);
  return extension != ".pbm" && (extension != ".pgm" || image.channels() == 1);
}

// Not by cv::imwrite: it says nothing of a disk that is full.
bool write_as(const std::string& extension, const std::string& path, const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  if (!can_hold(extension, image) || !encode(extension, image, &bytes)) return false;
  write_file_atomically(path, [&](std::ostream& out) {
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  });
  return true;
}

}  // namespace

bool write_image_as_named(const std::string& path, const cv::Mat& image) {
  const std::string extension = std::filesystem::path(path).extension().string();
  return !extension.empty() && write_as(extension, path, image);
}

void write_image(const std::string& path, const cv::Mat& image) {
  if (!write_image_as_named(path, image) && !write_as(".png", path, image)) {
    throw std::runtime_error(path + ": cannot be written (the image cannot be encoded)");
  }
}

}  // namespace mono_pose_tracker
