// Map files: bytes as they are, or edits of a good map whose checksums are then made right, so that they
// reach what is behind the checksums.
#include <boost/crc.hpp>
#include <stdexcept>

#include "fuzz_target.h"
#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

using namespace mono_pose_tracker;

namespace {

// See map_file.h: the start, then sections of a name, a size, a checksum and a payload.
constexpr std::size_t kStart = 16, kHead = 12, kChecksum = 4;

const std::string& good_map() {
  static const std::string content = [] {
    const TemporaryFolder folder;
    write_map_file(folder / "a.map", synthetic_saved_maps());
    return folder.read("a.map");
  }();
  return content;
}

void edit(FuzzInput* input, std::string* file) {
  const std::size_t at = input->take<std::uint32_t>() % (file->size() + 1);
  switch (input->take<std::uint8_t>() % 4) {
    case 0:
      file->replace(at, 4, input->take_text(4));
      break;
    case 1:
      file->replace(at, 8, input->take_text(8));
      break;
    case 2:
      file->erase(at, input->take<std::uint16_t>());
      break;
    default:
      file->insert(at, input->take_text(input->take<std::uint8_t>()));
  }
}

void make_checksums_right(std::string* file) {
  for (std::size_t at = kStart; at + kHead + kChecksum <= file->size();) {
    std::uint64_t length = 0;
    std::memcpy(&length, file->data() + at + 4, sizeof(length));
    const std::size_t payload = at + kHead + kChecksum;
    // A length that does not hold is made right as well: it is checked before anything else.
    if (length > file->size() - payload) length = file->size() - payload;
    std::memcpy(&(*file)[at + 4], &length, sizeof(length));
    boost::crc_32_type crc;
    crc.process_bytes(file->data() + at, kHead);
    crc.process_bytes(file->data() + payload, length);
    const std::uint32_t checksum = crc.checksum();
    std::memcpy(&(*file)[at + kHead], &checksum, sizeof(checksum));
    at = payload + length;
  }
}

}  // namespace

FUZZ_TARGET(map_file) {
  FuzzInput input(bytes, size);
  std::string file;
  if (input.take<std::uint8_t>() % 4 == 0) {
    file = input.take_rest();
  } else {
    file = good_map();
    while (!input.empty()) edit(&input, &file);
    make_checksums_right(&file);
  }
  try {
    for (const Map& map : parse_maps(file, "root_sift").maps) map.check();
  } catch (const std::runtime_error& refused) {
    FUZZ_CHECK(is_one_line(refused.what()));
  }
}
