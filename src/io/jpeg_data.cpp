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

// Runs to the end of the data; an eighth of the size is a value a block, so that hardly more than the entropy
// coding is undone. Nothing here has a destructor: libjpeg leaves by longjmp.
void read_data(jpeg_decompress_struct* decoder, const std::vector<unsigned char>& bytes) {
  jpeg_mem_src(decoder, bytes.data(), static_cast<unsigned long>(bytes.size()));
  jpeg_read_header(decoder, TRUE);
  decoder->scale_num = 1;
  decoder->scale_denom = 8;
  decoder->dct_method = JDCT_IFAST;
  jpeg_start_decompress(decoder);
  const JDIMENSION width = decoder->output_width * static_cast<JDIMENSION>(decoder->output_components);
  JSAMPARRAY rows =
      decoder->mem->alloc_sarray(reinterpret_cast<j_common_ptr>(decoder), JPOOL_IMAGE, width, 1);
  while (decoder->output_scanline < decoder->output_height) jpeg_read_scanlines(decoder, rows, 1);
  jpeg_finish_decompress(decoder);
}

}  // namespace

bool jpeg_data_end_early(const std::vector<unsigned char>& bytes) {
  ErrorManager errors;
  jpeg_decompress_struct decoder = {};
  decoder.err = jpeg_std_error(&errors.base);
  errors.base.emit_message = note_warning;
  errors.base.error_exit = refuse;
  if (setjmp(errors.refused) == 0) {
    jpeg_create_decompress(&decoder);
    read_data(&decoder, bytes);
  }
  jpeg_destroy_decompress(&decoder);
  return errors.end_early;
}

}  // namespace mono_pose_tracker
