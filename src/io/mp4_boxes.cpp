#include "mp4_boxes.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>

namespace mono_pose_tracker {
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

/// Looks for an edit list among boxes and in them. Every box of theirs must end within its parent.
bool find_edit_list(std::istream& in, std::uint64_t begin, std::uint64_t end, int depth, bool* is_whole) {
  constexpr int kDeepest = 4;
  bool found = false;
  for (std::uint64_t at = begin; at < end;) {
    const Box box = box_at(in, at, end);
    if (box.type.empty()) {
      *is_whole = false;
      return found;
    }
    found |= box.type == "elst";
    if (depth < kDeepest && may_hold_edit_list(box.type))
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

}  // namespace mono_pose_tracker
