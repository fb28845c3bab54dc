#include "video.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <opencv2/videoio.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/pixel_hash.h"
#include "common/text.h"
#include "common/toolchain.h"
#include "image_coding.h"
#include "io/image_source.h"

namespace mono_pose_tracker {
namespace {

using Bytes = std::vector<unsigned char>;

/// Reads a parameter set bit by bit. Zeros follow its end.
class BitReader {
 public:
  /// At most 1024 bytes, as the size stands among the first ones, without the bytes that keep start codes out
  /// of the content (00 00 03 stands for 00 00).
  BitReader(Bytes::const_iterator begin, Bytes::const_iterator end) {
    int zeros = 0;
    for (auto byte = begin; byte != end && bytes_.size() < 1024; ++byte) {
      const bool is_extra = zeros >= 2 && *byte == 3;
      if (!is_extra) bytes_.push_back(*byte);
      zeros = *byte == 0 ? zeros + 1 : 0;
    }
  }

  unsigned bits(int number) {
    unsigned value = 0;
    for (int i = 0; i < number; ++i, ++at_) {
      const std::size_t byte = at_ / 8;
      value = value << 1 | (byte < bytes_.size() ? bytes_[byte] >> (7 - at_ % 8) & 1u : 0u);
    }
    return value;
  }
  void skip(int number) { at_ += static_cast<std::size_t>(number); }
  bool flag() { return bits(1) != 0; }

  /// Exponential-Golomb code; 0 for codes that are longer than any here.
  unsigned ue() {
    int zeros = 0;
    while (zeros < 32 && !is_past_end() && !flag()) ++zeros;
    return zeros < 24 ? (1u << zeros) - 1 + bits(zeros) : 0;
  }
  int se() {
    const int code = static_cast<int>(ue());
    return code % 2 ? (code + 1) / 2 : -code / 2;
  }
  bool is_past_end() const { return at_ >= 8 * bytes_.size(); }

 private:
  Bytes bytes_;
  std::size_t at_ = 0;  // [bits]
};

struct Crop {
  unsigned left = 0, right = 0, top = 0, bottom = 0;
};

Crop read_crop(BitReader* in) {
  Crop crop;
  if (!in->flag()) return crop;
  for (unsigned* side : {&crop.left, &crop.right, &crop.top, &crop.bottom}) *side = in->ue();
  return crop;
}

cv::Size cropped(unsigned width, unsigned height, const Crop& crop, unsigned unit_x, unsigned unit_y) {
  const unsigned x = unit_x * (crop.left + crop.right), y = unit_y * (crop.top + crop.bottom);
  // No camera has more pixels along a side.
  if (std::max(width, height) > 1u << 16 || x >= width || y >= height) return {};
  return {static_cast<int>(width - x), static_cast<int>(height - y)};
}

void skip_scaling_list(BitReader* in, int size) {
  int last = 8, next = 8;
  for (int i = 0; i < size; ++i) {
    if (next != 0) next = (last + in->se() + 256) % 256;
    if (next != 0) last = next;
  }
}

/// Chroma format and what follows of the high profiles; 4:2:0 for the others.
unsigned read_h264_chroma(BitReader* in, unsigned profile) {
  constexpr std::array<unsigned, 13> kHigh = {100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135};
  if (std::find(kHigh.begin(), kHigh.end(), profile) == kHigh.end()) return 1;
  const unsigned chroma = in->ue();
  if (chroma == 3) in->skip(1);
  in->ue();  // bit depths
  in->ue();
  in->skip(1);
  if (in->flag()) {
    for (int i = 0; i < (chroma == 3 ? 12 : 8); ++i) {
      if (in->flag()) skip_scaling_list(in, i < 6 ? 16 : 64);
    }
  }
  return chroma;
}

cv::Size h264_size(BitReader in) {
  const unsigned profile = in.bits(8);
  in.skip(16);  // constraints, level
  in.ue();
  const unsigned chroma = read_h264_chroma(&in, profile);
  in.ue();
  const unsigned order_type = in.ue();
  if (order_type == 0) in.ue();
  if (order_type == 1) {
    in.skip(1);
    in.se();
    in.se();
    for (unsigned i = in.ue(); i > 0 && !in.is_past_end(); --i) in.se();
  }
  in.ue();
  in.skip(1);
  const unsigned blocks_x = in.ue() + 1, blocks_y = in.ue() + 1;
  const bool has_frames_only = in.flag();
  const unsigned fields = has_frames_only ? 1 : 2;
  if (!has_frames_only) in.skip(1);
  in.skip(1);
  const Crop crop = read_crop(&in);
  if (in.is_past_end()) return {};
  return cropped(16 * blocks_x, 16 * fields * blocks_y, crop, chroma == 1 || chroma == 2 ? 2 : 1,
                 (chroma == 1 ? 2 : 1) * fields);
}

cv::Size h265_size(BitReader in) {
  in.skip(4);
  const unsigned sublayers = in.bits(3);  // after the first
  in.skip(1 + 96);                        // nesting, general profile and level
  std::array<unsigned, 8> bits_of_layer{};
  for (unsigned i = 0; i < sublayers; ++i) {
    const bool has_profile = in.flag(), has_level = in.flag();
    bits_of_layer[i] = (has_profile ? 88 : 0) + (has_level ? 8 : 0);
  }
  if (sublayers > 0) in.skip(2 * (8 - static_cast<int>(sublayers)));
  for (const unsigned bits : bits_of_layer) in.skip(static_cast<int>(bits));
  in.ue();
  const unsigned chroma = in.ue();
  if (chroma == 3) in.skip(1);
  const unsigned width = in.ue(), height = in.ue();
  const Crop crop = read_crop(&in);
  if (in.is_past_end()) return {};
  return cropped(width, height, crop, chroma == 1 || chroma == 2 ? 2 : 1, chroma == 1 ? 2 : 1);
}

}  // namespace

cv::Size coded_size(const std::vector<unsigned char>& packet) {
  if (is_jpeg(packet)) {
    const ImageHeader header = read_image_header(packet);
    return {static_cast<int>(header.width), static_cast<int>(header.height)};
  }
  constexpr std::array<unsigned char, 3> kStart = {0, 0, 1};
  auto unit = std::search(packet.begin(), packet.end(), kStart.begin(), kStart.end());
  while (packet.end() - unit > 5) {
    unit += 3;
    const auto end = std::search(unit, packet.end(), kStart.begin(), kStart.end());
    constexpr unsigned kH264Set = 7, kH265Set = 0x42;
    // H.265's types are even numbers here, and none of H.264's units begins with its set's.
    if ((*unit & 0x9f) == kH264Set) return h264_size({unit + 1, end});
    if (unit[0] == kH265Set && unit[1] == 1) return h265_size({unit + 2, end});
    unit = end;
  }
  return {};
}

CodedSizes::CodedSizes(const std::string& path) {
#if MONO_POSE_TRACKER_OPENCV_SINCE(4, 5)
  const QuietOpenCv quiet;
  if (packets_.open(path, cv::CAP_FFMPEG) && !packets_.set(cv::CAP_PROP_FORMAT, -1)) packets_.release();
#else
  static_cast<void>(path);
#endif
}

bool CodedSizes::change_by(std::int64_t index) {
  cv::Mat packet;
  while (change_.empty() && count_ <= index + frames_ahead() && packets_.isOpened() &&
         packets_.read(packet)) {
    const auto* const data = packet.ptr<unsigned char>();
    const cv::Size size = coded_size({data, data + packet.total() * packet.elemSize()});
    if (first_.empty()) first_ = size;
    if (!size.empty() && size != first_) {
      change_ = formatted(
          "the image size changes from %dx%d to %dx%d at frame %lld: only the first %lld frames are used. "
          "Split "
          "the video where its size changes",
          first_.width, first_.height, size.width, size.height, static_cast<long long>(count_),
          static_cast<long long>(std::max<std::int64_t>(0, count_ - frames_ahead())));
    }
    ++count_;
  }
  return !change_.empty();
}

std::int64_t CodedSizes::frames_ahead() {
  return 16 + cv::getNumberOfCPUs();  // H.264 and H.265 reorder at most 16 frames
}

std::int64_t FrameStamps::next(double container_ms) {
  const auto frame_ns = static_cast<std::int64_t>(std::llround(static_cast<double>(index_++) * 1e9 / fps_));
  const bool has_time = container_ms > 0 && container_ms < 1e12;  // thirty years
  if (has_time && !is_variable_) {
    is_variable_ = std::abs(container_ms * 1e-3 - static_cast<double>(frame_ns) * 1e-9) > 0.5 / fps_;
  }
  std::int64_t stamp_ns = frame_ns;
  if (is_variable_) stamp_ns = has_time ? static_cast<std::int64_t>(std::llround(container_ms * 1e6)) : -1;
  if (stamp_ns <= last_ns_) {
    ++out_of_order_;
    stamp_ns = last_ns_ + interval_ns_;
  } else if (is_variable_ && last_ns_ >= 0) {
    interval_ns_ = stamp_ns - last_ns_;
  }
  last_ns_ = stamp_ns;
  return stamp_ns;
}

namespace {

struct Box {
  std::string type;
  std::uint64_t begin = 0, end = 0;  // of its content
};

std::uint64_t big_endian(std::istream& in, int bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < bytes; ++i) value = value << 8 | static_cast<std::uint64_t>(in.get() & 0xff);
  return value;
}

/// The box that begins at an offset; without a type where there is none that ends by `limit`.
Box box_at(std::istream& in, std::uint64_t offset, std::uint64_t limit) {
  constexpr std::uint64_t kHead = 8, kLongHead = 16;
  if (offset + kHead > limit) return {};
  in.clear();
  in.seekg(static_cast<std::streamoff>(offset));
  std::uint64_t size = big_endian(in, 4), head = kHead;
  std::string type(4, '\0');
  in.read(type.data(), 4);
  if (size == 1 && offset + kLongHead <= limit) size = big_endian(in, 8), head = kLongHead;
  if (size == 0) size = limit - offset;  // up to the end
  if (!in || size < head || size > limit - offset) return {};
  return {type, offset + head, offset + size};
}

bool may_hold_edit_list(const std::string& type) {
  return type == "moov" || type == "trak" || type == "edts";
}

/// Looks for an edit list among boxes and in them, four levels deep. Every box of theirs must end within its
/// parent.
bool find_edit_list(std::istream& in, std::uint64_t begin, std::uint64_t end, int depth, bool* is_whole) {
  bool found = false;
  for (std::uint64_t at = begin; at < end;) {
    const Box box = box_at(in, at, end);
    if (box.type.empty()) {
      *is_whole = false;
      return found;
    }
    found |= box.type == "elst";
    if (depth < 4 && may_hold_edit_list(box.type))
      found |= find_edit_list(in, box.begin, box.end, depth + 1, is_whole);
    at = box.end;
  }
  return found;
}

}  // namespace

bool is_trimmed_mp4(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in || box_at(in, 0, size).type != "ftyp") return false;
  bool is_whole = true;
  return find_edit_list(in, 0, size, 0, &is_whole) && is_whole;
}

bool lacks_mp4_index(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) return false;
  Box box = box_at(in, 0, size);
  if (box.type != "ftyp") return false;
  while (!box.type.empty()) {
    if (box.type == "moov") return false;
    box = box_at(in, box.end, size);
  }
  return true;
}

namespace {

class VideoFile : public ImageSource {
 public:
  VideoFile(const std::string& path, std::int64_t key_frame_distance)
      : key_frame_distance_(key_frame_distance), path_(path) {
    std::error_code ignored;
    if (path.find("://") != std::string::npos || std::filesystem::is_character_file(path, ignored)) {
      throw std::runtime_error(
          path +
          ": is a stream or device, but a recording is read more than once: expected a video file (ffmpeg -i "
          "INPUT -c copy FILE records one). For live tracking use camera.launch device:=" +
          path);
    }
    if (!std::filesystem::is_regular_file(path, ignored)) {
      throw std::runtime_error(path + ": does not exist or is not a regular file: expected a video");
    }
    if (!open_as_recorded(path, &capture_)) throw std::runtime_error(path + ": " + cause_of_no_video(path));
    frames_per_second_ = capture_.get(cv::CAP_PROP_FPS);
    // Below one frame in a quarter of an hour it is no rate, and stamps would overflow one day.
    if (!(frames_per_second_ > 0.001) || !std::isfinite(frames_per_second_)) {
      throw std::runtime_error(path +
                               ": has no frame rate: expected a video with a frame rate in its header");
    }
    stamps_.emplace(frames_per_second_);
    sizes_.emplace(path);
  }

  SourceImage next() override {
    const cv::Mat frame = frame_of_index();
    if (frame.empty()) return end();
    SourceImage result;
    std::ostringstream name;
    name << std::setw(6) << std::setfill('0') << index_;
    result.mask_name = name.str();
    result.name = result.mask_name + ".png";
    result.stamp_ns = known_[static_cast<std::size_t>(index_++)].stamp_ns;
    // A copy: the capture reuses its buffer for the next frame.
    DecodedImage decoded = to_8_bit(frame.clone());
    result.image = decoded.image;
    result.kind = decoded.problem.empty() ? SourceImage::Kind::kImage : SourceImage::Kind::kSkipped;
    if (!decoded.problem.empty()) {
      result.problem = path_ + ": frame " + result.mask_name + " " + decoded.problem;
    }
    return result;
  }

  bool skip() override {
    if (!is_known() && frame_of_index().empty()) return false;
    ++index_;
    return true;
  }

  bool rewind() override {
    index_ = 0;
    return true;
  }

  double pixel_aspect() const override {
#if MONO_POSE_TRACKER_OPENCV_SINCE(4, 2)
    const double wide = capture_.get(cv::CAP_PROP_SAR_NUM), high = capture_.get(cv::CAP_PROP_SAR_DEN);
    if (wide > 0 && high > 0 && std::isfinite(wide / high)) return wide / high;
#endif
    return 1;
  }

  int size() const override {
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    return count > 0 && count < 1e9 ? static_cast<int>(count) : -1;  // streams give nonsense or nothing
  }

 private:
  /// A frame that was decoded before. Its content identifies it after a seek, as its time does not: OpenCV
  /// computes that from the frame rate.
  struct KnownFrame {
    std::int64_t stamp_ns = 0;
    std::size_t hash = 0;  // of the pixels
  };

  bool is_known() const { return index_ < static_cast<std::int64_t>(known_.size()); }

  /// The frame with index_, always with the same pixels; empty at the end. Shares the capture's memory.
  cv::Mat frame_of_index() {
    if (!is_known()) {
      if (is_whole_) return {};
      if (has_sought_) open_again();  // times and pixels after a seek are not certain
      const bool is_there = !sizes_->change_by(index_) && go_to_index();
      const cv::Mat frame = is_there ? decode() : cv::Mat();
      is_whole_ = frame.empty();
      if (!is_whole_)
        known_.push_back({stamps_->next(capture_.get(cv::CAP_PROP_POS_MSEC)), pixel_hash(frame)});
      return frame;
    }
    const cv::Mat frame = go_to_index() ? decode() : cv::Mat();
    if (!frame.empty() && pixel_hash(frame) == known_[static_cast<std::size_t>(index_)].hash) return frame;
    is_seekable_ = false;
    open_again();
    return go_to_index() ? decode() : cv::Mat();
  }

  cv::Mat decode() {
    cv::Mat frame;
    if (!capture_.read(frame)) return {};
    ++position_;
    return frame;
  }

  bool go_to_index() {
    if (index_ < position_ || (is_known() && index_ - position_ > key_frame_distance_)) seek();
    for (; position_ < index_; ++position_) {
      if (!capture_.grab()) return false;
    }
    return true;
  }

  /// Places the capture at index_ or shortly before it, by a key frame. OpenCV seeks to a time, in units of
  /// the mean frame rate, and not exactly in all containers: the frame that is found is looked up among the
  /// known ones.
  void seek() {
    const std::int64_t most = 8 * key_frame_distance_;
    for (std::int64_t before = 1; is_seekable_ && before < std::min(index_, most); before *= 4) {
      const std::int64_t stamp_ns = known_[static_cast<std::size_t>(index_ - before)].stamp_ns;
      const double number = std::round(1e-9 * static_cast<double>(stamp_ns) * frames_per_second_);
      if (!capture_.set(cv::CAP_PROP_POS_FRAMES, number)) break;
      const cv::Mat frame = decode();
      const std::int64_t found = frame.empty() ? -1 : last_before_index(pixel_hash(frame));
      if (found < 0) continue;
      position_ = found + 1;
      has_sought_ = true;
      return;
    }
    open_again();
  }

  /// The last known frame before index_ with these pixels, within reach of a seek; -1: none.
  std::int64_t last_before_index(std::size_t hash) const {
    const std::int64_t first = std::max<std::int64_t>(0, index_ - 16 * key_frame_distance_);
    for (std::int64_t i = index_ - 1; i >= first; --i) {
      if (known_[static_cast<std::size_t>(i)].hash == hash) return i;
    }
    return -1;
  }

  void open_again() {
    position_ = 0;
    has_sought_ = false;
    if (!open_as_recorded(path_, &capture_)) throw std::runtime_error(path_ + ": can no longer be opened");
  }

  /// Once before the end, what is missing.
  SourceImage end() {
    std::string problem = sizes_->change();
    if (problem.empty() && !is_trimmed_mp4(path_)) problem = problem_of_end(index_, size());
    if (stamps_->out_of_order() > 0) {
      problem += (problem.empty() ? "" : "; ") + std::to_string(stamps_->out_of_order()) +
                 " frames have container time stamps that do not increase: their stamps continue with the "
                 "interval of the frames before";
    }
    SourceImage result;
    if (std::exchange(is_end_told_, true) || problem.empty()) return result;
    result.kind = SourceImage::Kind::kSkipped;
    result.problem = path_ + ": " + problem;
    return result;
  }

  const std::int64_t key_frame_distance_;
  std::string path_;
  cv::VideoCapture capture_;
  double frames_per_second_ = 0;
  std::optional<FrameStamps> stamps_;
  std::optional<CodedSizes> sizes_;
  std::vector<KnownFrame> known_;  // by index
  bool is_whole_ = false;          // the last known frame is the last of the video
  std::int64_t index_ = 0;         // of the next frame to be given out
  std::int64_t position_ = 0;      // of the next frame that the capture decodes
  bool is_seekable_ = true;
  bool has_sought_ = false;  // since it was opened
  bool is_end_told_ = false;
};

}  // namespace

bool open_as_recorded(const std::string& path, cv::VideoCapture* capture) {
  // Those that read files: others of OpenCV's look for cameras on the USB first, and leak what they find.
  const QuietOpenCv quiet;
  const auto backends = {cv::CAP_FFMPEG, cv::CAP_GSTREAMER, cv::CAP_OPENCV_MJPEG};
  if (std::none_of(backends.begin(), backends.end(),
                   [&](int backend) { return capture->open(path, backend); })) {
    return false;
  }
#if MONO_POSE_TRACKER_OPENCV_SINCE(4, 5)
  // Earlier ones turn nothing. Where the reader knows of no flags it refuses, and that is fine.
  capture->set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
#endif
  return true;
}

std::string cause_of_no_video(const std::string& path) {
  if (lacks_mp4_index(path)) {
    return "cannot be opened as a video: its index (moov) is missing, because the recording was interrupted "
           "or the file was copied in part; expected the whole file";
  }
  return "cannot be opened as a video: expected a format that OpenCV reads";
}

std::string problem_of_end(std::int64_t frames, std::int64_t announced, double min_share) {
  const bool is_early =
      frames + 2 <= announced && static_cast<double>(frames) < min_share * static_cast<double>(announced);
  if (!is_early) return "";
  return "ends after " + std::to_string(frames) + " of the " + std::to_string(announced) +
         " frames stated in its header: it may be damaged";
}

std::unique_ptr<ImageSource> open_video(const std::string& path, std::int64_t key_frame_distance) {
  return std::make_unique<VideoFile>(path, key_frame_distance);
}

}  // namespace mono_pose_tracker
