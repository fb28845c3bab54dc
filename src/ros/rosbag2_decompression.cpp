#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "common/text.h"
#include "rosbag2_storage.h"

namespace mono_pose_tracker {

namespace {

constexpr std::size_t kDecompressedStep = std::size_t{1} << 20;  // what the result grows by, at most

[[noreturn]] void refuse_compressed(const std::string& problem) {
  throw std::runtime_error("cannot be decompressed (" + one_line(problem) + ")");
}

void require_bounded(std::size_t size, std::uint64_t max_bytes) {
  if (size > max_bytes) refuse_compressed("it has more than " + std::to_string(max_bytes) + " bytes");
}

std::string decompress_zstd(const char* data, std::size_t size, std::uint64_t max_bytes) {
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
  if (!context) refuse_compressed("no memory");
  ZSTD_inBuffer in{data, size, 0};
  std::string result;
  std::size_t left = 1;
  while (left != 0) {
    const std::size_t before = result.size();
    result.resize(before + kDecompressedStep);
    ZSTD_outBuffer out{result.data() + before, kDecompressedStep, 0};
    const std::size_t read = in.pos;
    left = ZSTD_decompressStream(context.get(), &out, &in);
    if (ZSTD_isError(left)) refuse_compressed(ZSTD_getErrorName(left));
    result.resize(before + out.pos);
    require_bounded(result.size(), max_bytes);
    if (left != 0 && out.pos == 0 && in.pos == read) refuse_compressed("it is truncated");
  }
  return result;
}

std::string decompress_lz4(const char* data, std::size_t size, std::uint64_t max_bytes) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) refuse_compressed("no memory");
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(made,
                                                                             LZ4F_freeDecompressionContext);
  std::string result;
  std::size_t left = 1;
  while (left != 0) {
    const std::size_t before = result.size();
    result.resize(before + kDecompressedStep);
    std::size_t written = kDecompressedStep, read = size;
    left = LZ4F_decompress(context.get(), result.data() + before, &written, data, &read, nullptr);
    if (LZ4F_isError(left)) refuse_compressed(LZ4F_getErrorName(left));
    result.resize(before + written);
    require_bounded(result.size(), max_bytes);
    if (left != 0 && written == 0 && read == 0) refuse_compressed("it is truncated");
    data += read;
    size -= read;
  }
  return result;
}

}  // namespace

std::string decompress(const std::string& compression, const char* data, std::size_t size,
                       std::uint64_t max_bytes) {
  if (compression == "zstd") return decompress_zstd(data, size, max_bytes);
  if (compression == "lz4") return decompress_lz4(data, size, max_bytes);
  if (!compression.empty()) {
    refuse_compressed("'" + compression.substr(0, 20) + "' is not known: expected zstd, lz4 or none");
  }
  require_bounded(size, max_bytes);
  return std::string(data, size);
}

}  // namespace mono_pose_tracker
