#include "jpeg_data.h"

#include <csetjmp>
#include <cstddef>
#include <cstdio>
// Needs size_t and FILE.
#include <jerror.h>
#include <jpeglib.h>

namespace mono_pose_tracker {
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

}  // namespace mono_pose_tracker
