#include "coded_size.h"

#include <algorithm>
#include <array>

#include "common/quiet_opencv.h"
#include "common/text.h"
#include "common/toolchain.h"
#include "image_header.h"

namespace mono_pose_tracker {
namespace {

using Bytes = std::vector<unsigned char>;

/// Reads a parameter set bit by bit. Zeros follow its end.
class BitReader {
 public:
  /// Without the bytes that keep start codes out of the content (00 00 03 stands for 00 00).
  BitReader(Bytes::const_iterator begin, Bytes::const_iterator end) {
    int zeros = 0;
    for (auto byte = begin; byte != end && bytes_.size() < kMostBytes; ++byte) {
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
  static constexpr std::size_t kMostBytes = 1024;  // the size stands among the first ones
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
  constexpr unsigned kMostSide = 1u << 16;
  if (width > kMostSide || height > kMostSide || x >= width || y >= height) return {};
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
  const unsigned sublayers = in.bits(3);  // beside the first
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
  constexpr int kMostReordered = 16;  // H.264 and H.265
  return kMostReordered + cv::getNumberOfCPUs();
}

}  // namespace mono_pose_tracker
